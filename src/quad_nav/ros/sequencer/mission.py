"""A mission: all quadcopters' sequencers between their topics, one log and one journal.

One loop takes what the topics brought and ticks each quadcopter's sequencer; one lock
guards the flight log against contacts, which come in a thread of rospy's.
"""

from __future__ import annotations

import contextlib
import threading
import time
from dataclasses import replace
from typing import Iterator, List, Optional

import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from std_msgs.msg import String
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from quad_nav.mission.checkpoint import MissionCheckpoint, RobotCheckpoint, shift_to_clock
from quad_nav.mission.flight_log import FlightLog, Leg
from quad_nav.mission.summary import MissionSummary, summarize
from quad_nav.ros.common import readiness
from quad_nav.ros.common.diagnostics import DiagnosticsTopic
from quad_nav.ros.common.marker_messages import replacing_markers
from quad_nav.ros.common.readiness import Need
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.ros.sequencer.mission_diagnostics import contact_from_message, progress
from quad_nav.ros.sequencer.mission_journal import MissionJournal
from quad_nav.ros.sequencer.robot import MissionRobot
from quad_nav.ros.sequencer.setup import MissionSetup
from quad_nav.topics.flight_info import FLIGHT_TOPIC, mission_info, to_text
from quad_nav.topics.markers import goal_markers

START_SERVICE = "/simulation/start"
WAIT_S = 0.2  # wall time, as the next: how soon it is seen that the node shall end
GATHER_S = 0.02  # odometry of one instant comes in as many messages as there are quadcopters


