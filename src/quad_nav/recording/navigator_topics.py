"""Topics that one robot's ``move_base`` publishes."""

from __future__ import annotations

from typing import Any, Dict, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.config.plugins import plugin_name
from quad_nav.control.controller import Control
from quad_nav.costmap.cost_grid import Window
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.footprint import oriented
from quad_nav.geometry import Pose2D
from quad_nav.loop.navigator_group import LoopRobot
from quad_nav.navigator.tick import RecoveryStart, RobotPoses, Tick
from quad_nav.recording import messages
from quad_nav.recording.action_topics import ActionTopics
from quad_nav.recording.record_file import TopicWriter, stamp_at
from quad_nav.topics.publishing import CostmapSchedule
from quad_nav.topics.robot_topics import RobotTopicSchedule
from quad_nav.topics.tracked_obstacles import (
    MARKERS_TOPIC,
    TRACKS_TOPIC,
    TrackSchedule,
    obstacle_fields,
    track_markers,
)

_NO_PLAN = np.zeros((0, 3))


class NavigatorTopics:
    """Writes ticks as the topics of the node ``move_base``."""

    def __init__(self, robot: int, hosted: LoopRobot, topics: TopicWriter) -> None:
        """Write the topics of robot number ``robot``."""
        navigator = hosted.navigator
        self._scan_filters, self._tracks = hosted.scan_filters, TrackSchedule()
        self.action = ActionTopics(robot, topics, navigator.global_costmap.params.global_frame)
        self._topics = topics
        self._navigator = navigator
        self._node = f"/move_base{robot}"
        self._command_topic = f"/cmd_vel{robot}"
        self._schedule = RobotTopicSchedule()
        self._costmaps: Dict[str, Tuple[LayeredCostmap, CostmapSchedule]] = {
            name: (costmap, CostmapSchedule(costmap))
            for name, costmap in (
                ("global", navigator.global_costmap),
                ("local", navigator.local_costmap),
            )
        }
        self._published: Dict[str, bool] = {}

    def write(self, tick: Tick, poses: RobotPoses) -> None:
        """Write the topics of one tick.

        Args:
            tick: Result of the tick.
            poses: Robot poses of the tick; both must be known.
        """
        stamp = stamp_at(tick.now_s)
        assert poses.in_global is not None and poses.in_local is not None
        for topic, fields in self._schedule.pop(tick, poses.in_global):
            content = messages.stamped(topic.kind, fields, stamp)
            self._write(topic.name, stamp, content, latched=topic.is_latched)
        self._write_obstacles(tick.now_s, stamp)
        if tick.command is not None:
            command = messages.command(tick.command)
            self._topics.write(self._command_topic, stamp, command, self._node)
        self._write_plans(tick, stamp)
        if tick.recovery is not None:
            self._write_recovery(tick.recovery, poses.in_global, stamp)
        if tick.cycle:
            self.action.feedback(tick.now_s, poses.in_global)
        pose_of = {"global": poses.in_global, "local": poses.in_local}
        for name, window in tick.windows.items():
            self._write_costmap(name, window, pose_of[name], tick.now_s)
        if tick.outcome is not None:
            self.action.finish(tick.now_s, tick.outcome)

    def _write_obstacles(self, now_s: float, stamp: int) -> None:
        tracks = self._tracks.pop(now_s, self._scan_filters.tracks(now_s))
        if tracks is None:
            return
        frame = self._navigator.local_costmap.params.global_frame
        shown = track_markers(tracks, frame)
        self._write(MARKERS_TOPIC, stamp, messages.marker_array(shown, replaces_all=True))
        obstacles = {
            name: [messages.stamped("quad/MovingObstacle", fields, stamp) for fields in each]
            for name, each in obstacle_fields(tracks).items()
        }
        own = stamp_at(tracks.time_s) if len(tracks) else stamp
        told = messages.stamped("quad/MovingObstacles", obstacles, own, frame)
        self._write(TRACKS_TOPIC, stamp, told)

    def _write_plans(self, tick: Tick, stamp: int) -> None:
        """Write the plans; a failed search publishes an empty plan, which clears the display."""
        plan = tick.plan if tick.plan is not None else _NO_PLAN if tick.planning_failed else None
        if plan is not None:
            frame = self._navigator.global_costmap.params.global_frame
            planner = plugin_name(self._navigator.params.base_global_planner)
            self._write_path(f"{planner}/plan", plan, frame, stamp, stamp)
        if tick.control is not None:
            self._write_control(tick.control, stamp)

    def _write_control(self, control: Control, stamp: int) -> None:
        frame = self._navigator.local_costmap.params.global_frame
        controller = plugin_name(self._navigator.params.base_local_planner)
        # As in C++ move_base, the plan that the controller follows has no stamp.
        for name, plan, own_stamp in (
            ("global_plan", control.global_plan, 0),
            ("local_plan", control.local_plan, stamp),
        ):
            if len(plan):
                self._write_path(f"{controller}/{name}", plan, frame, stamp, own_stamp)

    def _write_path(
        self, name: str, plan: NDArray[np.float64], frame: str, stamp: int, own: int
    ) -> None:
        self._topics.write_bytes(
            f"{self._node}/{name}",
            "nav_msgs/Path",
            stamp,
            messages.plan_bytes(plan, frame, own),
            self._node,
        )

    def _write_recovery(self, start: RecoveryStart, pose: Pose2D, stamp: int) -> None:
        frame = self._navigator.global_costmap.params.global_frame
        at = messages.pose_stamped(messages.planar_pose(pose), frame, stamp)
        told = (at, start.index, start.total, start.name)
        content = messages.message("move_base_msgs/RecoveryStatus", *told)
        self._write("recovery_status", stamp, content)

    def _write_costmap(self, name: str, window: Window, pose: Pose2D, now_s: float) -> None:
        """Write the full grid, latched, at the first update, and changes at the costmap's rate."""
        costmap, updates = self._costmaps[name]
        frame, stamp = costmap.params.global_frame, stamp_at(now_s)
        footprint = messages.polygon(oriented(costmap.footprint, pose), frame, stamp)
        self._write(f"{name}_costmap/footprint", stamp, footprint)
        is_due, is_first = updates.add(now_s, window), name not in self._published
        if not is_due and not is_first:
            return
        self._published[name] = True
        changed = updates.pop()
        if updates.pop_full_grid():
            grid = messages.occupancy_grid(costmap.spec, costmap.costs, frame, stamp)
            self._write(f"{name}_costmap/costmap", stamp, grid, latched=True)
        elif not changed.is_empty:
            corner = changed.x0, changed.y0
            part = messages.grid_update(costmap.costs[changed.slices], *corner, frame, stamp)
            self._write(f"{name}_costmap/costmap_updates", stamp, part)

    def _write(self, name: str, stamp: int, content: Any, latched: bool = False) -> None:
        self._topics.write(f"{self._node}/{name}", stamp, content, self._node, latched)
