"""Layers of each robot that a page can switch on: scan, plans, costmaps and tracks."""

from __future__ import annotations

import time
from functools import partial
from typing import Any, Callable, Dict, FrozenSet, List, Mapping, Optional, Union

import numpy as np
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid, Path
from numpy.typing import NDArray
from quad.msg import MovingObstacles
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan

from quad_nav.config.planners import SLOTS
from quad_nav.config.plugins import plugin_name
from quad_nav.grid import GridSpec
from quad_nav.ros.common.conversions import ScanMessage, scan_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.packed_messages import read_path
from quad_nav.topics.tracked_obstacles import TRACKS_TOPIC, rows_of_message
from quad_nav.topics.validation import grid_problem, path_problem, scan_problem
from quad_web.ros.frames import Frames
from quad_web.ros.intake import Newest, Topic, decoded, raw_type
from quad_web.ros.poses import MAP, Bodies
from quad_web.view.items import costmap_item, line_item, scan_item, track_item
from quad_web.view.state import OF_ONE_ROBOT, Item

COSTMAP_PERIOD_S = 0.2  # wall time between two items of a costmap
_PLANNERS = {"plan": "base_global_planner", "local_plan": "base_local_planner"}
_TOPICS = ("scan", "plan", "local_plan", "track", *OF_ONE_ROBOT)
_GridMessage, _UpdateMessage = numpy_msg(OccupancyGrid), numpy_msg(OccupancyGridUpdate)


class MessageIntake:
    """Receives one layer of one robot.

    Attributes:
        topics: The topics to subscribe to.
    """

    def __init__(
        self, message_type: Any, make: Callable[[bytes], Optional[Item]], *topics: str
    ) -> None:
        """Make an item of a message's bytes; ``make`` raises `ValueError` for a faulty one."""
        self._newest, self._make = Newest(topics[0], message_type), make
        self.topics = dict.fromkeys(topics, self._newest.topic)

    def item(self) -> Optional[Item]:
        """Return the item if it is new."""
        data = self._newest.take_bytes()
        return None if data is None else self._make(data)


class CostmapIntake:
    """Receives a costmap of a robot, its grid and the updates of parts of it.

    Attributes:
        topics: The topics to subscribe to.
    """

    def __init__(self, layer: str, robot: int, frames: Frames) -> None:
        self._layer, self._robot, self._frames = layer, robot, frames
        self._name = f"/move_base{robot}/{layer}/costmap"
        self.topics = {
            self._name: Topic(raw_type(OccupancyGrid), self._on_grid),
            f"{self._name}_updates": Topic(raw_type(OccupancyGridUpdate), self._on_update),
        }
        self._spec: Optional[GridSpec] = None
        self._frame = MAP
        self._costs: NDArray[np.int8] = np.zeros((0, 0), np.int8)
        self._has_changed, self._next_s = False, 0.0
        self._warnings = ThrottledWarnings()

    def _on_grid(self, raw: Any) -> None:
        try:
            message = decoded(_GridMessage, raw.data_bytes)
            info, corner = message.info, message.info.origin.position
            problem = grid_problem(
                info.width, info.height, info.resolution, len(message.data), (corner.x, corner.y)
            )
            if problem:
                raise ValueError(problem)
        except ValueError as error:
            self._warnings.warn(f"web: {self._name}: grid dropped: {error}", kind="grid")
            return
        spec = GridSpec(info.width, info.height, info.resolution, corner.x, corner.y)
        self._costs = np.array(message.data, np.int8).reshape(spec.shape)
        self._spec, self._frame, self._has_changed = spec, message.header.frame_id, True

    def _on_update(self, raw: Any) -> None:
        try:
            message = decoded(_UpdateMessage, raw.data_bytes)
            x0, y0, shape = message.x, message.y, (message.height, message.width)
            part = self._costs[max(y0, 0) : y0 + shape[0], max(x0, 0) : x0 + shape[1]]
            if part.shape != shape or len(message.data) != part.size:
                raise ValueError(f"{shape[1]} x {shape[0]} cells at ({x0}, {y0})")
        except ValueError as error:
            if self._spec is not None:  # before the grid there is nothing to update
                self._warnings.warn(f"web: {self._name}: update dropped: {error}", kind="update")
            return
        part[:] = np.asarray(message.data, np.int8).reshape(shape)
        self._has_changed = True

    def item(self) -> Optional[Item]:
        """Return the costmap if it has changed and was not returned a short time ago."""
        if self._spec is None or not self._has_changed or time.monotonic() < self._next_s:
            return None
        map_from_frame = self._frames.find(MAP, self._frame)
        if map_from_frame is None:
            return None
        self._has_changed, self._next_s = False, time.monotonic() + COSTMAP_PERIOD_S
        return costmap_item(
            self._layer, self._robot, self._spec, self._costs.copy(), map_from_frame.to_2d()
        )


