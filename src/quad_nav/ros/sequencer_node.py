"""The node ``sequencer``: hands N quadcopters their goals and says how well they flew.

Check everything, wait for everything, start the simulation, fly, sum up. One
loop takes what the topics brought and ticks each quadcopter's sequencer; one lock
guards the flight log against contacts, which come in a thread of rospy's.
Timers run on simulated time, so they stand still with a paused simulation.
"""
from __future__ import annotations

import contextlib
import threading
import time
from pathlib import Path
from typing import Iterator, List, Optional

import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from std_msgs.msg import String
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from quad_nav.errors import InputError
from quad_nav.face.flight_info import FLIGHT_TOPIC, mission_info, to_text
from quad_nav.face.goal_markers import goal_markers
from quad_nav.mission.flight_log import FlightLog, unflown
from quad_nav.mission.summary import (
    EXIT_BAD_INPUT,
    EXIT_FAILURE,
    MissionSummary,
    RobotSummary,
    summarize_robot,
    table,
    write_json,
)
from quad_nav.ros import readiness
from quad_nav.ros.diagnostics import DiagnosticsTopic
from quad_nav.ros.marker_messages import only_markers
from quad_nav.ros.mission_diagnostics import contact_from_message, progress
from quad_nav.ros.mission_robot import MissionRobot
from quad_nav.ros.mission_setup import MissionSetup, read_setup, result_path
from quad_nav.ros.readiness import Need
from quad_nav.ros.signals import init_node
from quad_nav.ros.transforms import Transforms, TransformUnavailable
from quad_nav.versions import versions

START_SERVICE = "/simulation/start"
WAIT_S = 0.2  # wall time, as the next: how soon it is seen that the node shall end
GATHER_S = 0.02  # odometry of one instant comes in as many messages as there are quadcopters
DIAGNOSTICS_PERIOD_S = 1.0  # wall time, so that a paused simulation shows its state


class Mission:
    """All quadcopters' flights."""

    def __init__(self, setup: MissionSetup):
        self._setup = setup
        self._lock = threading.Lock()
        self._transforms = Transforms()
        self._news = threading.Event()
        self.robots = [MissionRobot(index, goals, self._transforms, self._news)
                       for index, goals in enumerate(setup.robots)]
        self._log = self._new_log()
        self._seed: Optional[int] = rospy.get_param("/simulator/seed", None)
        self._now_s = self._start_s = 0.0
        self._start_wall_s = 0.0
        self._goals = rospy.Publisher("/goals", MarkerArray, queue_size=1, latch=True)
        self._diagnostics = DiagnosticsTopic()
        self._contacts = rospy.Subscriber("/simulation/contacts", DiagnosticStatus,
                                          self._on_contact)
        self._flight = rospy.Publisher(FLIGHT_TOPIC, String, queue_size=1, latch=True)
        self._flight.publish(to_text(mission_info(
            {robot.name: robot.sequence for robot in setup.robots}, setup.parameters,
            setup.robot_radius_m)))
        self._show_goals()

    @property
    def is_done(self) -> bool:
        return all(robot.sequencer.done for robot in self.robots)

    def needs(self) -> List[Need]:
        """What must be there before the start."""
        needs = [Need(lambda: readiness.service_is_there(START_SERVICE),
                      lambda: readiness.missing_service(START_SERVICE))] \
            if self._setup.simulation else []
        for robot in self.robots:
            needs += _robot_needs(robot)
        return needs

    def start(self) -> None:
        """Start the simulation. Raises ServiceException when it refuses."""
        if self._setup.simulation:
            response = rospy.ServiceProxy(START_SERVICE, Trigger)()
            if not response.success:
                raise rospy.ServiceException(response.message or "refused without a reason")
        with self._lock:
            self._begin(rospy.get_time())
        for robot in self.robots:
            robot.link.take()  # what came while waiting is no part of the flight

    def advance(self) -> None:
        """Waits for news and acts on what has come."""
        self._news.wait(WAIT_S)
        self._news.clear()
        time.sleep(GATHER_S)
        inboxes = [robot.link.take() for robot in self.robots]
        with self._lock, _topics_may_close():
            now_s = rospy.get_time()
            if now_s < self._now_s or any(robot.was_reset(inbox) for robot, inbox
                                          in zip(self.robots, inboxes)):
                rospy.logwarn("the simulation was reset: the mission starts again")
                self._begin(now_s)
            self._now_s = now_s
            changed = [robot.step(inbox, now_s, self._log)
                       for robot, inbox in zip(self.robots, inboxes)]
            if any(changed):
                self._show_goals()

    def publish_progress(self) -> None:
        with self._lock, _topics_may_close():
            self._diagnostics.publish(progress(self.robots, self._log))

    def summary(self, reason: str = "") -> MissionSummary:
        with self._lock:
            robots = [summarize_robot(self._log, robot.name,
                                      self._log.robots[robot.name].all_legs(robot.sequencer,
                                                                            self._now_s))
                      for robot in self.robots]
            return MissionSummary(
                tuple(robots), tuple(self._log.contacts), self._setup.robot_radius_m,
                self._now_s - self._start_s, time.monotonic() - self._start_wall_s, reason,
                contacts_reported=self._setup.simulation, seed=self._seed, versions=versions())

    def _begin(self, now_s: float) -> None:
        self._log = self._new_log()
        self._now_s = self._start_s = now_s
        self._start_wall_s = time.monotonic()
        for robot in self.robots:
            robot.begin(now_s)

    def _new_log(self) -> FlightLog:
        return FlightLog([robot.name for robot in self._setup.robots], self._setup.robot_radius_m,
                         self._setup.clearances_m)

    def _show_goals(self) -> None:
        heights = [robot.pose.z_m for robot in self.robots if robot.pose is not None]
        altitude_m = self._setup.altitude_m
        if altitude_m is None:
            altitude_m = heights[0] if heights else 0.0
        self._goals.publish(only_markers(
            goal_markers([robot.sequencer for robot in self.robots], altitude_m)))

    def _on_contact(self, message: DiagnosticStatus) -> None:
        if message.name != "contact":
            return
        try:
            contact = contact_from_message(message)
        except ValueError as error:
            rospy.logwarn("%s: %s", self._contacts.resolved_name, error)
            return
        with self._lock:
            is_new = self._log.touch(contact)
        if is_new:
            rospy.logwarn("%s: TOUCHED %s at (%.2f, %.2f)", contact.robot, contact.other,
                          contact.x_m, contact.y_m)


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
        Need(lambda: link.odometry_frame is not None,
             lambda: readiness.missing_topic(link.odometry.resolved_name, link.odometry.type)),
        Need(lambda: not why_not_located(), why_not_located),
        Need(lambda: link.goals.get_num_connections() > 0,
             lambda: readiness.missing_subscriber(link.goals.resolved_name)),
    ]


