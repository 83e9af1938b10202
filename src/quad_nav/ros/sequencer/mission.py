"""Run a mission: the threads of all quadcopters, one flight log and one journal.

Each quadcopter has a thread. The main thread watches them: it restarts the mission after a reset,
resumes it after a clock jump, and publishes goals and progress.
"""

from __future__ import annotations

import contextlib
import json
import threading
import time
from dataclasses import replace
from functools import partial
from typing import Dict, Iterator, List, Optional, Sequence

import rospy
from nav_msgs.msg import Odometry
from quad.msg import FlightInfo
from std_msgs.msg import String, Time
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from quad_nav.mission.checkpoint import MissionCheckpoint
from quad_nav.mission.flight_log import FlightLog
from quad_nav.mission.summary import MissionSummary, summarize, to_json
from quad_nav.ros.common import readiness
from quad_nav.ros.common.diagnostics import DiagnosticsTopic, ThrottledWarnings
from quad_nav.ros.common.marker_messages import replacing_markers
from quad_nav.ros.common.own_messages import flight_info_message
from quad_nav.ros.common.readiness import Need
from quad_nav.ros.common.transforms import TransformUnavailable
from quad_nav.ros.sequencer.flight_record import FlightRecord
from quad_nav.ros.sequencer.mission_diagnostics import progress_message
from quad_nav.ros.sequencer.mission_journal import MissionJournal
from quad_nav.ros.sequencer.mission_stop import MissionStop, VehicleStates
from quad_nav.ros.sequencer.robot import MissionRobot
from quad_nav.ros.sequencer.robot_thread import RobotThread
from quad_nav.ros.sequencer.simulator_topics import ContactTopic, PeopleTopic
from quad_nav.ros.sequencer.state_feed import StateFeed
from quad_nav.scenario.mission_setup import MissionSetup
from quad_nav.topics.flight_info import FLIGHT_TOPIC, RESET_TOPIC, mission_info
from quad_nav.topics.markers import goal_markers
from quad_nav.topics.mission_events import SUMMARY_TOPIC
from quad_nav.topics.validation import MAX_LEAD_S

