"""Markers of the scene, the quadcopters and the goals.

`Marker` has the fields of `visualization_msgs/Marker` that are in use.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from typing import Dict, List, Sequence, Tuple

from quad_nav.geometry import Pose2D
from quad_nav.mission.goal import Goal
from quad_nav.mission.sequencer import Sequencer
from quad_nav.sim.colours import robot_rgba
from quad_nav.sim.movers import Movers
from quad_nav.sim.obstacles import Box, Obstacle
from quad_nav.sim.scene import BODY_RADIUS_M, MOUNT_HEIGHT_M, Scene

# Shapes, numbered as in visualization_msgs/Marker.
ARROW = 0
CUBE, SPHERE, CYLINDER, CUBE_LIST, TEXT = 1, 2, 3, 6, 9
_KINDS = {"box": CUBE, "cylinder": CYLINDER, "sphere": SPHERE}  # by Obstacle.shape

_WALL_RGBA = (0.55, 0.60, 0.65, 0.35)
_OBSTACLE_RGBA = (0.62, 0.50, 0.38, 1.0)
_MOVING_RGBA = (0.80, 0.36, 0.20, 1.0)
_DARK_RGBA = (0.15, 0.15, 0.17, 1.0)
_REAR_ROTOR_RGBA = (0.3, 0.3, 0.32, 0.7)
_ARM_M = 0.19
_ROTOR_DIAMETER_M = 0.20
_MANY_BOXES = 256
_SMALL_M = 1.0
_GOAL_ARROW_M = (0.6, 0.08, 0.08)  # length, width and height
_GOAL_DIAMETER_M, _ACTIVE_GOAL_DIAMETER_M, _GOAL_TEXT_HEIGHT_M = 0.30, 0.45, 0.35
_MIN_NUMBER_HEIGHT_M, _NUMBER_PART = 0.4, 0.025
_NUMBER_ABOVE_M = 1.2  # above most obstacles, which would hide it from above
_REACHED_ALPHA, _PENDING_ALPHA = 0.2, 0.75

Triple = Tuple[float, float, float]
Rgba = Tuple[float, float, float, float]


@dataclass(frozen=True)
class Marker:
    """One solid, list of cubes, or text.

    Attributes:
        frame: Frame of `place_m` and `yaw_rad`.
        namespace: Identifies the marker together with `number`.
        number: Unique within the namespace.
        kind: One of the shapes of this module.
        place_m: Position of the centre (x, y, z).
        size_m: Extent along the marker's own axes (x, y, z).
        rgba: Colour, each part from 0 to 1.
        yaw_rad: Rotation about z.
        text: Content of a `TEXT` marker.
        frame_locked: Whether the marker moves with its frame.
        points_m: Centres of the cubes of a `CUBE_LIST`, in the marker's own axes.
    """

    frame: str
    namespace: str
    number: int
    kind: int
    place_m: Triple
    size_m: Triple
    rgba: Rgba
    yaw_rad: float = 0.0
    text: str = ""
    frame_locked: bool = False
    points_m: Tuple[Triple, ...] = ()


def scene_markers(scene: Scene) -> List[Marker]:
    """Return walls and obstacles in `map`. No floor: RViz would draw it over the costmaps."""
    walls = [_solid(wall, "walls", k, _WALL_RGBA) for k, wall in enumerate(scene.wall_boxes())]
    single, listed = _split_small_boxes(scene.obstacles)
    obstacles = [
        _solid(obstacle, "obstacles", k, _OBSTACLE_RGBA) for k, obstacle in enumerate(single)
    ]
    return [*walls, *obstacles, *_box_lists(listed)]


def moving_markers(movers: Movers, now_s: float) -> List[Marker]:
    """Return walkers and other moving obstacles where they are at a time, in `map`."""
    return [
        _solid(obstacle, "moving", k, _MOVING_RGBA) for k, obstacle in enumerate(movers.at(now_s))
    ]


def quadcopter_markers(n_robots: int) -> List[Marker]:
    """Return body, arms, rotors and LIDAR of each quadcopter, locked to `base_link{i}`."""
    return [marker for robot in range(n_robots) for marker in _quadcopter(robot)]


def number_markers(n_robots: int, scene: Scene) -> List[Marker]:
    """Return each quadcopter's number beside it, locked to `base_link{i}`.

    The text grows with the arena, so that it stays readable when RViz shows all of it.
    """
    height_m = max(_MIN_NUMBER_HEIGHT_M, _NUMBER_PART * max(scene.size_x_m, scene.size_y_m))
    return [
        Marker(
            f"base_link{robot}",
            f"quad{robot}_number",
            0,
            TEXT,
            (0.0, BODY_RADIUS_M + 0.5 * height_m, _NUMBER_ABOVE_M),
            (0.0, 0.0, height_m),
            robot_rgba(robot),
            text=str(robot),
            frame_locked=True,
        )
        for robot in range(n_robots)
    ]


def _quadcopter(robot: int) -> List[Marker]:
    """Draw one quadcopter; the rotors are at 45 degrees, the front two in its colour."""
    part = _RobotPart(f"base_link{robot}", f"quad{robot}")
    arms = [math.pi / 4, -math.pi / 4]
    rotors = [math.pi / 4 + k * math.pi / 2 for k in range(4)]
    return [
        part.marker(0, CUBE, (0.0, 0.0, 0.0), (0.16, 0.10, 0.05), robot_rgba(robot)),
        part.marker(
            1, CYLINDER, (0.0, 0.0, MOUNT_HEIGHT_M - 0.015), (0.07, 0.07, 0.05), _DARK_RGBA
        ),
        part.marker(
            2,
            CYLINDER,
            (0.0, 0.0, MOUNT_HEIGHT_M),
            (2 * BODY_RADIUS_M, 2 * BODY_RADIUS_M, 0.01),
            robot_rgba(robot, 0.15),
        ),
        *(
            part.marker(
                3 + k, CUBE, (0.0, 0.0, 0.0), (2 * _ARM_M, 0.025, 0.02), _DARK_RGBA, angle_rad
            )
            for k, angle_rad in enumerate(arms)
        ),
        *(
            part.marker(
                5 + k,
                CYLINDER,
                (*Pose2D(0.0, 0.0, angle_rad).rotate(_ARM_M, 0.0), 0.03),
                (_ROTOR_DIAMETER_M, _ROTOR_DIAMETER_M, 0.01),
                robot_rgba(robot, 0.8) if k in (0, 3) else _REAR_ROTOR_RGBA,
            )
            for k, angle_rad in enumerate(rotors)
        ),
    ]


@dataclass(frozen=True)
class _RobotPart:
    """Make markers that move with a quadcopter's frame."""

    frame: str
    namespace: str

    def marker(
        self,
        number: int,
        kind: int,
        place_m: Triple,
        size_m: Triple,
        rgba: Rgba,
        yaw_rad: float = 0.0,
    ) -> Marker:
        return Marker(
            self.frame, self.namespace, number, kind, place_m, size_m, rgba, yaw_rad, "", True
        )