def watch(mission: Mission, exit_when_done: bool, result: Path) -> int:
    """Until the end: progress once a second, and the summary whenever all goals are flown."""
    status: Optional[int] = None
    next_s = 0.0
    while not rospy.is_shutdown():
        mission.advance()
        if time.monotonic() >= next_s:
            next_s = time.monotonic() + DIAGNOSTICS_PERIOD_S
            mission.publish_progress()
        if not mission.is_done:
            status = None
        elif status is None:
            status = report(mission.summary(), result)
            if exit_when_done:
                return status
    if status is None:
        status = report(mission.summary("stopped before all goals were flown"), result)
    return status


def report(summary: MissionSummary, result: Path) -> int:
    """The table on the terminal and the JSON where it belongs; the exit status."""
    print(f"\n{table(summary)}", flush=True)
    if not _write(summary, result):
        return summary.exit_status or EXIT_FAILURE
    print(f"Written to {result}\n", flush=True)
    return summary.exit_status


def _write(summary: MissionSummary, result: Path) -> bool:
    try:
        write_json(summary, result)
    except OSError as error:
        rospy.logerr("%s: cannot be written: %s", result, error.strerror)
        return False
    return True


def fly(setup: MissionSetup, result: Path) -> int:
    """A mission from waiting for its parts to its summary."""
    mission = Mission(setup)
    missing = readiness.wait_for(mission.needs(), setup.ready_timeout_s)
    if missing:
        reason = "stopped while waiting for" if rospy.is_shutdown() else "not ready"
        return _not_flown(setup, result, reason, missing)
    try:
        mission.start()
    except (rospy.ServiceException, rospy.ROSException) as error:
        return _not_flown(setup, result, "the simulation did not start",
                          [f"{START_SERVICE}: {error}"])
    try:
        return watch(mission, setup.exit_when_done, result)
    except Exception as error:  # what was flown is not lost with a fault of ours
        report(mission.summary(f"internal error: {error!r}"), result)
        raise
    finally:
        rospy.signal_shutdown("the sequencer is through")


def _not_flown(setup: MissionSetup, result: Path, reason: str, lines: List[str]) -> int:
    rospy.logfatal("nothing is flown, %s:\n  %s", reason, "\n  ".join(lines))
    robots = tuple(RobotSummary(robot.name, tuple(unflown(robot.sequence)))
                   for robot in setup.robots)
    _write(MissionSummary(robots, robot_radius_m=setup.robot_radius_m,
                          reason=f"{reason}: {'; '.join(lines)}", contacts_reported=False), result)
    return EXIT_FAILURE


def main() -> int:
    """Exit status: 0 all goals reached and nothing touched, 1 otherwise, 2 for bad input."""
    init_node("sequencer")
    name = rospy.get_name()
    parameters = rospy.get_param("~", {})
    result = result_path(parameters)
    try:
        setup = read_setup(parameters, name, result, rospy.get_param("/", {}))
    except InputError as error:
        rospy.logfatal("nothing is flown:\n  %s", "\n  ".join(error.problems))
        _write(MissionSummary((), reason="bad input", problems=tuple(error.problems)), result)
        return EXIT_BAD_INPUT
    for warning in setup.warnings:
        rospy.logwarn("%s", warning)
    return fly(setup, result)