class MissionRunner:
    """All quadcopters' flights.

    ``again`` says that a sequencer of this very flight has died. Raises InputError for a
    journal that cannot be used.
    """

    def __init__(self, setup: MissionSetup, again: bool = False) -> None:
        self._setup, self._again = setup, again
        self._journal = MissionJournal(setup.journal, [robot.name for robot in setup.robots])
        self._before = self._journal.read() if setup.resume or again else None
        if self._before is None:
            self._journal.begin(0.0)  # an older mission's is not to be taken for this one's
        self._lock = threading.Lock()
        self._transforms = Transforms()
        self._news = threading.Event()
        self.robots = [
            MissionRobot(index, goals, self._transforms, self._news)
            for index, goals in enumerate(setup.robots)
        ]
        self._log = self._new_log()
        self._seed: Optional[int] = rospy.get_param("/simulator/seed", None)
        self._now_s = 0.0
        self._goals = rospy.Publisher("/goals", MarkerArray, queue_size=1, latch=True)
        self._diagnostics = DiagnosticsTopic()
        self._contacts = rospy.Subscriber(
            "/simulation/contacts", DiagnosticStatus, self._on_contact
        )
        self._flight = rospy.Publisher(FLIGHT_TOPIC, String, queue_size=1, latch=True)
        self._flight.publish(
            to_text(
                mission_info(
                    {robot.name: robot.sequence for robot in setup.robots},
                    setup.parameters,
                    setup.robot_radius_m,
                )
            )
        )
        self._show_goals()

    @property
    def is_done(self) -> bool:
        return all(robot.sequencer.done for robot in self.robots)

    def needs(self) -> List[Need]:
        """What must be there before the start."""
        needs = (
            [
                Need(
                    lambda: readiness.service_exists(START_SERVICE),
                    lambda: readiness.missing_service(START_SERVICE),
                )
            ]
            if self._setup.simulation
            else []
        )
        for robot in self.robots:
            needs += _robot_needs(robot)
        return needs

    def start(self) -> None:
        """Start the simulation. Raises ServiceException when it refuses."""
        self._start_simulation()
        with self._lock:
            if self._before is None:
                self._begin(rospy.get_time())
            else:
                self._resume(self._before, rospy.get_time())
        for robot in self.robots:
            robot.link.pop()  # what came while waiting is no part of the flight

    def _start_simulation(self) -> None:
        if self._setup.simulation:
            response = rospy.ServiceProxy(START_SERVICE, Trigger)()
            if not response.success:
                raise rospy.ServiceException(response.message or "refused without a reason")

    def advance(self) -> None:
        """Waits for news and acts on what has come."""
        self._news.wait(WAIT_S)
        self._news.clear()
        time.sleep(GATHER_S)
        inboxes = [robot.link.pop() for robot in self.robots]
        with self._lock, _topics_may_close():
            now_s = rospy.get_time()
            if any(robot.was_reset(inbox) for robot, inbox in zip(self.robots, inboxes)):
                rospy.logwarn("the simulation was reset: the mission starts again")
                self._begin(now_s)
            elif now_s < self._now_s:
                rospy.logwarn(
                    "the clock went back by %.2f s: the mission goes on", self._now_s - now_s
                )
                self._resume(self._checkpoint(), now_s)
                self._start_another_simulation()
            self._now_s = now_s
            changed = [
                robot.step(inbox, now_s, self._log, self._keep)
                for robot, inbox in zip(self.robots, inboxes)
            ]
            if any(changed):
                self._show_goals()

    def publish_progress(self) -> None:
        with self._lock, _topics_may_close():
            self._diagnostics.publish(progress(self.robots, self._log))
            self._journal.flush()

    def why_stopped(self) -> str:
        """When the node is to end before its mission has."""
        fault = readiness.lost_service(START_SERVICE, "simulator") if self._setup.simulation else ""
        return fault or "stopped before all goals were flown"

    def summary(self, reason: str = "") -> MissionSummary:
        with self._lock:
            return summarize(
                self._log,
                {robot.name: robot.sequencer for robot in self.robots},
                self._now_s,
                sim_time_s=self._now_s - self._journal.start_s,
                wall_time_s=self._journal.wall_time_s,
                reason=reason,
                seed=self._seed,
                contacts_reported=self._setup.simulation,
            )

    def _begin(self, now_s: float) -> None:
        self._log = self._new_log()
        self._now_s = now_s
        self._journal.begin(now_s)
        for robot in self.robots:
            robot.begin(now_s)

    def _start_another_simulation(self) -> None:
        """One that was started again has a new clock, and stands."""
        try:
            self._start_simulation()
        except rospy.ServiceException as error:
            rospy.logwarn("%s: %s", START_SERVICE, error)

    def _checkpoint(self) -> MissionCheckpoint:
        """For another sequencer, or another clock."""
        start_s = self._journal.start_s
        robots = {
            robot.name: RobotCheckpoint(
                shift_to_clock(robot.sequencer.progress, -start_s),
                self._log.robots[robot.name].state,
                *self._log.distances.minima_of_blocks_m(robot.name),
            )
            for robot in self.robots
        }
        contacts = [replace(one, time_s=one.time_s - start_s) for one in self._log.contacts]
        return MissionCheckpoint(
            start_s,
            self._journal.start_epoch_s,
            self._now_s - start_s,
            self._journal.wall_time_s,
            robots,
            contacts,
        )

    def _resume(self, before: MissionCheckpoint, now_s: float) -> None:
        """From where another sequencer left off."""
        self._now_s, self._log = now_s, self._new_log()
        self._journal.resume(before, now_s, same_clock=self._again)
        start_s = self._journal.start_s
        for robot in self.robots:
            checkpoint = before.robots[robot.name]
            state = checkpoint.log if self._again else replace(checkpoint.log, pose=None)
            self._log.resume(robot.name, state, checkpoint.clearance_m, checkpoint.separation_m)
            robot.begin(now_s, shift_to_clock(checkpoint.progress, start_s))
            rospy.loginfo(
                "%s: goes on with goal %d of %d, lap %d",
                robot.name,
                checkpoint.progress.index + 1,
                len(robot.sequencer.sequence.goals),
                checkpoint.progress.lap,
            )
        for contact in before.contacts:
            self._log.add_contact(replace(contact, time_s=contact.time_s + start_s))

    def _keep(self, robot: MissionRobot, leg: Optional[Leg]) -> None:
        self._journal.keep_robot(robot.name, robot.sequencer, self._log, leg, self._now_s)

    def _new_log(self) -> FlightLog:
        return FlightLog(
            [robot.name for robot in self._setup.robots],
            self._setup.robot_radius_m,
            self._setup.surface_distance,
        )

    def _show_goals(self) -> None:
        heights = [robot.pose.z_m for robot in self.robots if robot.pose is not None]
        altitude_m = self._setup.altitude_m
        if altitude_m is None:
            altitude_m = heights[0] if heights else 0.0
        self._goals.publish(
            replacing_markers(goal_markers([robot.sequencer for robot in self.robots], altitude_m))
        )

    def _on_contact(self, message: DiagnosticStatus) -> None:
        if message.name != "contact":
            return
        try:
            contact = contact_from_message(message)
        except ValueError as error:
            rospy.logwarn("%s: %s", self._contacts.resolved_name, error)
            return
        with self._lock:
            is_new = self._log.add_contact(contact)
            if is_new:
                self._journal.keep_contact(contact, self._now_s)
        if is_new:
            rospy.logwarn(
                "%s: TOUCHED %s at (%.2f, %.2f)",
                contact.robot,
                contact.other,
                contact.x_m,
                contact.y_m,
            )


@contextlib.contextmanager
def _topics_may_close() -> Iterator[None]:
    """At shutdown rospy closes the topics while threads still publish."""
    try:
        yield
    except rospy.ROSException:
        # is_shutdown() turns true only after the topics have been closed.
        if not rospy.core.is_shutdown_requested():
            raise


def _robot_needs(robot: MissionRobot) -> List[Need]:
    link = robot.link

    def why_not_located() -> str:
        if link.odometry_frame is None:
            return ""
        try:
            robot.map_from(link.odometry_frame)
        except TransformUnavailable as error:
            return f"/tf: {error}"
        return ""

    return [
        Need(
            lambda: link.odometry_frame is not None,
            lambda: readiness.missing_topic(link.odometry.resolved_name, link.odometry.type),
        ),
        Need(lambda: not why_not_located(), why_not_located),
        Need(
            lambda: link.goals.get_num_connections() > 0,
            lambda: readiness.missing_subscriber(link.goals.resolved_name),
        ),
    ]
