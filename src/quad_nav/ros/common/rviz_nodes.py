"""Nodes beside RViz: `goal_router`, and `fleet_rviz`, which starts RViz for many quadcopters.

`goal_router` is one topic of goals and one of poses for the whole fleet. It sends each message of
`/move_base_simple/goal` and `/initialpose` on to one quadcopter's own topic: the selected one, or
the nearest one. A point on `/clicked_point` selects the quadcopter there. It subscribes to the
transforms only while it looks for positions, because those of a fleet are many.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from pathlib import Path
from typing import Any, Dict, Optional, Sequence, Tuple

import numpy as np
import rospkg
import rospy
import yaml
from geometry_msgs.msg import PointStamped, PoseStamped, PoseWithCovarianceStamped
from visualization_msgs.msg import MarkerArray

from quad_nav.errors import InputError, printable
from quad_nav.files.output import reason, write_text
from quad_nav.files.values import is_whole
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.marker_messages import replacing_markers
from quad_nav.ros.common.readiness import init_node
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.scenario.scenario import scene_of
from quad_nav.topics.goal_routing import GoalRouter, Route, selection_markers
from quad_nav.topics.rviz_file import EXIT_BAD_INPUT, arguments, document
from quad_nav.topics.validation import MAX_MAGNITUDE

EXIT_FAILURE = 1
PATIENCE_S = 2.0  # wall time to wait for the transforms of all quadcopters
POLL_S = 0.02


class GoalRouterNode:
    """Subscribers and publishers of the node."""

    def __init__(self, robots: int) -> None:
        self._router = GoalRouter()
        self._lock = threading.Lock()
        self._warnings = ThrottledWarnings()
        self._goals = [
            rospy.Publisher(f"/move_base_simple/goal{i}", PoseStamped, queue_size=1)
            for i in range(robots)
        ]
        self._poses = [
            rospy.Publisher(f"/initialpose{i}", PoseWithCovarianceStamped, queue_size=1)
            for i in range(robots)
        ]
        self._selection = rospy.Publisher("~selection", MarkerArray, queue_size=1, latch=True)
        self._subscribers = [
            rospy.Subscriber("/move_base_simple/goal", PoseStamped, self._on_goal, queue_size=1),
            rospy.Subscriber(
                "/initialpose", PoseWithCovarianceStamped, self._on_pose, queue_size=1
            ),
            rospy.Subscriber("/clicked_point", PointStamped, self._on_click, queue_size=1),
        ]

    def _on_goal(self, message: PoseStamped) -> None:
        with self._lock:
            point = message.pose.position
            located = self._locate("goal", message.header.frame_id, point.x, point.y)
            if located is None:
                return
            place, positions = located
            route = self._router.route(*place, positions)
            if route is None:
                rospy.logerr(
                    "goal_router: goal dropped: no quadcopter has a transform from map to"
                    " base_link{i}"
                )
                return
            self._pass_on("goal", "navigator", message, place, route, self._goals)

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        with self._lock:
            point = message.pose.pose.position
            located = self._locate("pose", message.header.frame_id, point.x, point.y)
            if located is None:
                return
            place, positions = located
            route = self._router.route_pose(*place, positions, len(self._poses))
            if route is None:
                rospy.logerr(
                    "goal_router: pose dropped: several quadcopters have no transform from map to"
                    " base_link{i}; publish it on /initialpose{i}"
                )
                return
            self._pass_on("pose", "localization", message, place, route, self._poses)

    def _pass_on(
        self,
        kind: str,
        receiver: str,
        message: Any,
        place: Tuple[float, float],
        route: Route,
        topics: Sequence[rospy.Publisher],
    ) -> None:
        topic = topics[route.robot]
        told = f"quad{route.robot}: {kind} ({place[0]:.2f}, {place[1]:.2f}) m"
        if not topic.get_num_connections():
            rospy.logerr(
                "%s dropped: no node subscribes to %s, expected its %s",
                told,
                topic.resolved_name,
                receiver,
            )
            return
        rospy.loginfo("%s: %s", told, route.reason)
        topic.publish(message)

    def _on_click(self, message: PointStamped) -> None:
        with self._lock:
            point = message.point
            located = self._locate("point", message.header.frame_id, point.x, point.y)
            if located is None:
                return
            place, positions = located
            rospy.loginfo("goal_router: %s", self._router.click(*place, positions))
            self._selection.publish(replacing_markers(selection_markers(self._router.selected)))

    def _locate(
        self, kind: str, frame: str, x_m: float, y_m: float
    ) -> Optional[Tuple[Tuple[float, float], Dict[int, Tuple[float, float]]]]:
        """Return a message's position in `map` and those of the quadcopters, or log the fault."""
        if not (abs(x_m) <= MAX_MAGNITUDE and abs(y_m) <= MAX_MAGNITUDE):
            self._warnings.warn(
                f"goal_router: {kind} dropped: position ({x_m:g}, {y_m:g}) m, expected finite"
                f" coordinates up to {MAX_MAGNITUDE:g} m",
                kind=kind,
            )
            return None
        transforms = Transforms()
        try:
            positions = self._positions(transforms)
            map_from_frame = transforms.lookup("map", frame)
        except TransformUnavailable as error:
            self._warnings.warn(f"goal_router: {kind} dropped: {error}", kind=f"{kind} frame")
            return None
        finally:
            transforms.close()
        x, y, _ = map_from_frame.transform_points(np.array([[x_m, y_m, 0.0]]))[0]
        return (float(x), float(y)), positions

    def _positions(self, transforms: Transforms) -> Dict[int, Tuple[float, float]]:
        """Return the known positions, as soon as all are known or the patience is over."""
        found: Dict[int, Tuple[float, float]] = {}
        end_s = time.monotonic() + PATIENCE_S
        while len(found) < len(self._goals) and time.monotonic() < end_s:
            time.sleep(POLL_S)
            for robot in range(len(self._goals)):
                try:
                    pose = transforms.lookup("map", f"base_link{robot}")
                except TransformUnavailable:
                    continue
                found[robot] = (pose.x_m, pose.y_m)
        return found


def route_goals() -> int:
    """Run the node `goal_router`; return 0, or 2 if the parameter `robots` is not valid."""
    init_node("goal_router")
    robots = rospy.get_param("~robots", 2)
    if not is_whole(robots) or robots < 1:
        rospy.logfatal("goal_router: robots: %s; expected a whole number, at least 1", robots)
        return EXIT_BAD_INPUT
    node = GoalRouterNode(robots)
    while not rospy.is_shutdown():
        time.sleep(0.2)
    del node
    return 0


def run_rviz() -> int:
    """Write RViz's configuration to the ROS log folder and replace this process by RViz.

    Returns:
        2 if the arguments are not valid, 1 if the file cannot be written; otherwise RViz's exit
        status is the process's own.
    """
    given, others = arguments(sys.argv[1:])
    try:
        content = document(given.robots, scene_of(vars(given)))
    except InputError as error:
        print(printable(error, "\n"), file=sys.stderr)
        return EXIT_BAD_INPUT
    path = Path(rospkg.get_log_dir()) / "quad" / f"fleet-{os.getpid()}.rviz"
    try:
        write_text(path, yaml.safe_dump(content, sort_keys=False))
    except OSError as error:
        message = f"fleet_rviz: {path}: cannot be written: {reason(error)}"
        print(printable(message), file=sys.stderr)
        return EXIT_FAILURE
    os.execvp("rviz", ["rviz", "-d", str(path), *others])