WAIT_S = 0.2  # wall time, as the next; longest delay until the node notices a shutdown
GOALS_PERIOD_S = 0.2  # shortest time between two messages with the goals of all robots
PAUSE_S = 1.0  # longest wait for a step of a robot that is in progress
MOST_AHEAD_S = 60.0  # simulated; /clock may be as far behind on a busy machine
END_S = 5.0  # longest wait for the journal at the end


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
        journal = MissionJournal(setup.journal, [robot.name for robot in setup.robots])
        self._before = journal.read() if setup.resume or respawned else None
        if self._before is None:
            journal.begin(0.0)  # removes the journal of an older mission
            journal.wait()
        self._record = FlightRecord(self._new_log, journal)
        self._news = threading.Event()
        self._feed = StateFeed(len(setup.robots))
        self.robots = [
            MissionRobot(index, goals, self._feed, configuration)
            for index, (goals, configuration) in enumerate(zip(setup.robots, setup.configurations))
        ]
        self._threads = [
            RobotThread(robot, self._record, self._news, len(self.robots)) for robot in self.robots
        ]
        self._seed: Optional[int] = rospy.get_param("/simulator/seed", None)
        self._now_s = 0.0
        self._begun_s = 0.0  # a reset after this time restarts the mission
        self._reset_s = 0.0  # the last reset
        self._next_goals_s = 0.0
        self._warnings = ThrottledWarnings()
        self._connect()
        before = self._before.robots if self._before is not None else {}
        for robot in self.robots:
            robot.is_stopped = before[robot.name].progress.held_s is not None if before else False
        self._stop = MissionStop(self.robots, respawned)
        # After a restart no vehicle takes off unless a person says so.
        takes_off = setup.simulation or not (setup.resume or respawned)
        self._vehicles = None if takes_off else VehicleStates(len(self.robots))

    def _connect(self) -> None:
        setup = self._setup
        self._goals = rospy.Publisher("/goals", MarkerArray, queue_size=1, latch=True)
        self._diagnostics = DiagnosticsTopic()
        self._flight = rospy.Publisher(FLIGHT_TOPIC, FlightInfo, queue_size=1, latch=True)
        self._summary = rospy.Publisher(SUMMARY_TOPIC, String, queue_size=1, latch=True)
        goals = {robot.name: robot.sequence for robot in setup.robots}
        info = mission_info(goals, setup.parameters, setup.robot_radius_m)
        self._flight.publish(flight_info_message(info))
        self._publish_goals()
        names = [robot.name for robot in setup.robots]
        self._contacts = ContactTopic(names, self._record, self._warnings)
        if setup.scene is not None and setup.people is not None:
            self._people = PeopleTopic(setup.scene, setup.people, self._record, self._warnings)
        if setup.simulation:
            self._resets = rospy.Subscriber(RESET_TOPIC, Time, self._on_reset)

    @property
    def _hears_contacts(self) -> bool:
        """Whether a node publishes contacts, as `vehicles` does if it has the bodies."""
        return self._contacts.has_publisher

    @property
    def is_done(self) -> bool:
        """True when the missions of all robots have ended."""
        return all(thread.is_done for thread in self._threads)

    def needs(self) -> List[Need]:
        """Return the conditions for the start of the mission."""
        service = self._setup.start_service
        needs = (
            [
                Need(
                    lambda: readiness.service_exists(service),
                    lambda: readiness.missing_service(service),
                )
            ]
            if service
            else []
        )
        for robot in self.robots:
            if not robot.is_stopped:  # such as one whose pilot has switched it off
                needs += _robot_needs(robot, self._feed)
        return needs

    def viewers(self) -> List[Need]:
        """Return a condition for each viewer: it hears what this node publishes."""
        topics = (self._goals.resolved_name, self._flight.resolved_name)
        return [
            Need(
                partial(readiness.hears, node, topics),
                partial("{}: is not ready to show the flight".format, node),
            )
            for node in self._setup.viewers
        ]

    def start(self) -> None:
        """Start the simulation or the vehicles, and begin or resume the mission.

        Raises:
            ServiceException: If the simulator or a vehicle refuses.
        """
        if self._vehicles is None:
            self._start_simulation()
        with self._paused_robots():
            if self._before is None:
                self._begin(rospy.get_time())
            else:
                self._resume(self._before, rospy.get_time(), self._respawned)
        if self._vehicles is not None:
            self._leave_on_ground(self._vehicles.are_down())
        for robot, thread in zip(self.robots, self._threads):
            robot.link.pop()  # messages from before the start are not part of the flight
            thread.start()

    def _leave_on_ground(self, are_down: Sequence[bool]) -> None:
        """Stop the missions of vehicles that are not in the air, and say what a person can do."""
        down = [
            robot
            for robot, is_down in zip(self.robots, are_down)
            if is_down and robot.sequencer.has_goals_left
        ]
        self._stop.stop(down)
        for robot in down:
            number = self.robots.index(robot)
            rospy.logwarn(
                "%s: its vehicle is not in the air, and a resumed mission takes nothing off: the"
                " mission of %s is stopped. Call /vehicle%d/take_off to take it off, then"
                " /vehicle%d/resume to resume its mission",
                robot.name,
                robot.name,
                number,
                number,
            )

    def _start_simulation(self) -> None:
        if self._setup.start_service:
            response = rospy.ServiceProxy(self._setup.start_service, Trigger)()
            if not response.success:
                raise rospy.ServiceException(response.message or "refused without giving a reason")

    def end(self) -> None:
        """Land the vehicles after the last goal, before the node exits."""
        service = self._setup.end_service
        if not service:
            return
        try:
            response = rospy.ServiceProxy(service, Trigger)()
        except (rospy.ServiceException, rospy.ROSException) as error:
            rospy.logerr("sequencer: %s failed: %s", service, error)
            return
        (rospy.loginfo if response.success else rospy.logerr)("sequencer: %s", response.message)

    def advance(self) -> None:
        """Wait for news of the robots, and process them."""
        self._news.wait(WAIT_S)
        self._news.clear()
        self._feed.check()
        with _topics_may_close():
            self._watch_clock(rospy.get_time())
            now_s = time.monotonic()
            if now_s >= self._next_goals_s and any([_pop_change(one) for one in self._threads]):
                self._next_goals_s = now_s + GOALS_PERIOD_S
                self._publish_goals()

    def _watch_clock(self, now_s: float) -> None:
        reset_s, before_s = self._reset_s, self._now_s
        if self._begun_s < reset_s <= now_s + MAX_LEAD_S:
            self._warnings.warn("sequencer: simulation was reset; restarting the mission")
            with self._paused_robots():
                self._begin(now_s)
                self._begun_s = max(now_s, reset_s)
                for robot in self.robots:
                    robot.odometry.begin(self._begun_s)  # without that from before the reset
            for thread in self._threads:
                thread.start()
        elif now_s < before_s or any(robot.clock_went_back for robot in self.robots):
            rospy.logwarn(
                "sequencer: %s jumped back by %.2f s; resuming the mission",
                "the system's clock" if rospy.rostime.is_wallclock() else "/clock",
                max(before_s - now_s, 0.0),
            )
            with self._paused_robots():
                progress = [robot.sequencer.progress for robot in self.robots]
                before_s = max(before_s, *(robot.now_s for robot in self.robots))
                self._resume(self._record.checkpoint(before_s, progress), now_s, False)
            if self._reset_s > now_s:  # on the clock before: this one would reach it, too
                self._reset_s = 0.0
            if self._setup.simulation:
                self._start_new_simulation()
        else:
            self._now_s = now_s

    @contextlib.contextmanager
    def _paused_robots(self) -> Iterator[None]:
        """Let no robot begin a step meanwhile, apart from one that is stuck in a step."""
        with contextlib.ExitStack() as held:
            for robot in self.robots:
                if robot.lock.acquire(timeout=PAUSE_S):
                    held.callback(robot.lock.release)
            yield

    def publish_progress(self) -> None:
        """Publish the progress on `/diagnostics` and retry failed writes of the journal."""
        for thread in self._threads:
            thread.check()
        with _topics_may_close():
            with self._record.lock:
                message = progress_message(self.robots, self._record.log, self._failures)
            self._diagnostics.publish(message)
        self._record.journal.retry()

    def publish_summary(self, summary: Optional[MissionSummary]) -> None:
        """Publish how the mission has ended; None: it flies, again."""
        self._summary.publish("" if summary is None else json.dumps(to_json(summary)))

    @property
    def _failures(self) -> Dict[str, str]:
        return {thread.robot.name: thread.failure for thread in self._threads if thread.failure}

    def summary(self, reason: str = "") -> MissionSummary:
        """Summarize the flight so far; `reason` says why it stopped early."""
        record, journal = self._record, self._record.journal
        journal.wait(patience_s=END_S)
        with self._paused_robots(), record.lock:
            summary = summarize(
                record.log,
                {robot.name: robot.sequencer for robot in self.robots},
                self._now_s,
                sim_time_s=self._now_s - journal.start_s,
                wall_time_s=journal.wall_time_s,
                reason=reason,
                reasons=self._failures,
                seed=self._seed,
                contacts_reported=self._setup.simulation or self._hears_contacts,
            )
            return replace(summary, facts={**self._setup.facts, **record.truth.facts})

    def _begin(self, now_s: float) -> None:
        self._now_s = self._begun_s = now_s
        self._record.begin(now_s)
        for robot in self.robots:
            robot.begin(now_s)

    def _start_new_simulation(self) -> None:
        """Start a restarted simulator: its clock is new and it is paused."""
        try:
            self._start_simulation()
        except rospy.ServiceException as error:
            rospy.logwarn("sequencer: %s failed: %s", self._setup.start_service, error)

    def _resume(self, before: MissionCheckpoint, now_s: float, same_clock: bool) -> None:
        """Resume the mission from a checkpoint."""
        self._now_s = self._begun_s = now_s
        last_s = before.clock_s + before.mission_s
        if same_clock and last_s <= now_s:
            self._begun_s = last_s  # a reset since then counts
        self._record.resume(before, now_s, same_clock)
        for robot in self.robots:
            progress = before.robots[robot.name].progress
            robot.begin(now_s, progress.shifted(self._record.journal.start_s))
            rospy.loginfo(
                "%s: resuming goal %d of %d, lap %d",
                robot.name,
                min(progress.index + 1, len(robot.sequencer.sequence.goals)),
                len(robot.sequencer.sequence.goals),
                progress.lap,
            )

    def _new_log(self) -> FlightLog:
        return FlightLog(
            [robot.name for robot in self._setup.robots],
            self._setup.robot_radius_m,
            self._setup.surface_distance,
        )

    def _publish_goals(self) -> None:
        heights = [robot.pose.z_m for robot in self.robots if robot.pose is not None]
        if self._setup.scene is not None:
            altitude_m = self._setup.scene.altitude_m
        else:
            altitude_m = heights[0] if heights else 0.0
        self._goals.publish(
            replacing_markers(goal_markers([robot.sequencer for robot in self.robots], altitude_m))
        )

    def _on_reset(self, message: Time) -> None:
        reset_s, now_s = message.data.to_sec(), rospy.get_time()
        if reset_s > now_s + MOST_AHEAD_S:
            self._warnings.warn(
                f"{self._resets.resolved_name}: message dropped: reset at {reset_s:.2f} s, /clock"
                f" is at {now_s:.2f} s"
            )
            return
        self._reset_s = reset_s
        self._news.set()