def goal_markers(sequencers: Sequence[Sequencer], altitude_m: float) -> List[Marker]:
    """Return numbered spheres for the goals of all robots, with an arrow for each yaw.

    Reached goals are dimmed, the active one is larger and opaque. The result replaces all goal
    markers that were published before.
    """
    return [
        marker
        for robot, sequencer in enumerate(sequencers)
        for index, goal in enumerate(sequencer.sequence.goals)
        for marker in _goal_markers(robot, index, goal, sequencer, altitude_m)
    ]


def _goal_markers(
    robot: int, index: int, goal: Goal, sequencer: Sequencer, altitude_m: float
) -> List[Marker]:
    is_active = sequencer.active_goal is not None and index == sequencer.index
    alpha = 1.0 if is_active else _REACHED_ALPHA if index < sequencer.index else _PENDING_ALPHA
    diameter_m = _ACTIVE_GOAL_DIAMETER_M if is_active else _GOAL_DIAMETER_M
    above_m = altitude_m + diameter_m / 2 + _GOAL_TEXT_HEIGHT_M / 2
    arrow = Marker(
        "map",
        f"goal{robot}_yaw",
        index,
        ARROW,
        (goal.x_m, goal.y_m, altitude_m),
        _GOAL_ARROW_M,
        robot_rgba(robot, alpha),
        goal.pose.yaw_rad,
    )
    return [
        *([] if goal.yaw_rad is None else [arrow]),
        Marker(
            "map",
            f"goal{robot}",
            index,
            SPHERE,
            (goal.x_m, goal.y_m, altitude_m),
            (diameter_m, diameter_m, diameter_m),
            robot_rgba(robot, alpha),
        ),
        Marker(
            "map",
            f"goal{robot}_number",
            index,
            TEXT,
            (goal.x_m, goal.y_m, above_m),
            (0.0, 0.0, _GOAL_TEXT_HEIGHT_M),
            (0.1, 0.1, 0.1, max(alpha, 0.4)),
            text=str(index + 1),
        ),
    ]


def _split_small_boxes(obstacles: Sequence[Obstacle]) -> Tuple[Sequence[Obstacle], Sequence[Box]]:
    """Split obstacles into those with a marker each and small boxes for lists.

    RViz cannot draw thousands of single markers. It hides a list whose centres are all out of
    view, so large boxes in lists would vanish at the edges.
    """
    small = [o for o in obstacles if isinstance(o, Box) and max(o.size_x_m, o.size_y_m) <= _SMALL_M]
    if len(small) < _MANY_BOXES:
        return obstacles, []
    names = {box.name for box in small}
    return [o for o in obstacles if o.name not in names], small


def _box_lists(boxes: Sequence[Box]) -> List[Marker]:
    """Return one marker for all boxes of the same size and yaw."""
    alike: Dict[Tuple[Triple, float], List[Box]] = defaultdict(list)
    for box in boxes:
        alike[(box.size_x_m, box.size_y_m, box.height_m), box.yaw_rad].append(box)
    markers = []
    for number, ((size, yaw_rad), group) in enumerate(alike.items()):
        turned = Pose2D(0.0, 0.0, yaw_rad)
        points = tuple((*turned.inverse_transform(b.x_m, b.y_m), b.centre_m[2]) for b in group)
        markers.append(
            Marker(
                "map",
                "boxes",
                number,
                CUBE_LIST,
                (0.0, 0.0, 0.0),
                size,
                _OBSTACLE_RGBA,
                yaw_rad,
                points_m=points,
            )
        )
    return markers


def _solid(solid: Obstacle, namespace: str, number: int, rgba: Rgba) -> Marker:
    x_m, y_m, z_m = solid.half_m
    size_m = (2 * x_m, 2 * y_m, 2 * z_m)
    kind = _KINDS[solid.shape]
    return Marker("map", namespace, number, kind, solid.centre_m, size_m, rgba, solid.yaw_rad)