class Layers:
    """The layers that clients show, of all robots."""

    def __init__(
        self, bodies: Bodies, frames: Frames, tree_of: Callable[[int], Mapping[str, Any]]
    ) -> None:
        """Receive nothing yet; ``tree_of`` returns a navigator's parameters, {} if unknown."""
        self._bodies, self._frames, self._tree_of = bodies, frames, tree_of
        self._intakes: Dict[str, Union[MessageIntake, CostmapIntake]] = {}
        self._warnings = ThrottledWarnings()

    def topics(self, shown: Mapping[str, FrozenSet[int]]) -> Dict[str, Topic]:
        """Return the topics to subscribe to; ``shown`` has the robots of each layer."""
        intakes = {}
        for layer, robot in [(one, i) for one in _TOPICS for i in sorted(shown[one])]:
            key = f"{layer}/{robot}"
            intake = self._intakes.get(key) or self._new(layer, robot)
            if intake is not None:
                intakes[key] = intake
        self._intakes = intakes
        return {name: topic for one in intakes.values() for name, topic in one.topics.items()}

    def _new(self, layer: str, robot: int) -> Union[MessageIntake, CostmapIntake, None]:
        if layer in OF_ONE_ROBOT:
            return CostmapIntake(layer, robot, self._frames)
        if layer == "scan":
            return MessageIntake(LaserScan, partial(self._scan, robot), f"/scan{robot}")
        node = f"/move_base{robot}"
        if layer == "track":
            make = partial(self._track, robot)
            return MessageIntake(MovingObstacles, make, f"{node}/{TRACKS_TOPIC}")
        planner = self._tree_of(robot).get(_PLANNERS[layer])
        if not isinstance(planner, str):
            return None
        make = partial(self._plan, layer, robot)
        planners = (planner, *SLOTS[_PLANNERS[layer]].types)  # one may take the place of another
        names = dict.fromkeys(f"{node}/{plugin_name(one)}/{layer}" for one in planners)
        return MessageIntake(Path, make, *names)

    def _scan(self, robot: int, data: bytes) -> Optional[Item]:
        """Return a scan's hit points where the robot was at its time."""
        message = decoded(ScanMessage, data)
        scan = scan_from_message(message)
        problem = scan_problem(scan)
        if problem:
            raise ValueError(problem)
        map_from_base = self._bodies.at(robot, scan.stamp_s)
        base_from_lidar = self._frames.find(f"base_link{robot}", message.header.frame_id)
        if map_from_base is None or base_from_lidar is None:
            return None
        return scan_item(robot, scan, map_from_base.compose(base_from_lidar))

    def _plan(self, layer: str, robot: int, data: bytes) -> Optional[Item]:
        frame, points = read_path(data)
        problem = path_problem(points)
        if problem:
            raise ValueError(problem)
        map_from_plan = self._frames.find(MAP, frame)
        if map_from_plan is None:
            return None
        return line_item(layer, robot, map_from_plan.to_2d().transform_points(points))

    def _track(self, robot: int, data: bytes) -> Optional[Item]:
        message = decoded(MovingObstacles, data)
        rows = rows_of_message(message)
        map_from_frame = self._frames.find(MAP, message.header.frame_id)
        return None if map_from_frame is None else track_item(robot, rows, map_from_frame.to_2d())

    def items(self) -> List[Item]:
        """Return the items that are new."""
        items = []
        for key, intake in self._intakes.items():
            try:
                item = intake.item()
            except ValueError as error:
                self._warnings.warn(f"web: {key}: message dropped: {error}", kind=key)
                continue
            if item is not None:
                items.append(item)
        return items

    @property
    def keys(self) -> FrozenSet[str]:
        """Keys of the items that may be shown."""
        return frozenset(self._intakes)