def _pop_change(thread: RobotThread) -> bool:
    if not thread.goals_changed:  # its thread may set it now: only a set one is reset
        return False
    thread.goals_changed = False
    return True


@contextlib.contextmanager
def _topics_may_close() -> Iterator[None]:
    """Ignore errors of publishing at shutdown, when rospy has closed the topics."""
    try:
        yield
    except rospy.ROSException:
        # is_shutdown() turns true only after the topics have been closed.
        if not rospy.core.is_shutdown_requested():
            raise


def _robot_needs(robot: MissionRobot, feed: StateFeed) -> List[Need]:
    link = robot.link

    def has_pose() -> bool:
        feed.check()
        return link.pose_frame is not None

    def missing_pose() -> str:
        if link.pose_frame is None:
            return ""
        try:
            robot.odometry.map_from(link.pose_frame)
        except TransformUnavailable as error:
            return f"/tf: {robot.name}: no map -> {link.pose_frame} yet: {error}"
        return ""

    return [
        Need(
            has_pose,
            lambda: readiness.missing_topic(link.odometry_topic, Odometry._type),
        ),
        Need(lambda: not missing_pose(), missing_pose),
        Need(
            lambda: link.goals.get_num_connections() > 0,
            lambda: readiness.missing_subscriber(link.goals.resolved_name),
        ),
    ]
