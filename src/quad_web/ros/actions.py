"""Carry out what people do to a flight of ROS nodes, and say what came of it."""

from __future__ import annotations

import math
import threading
import time
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty, SetBool, SetBoolRequest, Trigger

from quad_nav.geometry import Pose2D
from quad_nav.mission.goal import goal_faults
from quad_nav.mission.place_check import PlaceCheck
from quad_nav.mission.robot_goals import goal_paths
from quad_nav.ros.common.conversions import pose_estimate_message
from quad_nav.ros.common.nav_messages import planar_pose, pose_stamped
from quad_nav.ros.sequencer.mission_stop import RESUME_SERVICE, STOP_SERVICE, STOPPED_PARAMETER
from quad_nav.scenario.goal_checks import place_check
from quad_nav.sim.simulation_params import FASTEST_RATE
from quad_nav.topics.goal_routing import GoalRouter
from quad_web.ros.calls import PATIENCE_S, CallFailed, call, in_threads, set_number
from quad_web.ros.parameters import NavigatorParameters
from quad_web.ros.source import FlightSource
from quad_web.view.actions import FLIGHT_ACTIONS, Answer, ParameterView
from quad_web.view.goal_files import GoalEditing, GoalFiles
from quad_web.view.localization import GIVEN_COVARIANCE, SEARCHES, given_text

_CONNECTS_WITHIN_S = 2.0
_STOPS_WITHIN_S = 0.4  # then the goals are cancelled from here, whatever the sequencer does
_POLL_S = 0.02


