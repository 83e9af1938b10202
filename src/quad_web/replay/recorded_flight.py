"""A recorded flight at any time, as items of a page."""

from __future__ import annotations

import bisect
import math
import re
import time
from functools import cached_property, partial
from pathlib import Path
from typing import Callable, Dict, Hashable, Iterable, List, Mapping, Optional, Tuple

import numpy as np

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D, Scan
from quad_nav.recording.bag_file import Progress, no_progress
from quad_nav.recording.bag_trace import read_recording
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.topics.obstacle_poses import POSES_KIND, POSES_TOPIC
from quad_nav.topics.tracked_obstacles import TRACKS_TOPIC, rows_of_message
from quad_web.replay.recorded_costmaps import CostmapTrack
from quad_web.replay.recorded_obstacles import ObstacleTrack
from quad_web.replay.recorded_robot import (
    RobotTrack,
    events_of,
)
from quad_web.replay.recording_index import RecordingIndex
from quad_web.view import rows
from quad_web.view.cells import cell_items
from quad_web.view.items import (
    costmap_item,
    line_item,
    poses_item,
    robots_item,
    scan_item,
    scene_item,
    track_item,
)
from quad_web.view.state import Item

SHOWN_FOR_S = 1.0
"""Scans, local plans and tracks are shown for so long, unless there are newer ones."""
_TIMES_AT_ONCE = 200
_MARGIN_M = 0.05  # of peers, where the recording has no parameters
_LAYERS = {
    "scan": (r"/scan([0-9]{1,4})", "sensor_msgs/LaserScan"),
    "local_plan": (r"/move_base([0-9]{1,4})/[^/]+/local_plan", "nav_msgs/Path"),
    "global_costmap": (
        r"/move_base([0-9]{1,4})/global_costmap/costmap",
        "nav_msgs/OccupancyGrid",
    ),
    "local_costmap": (r"/move_base([0-9]{1,4})/local_costmap/costmap", "nav_msgs/OccupancyGrid"),
    "track": (rf"/move_base([0-9]{{1,4}})/{TRACKS_TOPIC}", "quad/MovingObstacles"),
}
_PASSING = ("scan", "local_plan", "track")
_UPDATES = r"/move_base[0-9]{1,4}/(global|local)_costmap/costmap_updates"

Part = Tuple[Hashable, Callable[[], Optional[Item]]]
"""What identifies the state of an item, and what makes it."""


