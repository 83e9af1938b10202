"""Run a mission: the sequencers of all quadcopters, one flight log and one journal.

One loop reads the messages and ticks each quadcopter's sequencer. One lock guards the flight log
against contacts, which arrive in a thread of rospy.
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
from quad_nav.ros.common.conversions import replacing_markers
from quad_nav.ros.common.diagnostics import DiagnosticsTopic
from quad_nav.ros.common.readiness import Need
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.ros.sequencer.mission_diagnostics import contact_from_message, progress_message
from quad_nav.ros.sequencer.mission_journal import MissionJournal
from quad_nav.ros.sequencer.robot import MissionRobot
from quad_nav.scenario.mission_setup import MissionSetup
from quad_nav.topics.flight_info import CONTACT_STATUS, FLIGHT_TOPIC, mission_info, to_text
from quad_nav.topics.markers import goal_markers

START_SERVICE = "/simulation/start"
WAIT_S = 0.2  # wall time, as the next; longest delay until the node notices a shutdown
GATHER_S = 0.02  # odometry of one time arrives in one message per quadcopter


class MissionRunner:
    """The flights of all quadcopters."""

    def __init__(self, setup: MissionSetup, respawned: bool = False) -> None:
        """Connect to all topics, and read the journal to resume a mission.

        Args:
            setup: The checked parameters.
            respawned: Whether an earlier sequencer of this flight has been killed.

        Raises:
            InputError: If the journal is not valid.
        """
        self._setup, self._respawned = setup, respawned
        self._journal = MissionJournal(setup.journal, [robot.name for robot in setup.robots])
        self._before = self._journal.read() if setup.resume or respawned else None
        if self._before is None:
            self._journal.begin(0.0)  # removes the journal of an older mission
        self._lock = threading.Lock()
        self._transforms = Transforms()
        self._received = threading.Event()
        self.robots = [
            MissionRobot(index, goals, self._transforms, self._received)
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
        goals = {robot.name: robot.sequence for robot in setup.robots}
        self._flight.publish(to_text(mission_info(goals, setup.parameters, setup.robot_radius_m)))
        self._publish_goals()

    @property
    def is_done(self) -> bool:
        """True when all sequencers are done."""
        return all(robot.sequencer.done for robot in self.robots)

    def needs(self) -> List[Need]:
        """Return the conditions for the start of the mission."""
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
        """Start the simulation, and begin or resume the mission.

        Raises:
            ServiceException: If the simulator refuses.
        """
        self._start_simulation()
        with self._lock:
            if self._before is None:
                self._begin(rospy.get_time())
            else:
                self._resume(self._before, rospy.get_time())
        for robot in self.robots:
            robot.link.pop()  # messages from before the start are not part of the flight

    def _start_simulation(self) -> None:
        if self._setup.simulation:
            response = rospy.ServiceProxy(START_SERVICE, Trigger)()
            if not response.success:
                raise rospy.ServiceException(response.message or "refused without giving a reason")

    def advance(self) -> None:
        """Wait for odometry, then process all messages."""
        self._received.wait(WAIT_S)
        self._received.clear()
        time.sleep(GATHER_S)
        inboxes = [robot.link.pop() for robot in self.robots]
        with self._lock, _topics_may_close():
            now_s = rospy.get_time()
            if any(robot.was_reset(inbox) for robot, inbox in zip(self.robots, inboxes)):
                rospy.logwarn("sequencer: simulation was reset; restarting the mission")
                self._begin(now_s)
            elif now_s < self._now_s:
                rospy.logwarn(
                    "sequencer: /clock jumped back by %.2f s; resuming the mission",
                    self._now_s - now_s,
                )
                self._resume(self._checkpoint(), now_s)
                self._start_new_simulation()
            self._now_s = now_s
            changed = [
                robot.step(inbox, now_s, self._log, self._write_journal)
                for robot, inbox in zip(self.robots, inboxes)
            ]
            if any(changed):
                self._publish_goals()

    def publish_progress(self) -> None:
        """Publish the progress on `/diagnostics` and retry failed writes of the journal."""
        with self._lock, _topics_may_close():
            self._diagnostics.publish(progress_message(self.robots, self._log))
            self._journal.flush()

    def stop_reason(self) -> str:
        """Return why the node stops before the mission is done."""
        fault = readiness.lost_service(START_SERVICE, "simulator") if self._setup.simulation else ""
        return fault or "stopped before all goals were reached"

    def summary(self, reason: str = "") -> MissionSummary:
        """Summarize the flight so far; `reason` says why it stopped early."""
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

    def _start_new_simulation(self) -> None:
        """Start a restarted simulator: its clock is new and it is paused."""
        try:
            self._start_simulation()
        except rospy.ServiceException as error:
            rospy.logwarn("sequencer: %s failed: %s", START_SERVICE, error)

    def _checkpoint(self) -> MissionCheckpoint:
        """Return the progress in a form that does not depend on the clock."""
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
        """Resume the mission from a checkpoint."""
        self._now_s, self._log = now_s, self._new_log()
        self._journal.resume(before, now_s, same_clock=self._respawned)
        start_s = self._journal.start_s
        for robot in self.robots:
            checkpoint = before.robots[robot.name]
            state = checkpoint.log if self._respawned else replace(checkpoint.log, pose=None)
            self._log.resume(robot.name, state, checkpoint.clearance_m, checkpoint.separation_m)
            robot.begin(now_s, shift_to_clock(checkpoint.progress, start_s))
            rospy.loginfo(
                "%s: resuming goal %d of %d, lap %d",
                robot.name,
                checkpoint.progress.index + 1,
                len(robot.sequencer.sequence.goals),
                checkpoint.progress.lap,
            )
        for contact in before.contacts:
            self._log.add_contact(replace(contact, time_s=contact.time_s + start_s))

    def _write_journal(self, robot: MissionRobot, leg: Optional[Leg]) -> None:
        self._journal.write_robot(robot.name, robot.sequencer, self._log, leg, self._now_s)

    def _new_log(self) -> FlightLog:
        return FlightLog(
            [robot.name for robot in self._setup.robots],
            self._setup.robot_radius_m,
            self._setup.surface_distance,
        )

    def _publish_goals(self) -> None:
        heights = [robot.pose.z_m for robot in self.robots if robot.pose is not None]
        altitude_m = self._setup.altitude_m
        if altitude_m is None:
            altitude_m = heights[0] if heights else 0.0
        self._goals.publish(
            replacing_markers(goal_markers([robot.sequencer for robot in self.robots], altitude_m))
        )

    def _on_contact(self, message: DiagnosticStatus) -> None:
        if message.name != CONTACT_STATUS:
            return
        try:
            contact = contact_from_message(message)
        except ValueError as error:
            rospy.logwarn("%s: contact dropped: %s", self._contacts.resolved_name, error)
            return
        with self._lock:
            is_new = self._log.add_contact(contact)
            if is_new:
                self._journal.write_contact(contact, self._now_s)
        if is_new:
            rospy.logwarn(
                "%s: CONTACT with %s at (%.2f, %.2f) m",
                contact.robot,
                contact.other,
                contact.x_m,
                contact.y_m,
            )


@contextlib.contextmanager
def _topics_may_close() -> Iterator[None]:
    """Ignore errors of publishing at shutdown, when rospy has closed the topics."""
    try:
        yield
    except rospy.ROSException:
        # is_shutdown() turns true only after the topics have been closed.
        if not rospy.core.is_shutdown_requested():
            raise


def _robot_needs(robot: MissionRobot) -> List[Need]:
    link = robot.link

    def missing_pose() -> str:
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
        Need(lambda: not missing_pose(), missing_pose),
        Need(
            lambda: link.goals.get_num_connections() > 0,
            lambda: readiness.missing_subscriber(link.goals.resolved_name),
        ),
    ]