class FlightActions(GoalEditing):
    """Steers a flight by its services and topics."""

    available = FLIGHT_ACTIONS

    def __init__(self, source: FlightSource, robots: int, goals: Path) -> None:
        """Steer the flight that ``source`` shows, with the goal files of a folder."""
        self._source, self._robots = source, range(robots)
        self._cancels = [
            rospy.Publisher(f"/move_base{i}/cancel", GoalID, queue_size=1) for i in self._robots
        ]
        self._goals = [
            rospy.Publisher(f"/move_base_simple/goal{i}", PoseStamped, queue_size=1)
            for i in self._robots
        ]
        self._poses: Dict[int, rospy.Publisher] = {}
        self._parameters = NavigatorParameters(source.trees)
        files = {k: one.path for k, one in goal_paths(goals, robots)[0].items()}
        self._files = GoalFiles(files, self._check_of)
        self._checks: Dict[int, Any] = {}  # with what they were made of

    # -- time ----------------------------------------------------------------------------

    def call(self, name: str, *arguments: Any) -> Any:
        """Return what comes of an action, also if a node fails."""
        try:
            return super().call(name, *arguments)
        except CallFailed as error:
            return Answer(False, str(error))

    def start(self) -> Answer:
        """Start the simulation, resume a mission that was stopped, fly one that ended again."""
        if self._source.flight_state == "ended":
            return self.reset()
        texts = []
        is_stopped = self._source.is_stopped
        if self._source.health.has_simulator or not is_stopped:
            texts.append(_triggered("/simulation/start"))
            self._source.expect(paused=False)
        if is_stopped:
            texts.append(_triggered(RESUME_SERVICE))
            self._source.expect(stopped=False)
        return Answer(True, "; ".join(texts))

    def pause(self) -> Answer:
        """Stop the clock."""
        text = _triggered("/simulation/pause")
        self._source.expect(paused=True)
        return Answer(True, text)

    def reset(self) -> Answer:
        """Put every robot back to its start pose."""
        return Answer(True, _triggered("/simulation/reset"))

    def set_rate(self, rate: float) -> Answer:
        """Set simulated seconds per second; 0 is as fast as it goes."""
        if not 0.0 <= rate <= FASTEST_RATE:
            return Answer(False, f"rate {rate:g}; expected 0 to {FASTEST_RATE:g}")
        set_rate = set_number("/simulator", "rate", rate or 1000.0)
        is_fastest = set_rate >= FASTEST_RATE
        text = "the simulation goes as fast as it can" if is_fastest else f"rate {set_rate:g}"
        return Answer(True, text)

    # -- goals ---------------------------------------------------------------------------

    def send_goal(self, robot: Optional[int], pose: Pose2D) -> Answer:
        """Send a robot to a pose in ``map``; None sends the one that is nearest to it."""
        faults = list(goal_faults([pose.x_m, pose.y_m, pose.yaw_rad]))
        if faults:
            return Answer(False, f"goal{faults[0]}")
        why = ""
        if robot is None:
            positions = {
                i: (x_m, y_m)
                for i, (x_m, y_m) in enumerate(self._source.bodies.positions.tolist())
                if math.isfinite(x_m)
            }
            route = GoalRouter().route(pose.x_m, pose.y_m, positions)
            if route is None:
                return Answer(False, "goal not sent: the pose of no quadcopter is known")
            robot, why = route.robot, f", {route.reason}"
        if robot not in self._robots:
            return Answer(False, f"quad{robot}: there is no such quadcopter")
        place = f"({pose.x_m:.2f}, {pose.y_m:.2f})"
        fault = self._check_of(robot)(pose.x_m, pose.y_m)
        if fault:
            return Answer(False, f"quad{robot}: goal not sent: {place} {fault}")
        return self._send(robot, pose, f"goal {place} m sent{why}")

    def _send(self, robot: int, pose: Pose2D, text: str) -> Answer:
        publisher = self._goals[robot]
        if not _is_heard(publisher):
            return Answer(
                False,
                f"quad{robot}: goal not sent: no node subscribes to {publisher.resolved_name};"
                " expected its navigator",
            )
        publisher.publish(pose_stamped(planar_pose(pose), "map", _now()))
        self._source.show_goal(robot, pose)
        goals = self._source.health.progress(robot)
        if goals.goal is not None and not goals.is_stopped:
            text += f"; its mission goes on with goal {goals.goal} of {goals.goals} then"
        return Answer(True, f"quad{robot}: {text}")

    def cancel(self, robot: int) -> Answer:
        """Cancel the goal of a robot; its mission goes on with the next goal."""
        if robot not in self._robots:
            return Answer(False, f"quad{robot}: there is no such quadcopter")
        if not self._cancels[robot].get_num_connections():
            return Answer(False, f"quad{robot}: not cancelled: its navigator does not run")
        progress = self._source.health.progress(robot)
        self._cancels[robot].publish(GoalID())  # without an id: all goals
        self._source.show_goal(robot, None)
        text = f"quad{robot}: goal cancelled"
        if progress.goal is None or progress.is_stopped:
            return Answer(True, f"{text}; it hovers")
        if progress.goal < (progress.goals or 0):
            return Answer(True, f"{text}; its mission goes on with goal {progress.goal + 1}")
        return Answer(True, f"{text}; it was the last one of its mission or lap")

    def stop_all(self) -> Answer:
        """Cancel all goals and stop the mission, with or without a sequencer that responds."""
        outcome: List[str] = []
        failure: List[str] = []
        stopped = threading.Event()

        def stop() -> None:
            try:
                outcome.append(_triggered(STOP_SERVICE))
            except CallFailed as error:
                failure.append(str(error))
            stopped.set()

        threading.Thread(target=stop, daemon=True).start()
        stopped.wait(_STOPS_WITHIN_S)  # a sequencer that knows does not skip the goals
        self._cancel_all()
        if not outcome:
            stopped.wait(PATIENCE_S)
            self._cancel_all()
        if not outcome:  # another sequencer that starts stays stopped
            in_threads([lambda: rospy.set_param(STOPPED_PARAMETER, True)])
        silent = [i for i in self._robots if not self._cancels[i].get_num_connections()]
        if silent:
            names = ", ".join(f"quad{i}" for i in silent)
            return Answer(False, f"all goals cancelled, but of {names}: no navigator is connected")
        hover = "every quadcopter hovers"
        if not outcome:
            why = failure[0] if failure else f"{STOP_SERVICE}: no response"
            return Answer(True, f"all goals cancelled: {hover}; no mission stopped: {why}")
        self._source.expect(stopped=True)
        return Answer(True, f"missions stopped: {hover}; Resume continues them")

    def _cancel_all(self) -> None:
        for robot, publisher in enumerate(self._cancels):
            publisher.publish(GoalID())
            self._source.show_goal(robot, None)

    # -- one robot -----------------------------------------------------------------------

    def clear_costmaps(self, robot: int) -> Answer:
        """Clear the obstacles in a robot's costmaps."""
        call(f"/move_base{robot}/clear_costmaps", Empty)
        return Answer(True, f"quad{robot}: costmaps cleared")

    def enable_lidar(self, robot: int, is_on: bool) -> Answer:
        """Switch a robot's LIDAR on or off."""
        request = SetBoolRequest(bool(is_on))
        return Answer(True, _succeeded(call(f"/simulation/lidar{robot}/enable", SetBool, request)))

    def set_pose(self, robot: int, pose: Pose2D) -> Answer:
        """Tell a robot where it is, as RViz does."""
        faults = list(goal_faults([pose.x_m, pose.y_m, pose.yaw_rad]))
        if faults or robot not in self._robots:
            return Answer(False, f"quad{robot}: pose{faults[0] if faults else ': no such robot'}")
        topic = f"/initialpose{robot}"
        if robot not in self._poses:
            self._poses[robot] = rospy.Publisher(topic, PoseWithCovarianceStamped, queue_size=1)
        if not _is_heard(self._poses[robot]):
            return Answer(False, f"quad{robot}: no node subscribes to {topic}; expected amcl, slam")
        given = pose_estimate_message(pose, GIVEN_COVARIANCE, "map", _now())
        self._poses[robot].publish(given)
        return Answer(True, f"quad{robot}: {given_text(pose)}")

    def set_uniform(self, robot: int) -> Answer:
        """Let a robot search the whole map."""
        call(f"/amcl{robot}/global_localization", Empty)
        return Answer(True, f"quad{robot}: {SEARCHES}")

    def parameters(self, robot: int) -> List[ParameterView]:
        """Return the parameters of a robot's navigator; none if it does not respond."""
        try:
            return self._parameters.views(robot)
        except CallFailed as error:
            rospy.logwarn("web: quad%d: parameters cannot be shown: %s", robot, error)
            return []

    def set_parameters(self, robot: int, namespace: str, values: Mapping[str, Any]) -> Answer:
        """Change parameters of one namespace."""
        try:
            return self._parameters.set(robot, namespace, values)
        except CallFailed as error:
            return Answer(False, f"quad{robot}: {error}")

    def _check_of(self, robot: int) -> PlaceCheck:
        """Return the check of a robot's goals against the scene and its global costmap."""
        reports = self._source.reports
        known = reports.scene, reports.radius_m, self._source.trees.configuration(robot)
        if robot not in self._checks or self._checks[robot][0] != known:
            self._checks[robot] = known, place_check(*known)
        check: PlaceCheck = self._checks[robot][1]
        return check


def _is_heard(publisher: rospy.Publisher) -> bool:
    """Wait for a subscriber; return False if none comes."""
    end_s = time.monotonic() + _CONNECTS_WITHIN_S
    while not publisher.get_num_connections():
        if time.monotonic() > end_s:
            return False
        time.sleep(_POLL_S)
    return True


def _triggered(name: str) -> str:
    """Call a service and return its message.

    Raises:
        CallFailed: See `call`; also if the service refuses.
    """
    return _succeeded(call(name, Trigger))


def _succeeded(response: Any) -> str:
    if not response.success:
        raise CallFailed(response.message or "refused without giving a reason")
    return str(response.message)


def _now() -> rospy.Time:
    """Return the time on the clock, which this node does not hear all the time."""
    if rospy.rostime.is_wallclock():
        return rospy.Time.now()
    try:
        return rospy.wait_for_message("/clock", Clock, 1.0).clock
    except rospy.ROSException:
        return rospy.Time.now()