class RecordedFlight:
    """A recorded flight. Its methods are called by one thread.

    Attributes:
        title: Name of the file.
        names: Names of the robots.
        start_s: Time of the first pose.
        end_s: Time of the last pose.
        events: The log of events in order.
        end_reason: Why the flight ended early, "" if it did not.
    """

    def __init__(self, path: Path, progress: Progress = no_progress) -> None:
        """Read the trace, and the index of what is read on demand.

        Raises:
            InputError: As ``bag_trace.read_trace``.
        """
        reader = read_recording(path, progress)
        self._trace = trace = reader.trace(path)
        self._index = RecordingIndex(path, _is_wanted)
        self.title, self.end_reason = path.name, trace.reason
        self.names = [robot.name for robot in trace.robots]
        self._rows = {number: row for row, number in enumerate(reader.flown_robots)}
        self._tracks = [RobotTrack(robot) for robot in trace.robots]
        self.start_s = min(float(robot.times_s[0]) for robot in trace.robots)
        self.end_s = max(float(robot.times_s[-1]) for robot in trace.robots)
        clock, index = reader.clock, self._index
        self._times = {topic: clock.times_s(index.times_ns(topic)) for topic in index.kinds}
        self._topics = self._topics_by_layer()
        obstacles_s = self._times.get(POSES_TOPIC)
        self._obstacles = ObstacleTrack(trace.scene, trace.seed, self._index, obstacles_s)
        self._costmaps: Dict[str, CostmapTrack] = {}
        self._has_time: Callable[[], bool] = lambda: True
        self.events = events_of(trace.robots)
        self.events += [(one.time_s, str(one), "warning", None) for one in trace.contacts]
        self.events.sort(key=lambda event: event[0])

    def close(self) -> None:
        """Close the file."""
        self._index.close()

    @property
    def static_items(self) -> List[Item]:
        """The items that stay the same."""
        items = [robots_item(self.names, self._trace.robot_radius_m)]
        return items + ([scene_item(self._trace.scene)] if self._trace.scene else [])

    @cached_property
    def result(self) -> Item:
        """The item ``result``, of the whole recording."""
        trace = self._trace
        ended = [goal.reached for robot in trace.robots for goal in robot.goals]
        goals = max(len(ended), sum(len(track.goals) for track in self._tracks))
        separation_m, clearance_m = self._least_m()
        is_success = not trace.reason and not trace.contacts and 0 < goals == sum(ended)
        return Item(
            "result",
            {
                "is_success": is_success,
                "reason": trace.reason,
                "reached": sum(ended),
                "goals": goals,
                "contacts": len(trace.contacts),
                "sim_time_s": self.end_s - self.start_s,
                "wall_time_s": None,
                "min_separation_m": separation_m,
                "min_clearance_m": clearance_m,
                "summary": None,
                "report": "",
                "hint": "quad report",
            },
        )

    def _least_m(self) -> Tuple[Optional[float], Optional[float]]:
        """Return the least separation, and the least clearance if nothing moves in the scene."""
        radius_m, scene = self._trace.robot_radius_m, self._trace.scene
        gaps_m, clearances_m = [np.inf], [np.inf]
        times_s = np.arange(self.start_s, self.end_s, rows.SAMPLE_PERIOD_S)
        for part_s in np.array_split(times_s, 1 + len(times_s) // _TIMES_AT_ONCE):
            positions = np.array([track.positions(part_s) for track in self._tracks])
            between_m = rows.gaps_m(positions.swapaxes(0, 1), radius_m)
            gaps_m.append(np.nanmin(between_m, initial=np.inf))
            if scene is not None and not scene.moving_shapes:
                distances_m = scene.flight_surface_distances_m(positions)
                clearances_m.append(np.nanmin(distances_m, initial=np.inf) - radius_m)
        separation_m, clearance_m = (float(max(0.0, min(one))) for one in (gaps_m, clearances_m))
        return (
            separation_m if math.isfinite(separation_m) else None,
            clearance_m if math.isfinite(clearance_m) else None,
        )

    def parts(
        self,
        time_s: float,
        robots_of: Mapping[str, Iterable[int]],
        has_time: Callable[[], bool] = lambda: True,
    ) -> Dict[str, Part]:
        """Return the layers of some robots at a time, by the items' keys.

        ``has_time`` is asked while a costmap is put together. Without time there is no item; the
        next call goes on from there.
        """
        self._has_time = has_time
        parts: Dict[str, Part] = {}
        for layer, robots in robots_of.items():
            for robot in robots:
                part = self._part(layer, robot, time_s)
                if part is not None:
                    parts[f"{layer}/{robot}"] = part
        return parts

    def present_items(self, time_s: float) -> List[Item]:
        """Return the items of all robots at a time."""
        bodies = np.array([track.body(time_s) for track in self._tracks])
        poses = poses_item(time_s, time.time(), bodies)
        samples = self.sample(time_s, poses)
        now = {row: track.now(time_s) for row, track in enumerate(self._tracks)}
        contacts = [one for one in self._trace.contacts if one.time_s <= time_s]
        goals = [
            line for row, track in enumerate(self._tracks) for line in track.goal_rows(row, time_s)
        ]
        return [
            poses,
            *self._obstacles.items(time_s),
            samples,
            *rows.fleet_items(now, self.names, samples),
            rows.contacts_item(contacts, self.names),
            rows.goals_item(goals),
        ]

    def sample(self, time_s: float, poses: Optional[Item] = None) -> Item:
        """Return the item ``samples`` at a time; ``poses`` is the one of that time."""
        if poses is None:
            bodies = np.array([track.body(time_s) for track in self._tracks])
            poses = poses_item(time_s, 0.0, bodies)
        return rows.samples_item(
            time_s,
            poses.arrays["pose"],
            self._trace.robot_radius_m,
            self._trace.scene,
            self._obstacles.solids(time_s),
        )

    # -- layers --------------------------------------------------------------------------

    def _part(self, layer: str, robot: int, time_s: float) -> Optional[Part]:
        track = self._tracks[robot]
        if layer == "trail":
            end = track.trail_end(time_s)
            return end, lambda: line_item("trail", robot, track.trail(end))
        if layer == "plan":
            number = track.plan_number(time_s)
            if number is None:
                return None
            return number, lambda: line_item("plan", robot, track.robot.plans[number][1])
        if layer == "localization":
            located = track.located(time_s)
            return None if located is None else (time_s, partial(located.item, robot))
        if layer == "cell":
            return time_s, lambda: self._cell(robot, time_s)
        topic = self._topics.get((layer, robot))
        if topic is None:
            return None
        if layer in _PASSING:
            return self._passing_part(layer, robot, topic, time_s)
        costmap = self._costmap(topic)
        place = costmap.place(time_s)
        return place and (place, lambda: self._costmap_item(layer, robot, costmap, place, time_s))

    def _passing_part(self, layer: str, robot: int, topic: str, time_s: float) -> Optional[Part]:
        """Return a scan, a local plan or tracks, unless they are old."""
        number = int(np.searchsorted(self._times[topic], time_s, side="right")) - 1
        if number < 0 or time_s - self._times[topic][number] > SHOWN_FOR_S:
            return None
        make = {"scan": self._scan, "local_plan": self._local_plan, "track": self._track}[layer]
        return number, lambda: make(robot, topic, number)

    def _scan(self, robot: int, topic: str, number: int) -> Optional[Item]:
        message = self._index.read(topic, number).content
        stamp_s = float(self._times[topic][number])
        scan = Scan(
            stamp_s,
            message.angle_min,
            message.angle_increment,
            message.range_min,
            message.range_max,
            np.asarray(message.ranges, np.float32),
        )
        map_from_base = self._tracks[robot].pose(stamp_s)
        if map_from_base is None:
            return None
        return scan_item(robot, scan, map_from_base.compose(base_from_lidar))

    def _local_plan(self, robot: int, topic: str, number: int) -> Item:
        message = self._index.read(topic, number).content
        places = [(pose.pose.position.x, pose.pose.position.y) for pose in message.poses]
        points = np.array(places, np.float64).reshape(-1, 2)
        frame = self._map_from(message.header.frame_id, robot, float(self._times[topic][number]))
        return line_item("local_plan", robot, frame.transform_points(points))

    def _track(self, robot: int, topic: str, number: int) -> Item:
        message = self._index.read(topic, number).content
        try:
            rows_of = rows_of_message(message)
        except ValueError as error:
            raise InputError([f"{topic}: message {number}: {error}"]) from error
        at_s = float(self._times[topic][number])
        return track_item(robot, rows_of, self._map_from(message.header.frame_id, robot, at_s))

    def _costmap(self, topic: str) -> CostmapTrack:
        if topic not in self._costmaps:
            updates_s = self._times.get(f"{topic}_updates", np.zeros(0))
            self._costmaps[topic] = CostmapTrack(self._index, topic, self._times[topic], updates_s)
        return self._costmaps[topic]

    def _costmap_item(
        self, layer: str, robot: int, costmap: CostmapTrack, place: Tuple[int, int], time_s: float
    ) -> Optional[Item]:
        at = costmap.at(place, self._has_time)
        if at is None:
            return None
        map_from_frame = self._map_from(at.frame, robot, time_s)
        return costmap_item(layer, robot, at.spec, at.costs, map_from_frame)

    def _cell(self, robot: int, time_s: float) -> Optional[Item]:
        scene = self._trace.scene
        if scene is None:
            return None
        positions = np.array([track.body(time_s)[:2] for track in self._tracks])
        radius_m = self._trace.robot_radius_m + _MARGIN_M
        return next(iter(cell_items(scene, positions, {robot: radius_m})), None)

    def _map_from(self, frame: str, robot: int, time_s: float) -> Pose2D:
        """Return the pose of a frame in ``map``; all but the odometry's are ``map``."""
        frames = self._tracks[robot].robot.odom_frames
        if not frames or not frame.lstrip("/").startswith("odom"):
            return Pose2D(0.0, 0.0)
        number = bisect.bisect_right([at_s for at_s, _ in frames], time_s) - 1
        return frames[max(number, 0)][1]

    def _topics_by_layer(self) -> Dict[Tuple[str, int], str]:
        topics: Dict[Tuple[str, int], str] = {}
        for topic, kind in self._index.kinds.items():
            for layer, (pattern, expected) in _LAYERS.items():
                match = re.fullmatch(pattern, topic)
                if match and kind == expected and int(match.group(1)) in self._rows:
                    topics[layer, self._rows[int(match.group(1))]] = topic
        return topics


def _is_wanted(topic: str, kind: str) -> bool:
    if topic == POSES_TOPIC:
        return kind == POSES_KIND
    if re.fullmatch(_UPDATES, topic):
        return kind == "map_msgs/OccupancyGridUpdate"
    return any(
        kind == expected and re.fullmatch(pattern, topic) is not None
        for pattern, expected in _LAYERS.values()
    )
