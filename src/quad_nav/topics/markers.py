"""Scene and quadcopters as markers, see ``visualization_msgs/Marker``."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, replace
from typing import Dict, List, Sequence, Tuple

from quad_nav.geometry import Pose2D
from quad_nav.sim.colours import robot_rgba
from quad_nav.sim.lidar import MOUNT_HEIGHT_M
from quad_nav.sim.scene import BODY_RADIUS_M, Box, Obstacle, Scene, Sphere

# The message's numbers for shapes.
CUBE, SPHERE, CYLINDER, CUBE_LIST, TEXT = 1, 2, 3, 6, 9

_WALL_RGBA = (0.55, 0.60, 0.65, 0.35)
_OBSTACLE_RGBA = (0.62, 0.50, 0.38, 1.0)
_DARK_RGBA = (0.15, 0.15, 0.17, 1.0)
_ARM_M = 0.19
_ROTOR_DIAMETER_M = 0.20
_MANY_BOXES = 256
_SMALL_M = 1.0

Triple = Tuple[float, float, float]
Rgba = Tuple[float, float, float, float]


@dataclass(frozen=True)
class Marker:
    """A solid or a text in ``frame``; ``namespace`` and ``number`` identify it.

    ``size_m`` is (x, y, z). With ``frame_locked`` it moves along with the frame.
    ``points_m``: the centres of the cubes of a list, in the marker's own axes.
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
    """Walls and obstacles in ``map``. No floor: RViz would draw it over the costmaps."""
    walls = [_solid(wall, "walls", k, _WALL_RGBA) for k, wall in enumerate(scene.wall_boxes())]
    single, listed = _by_number(scene.obstacles)
    obstacles = [
        _solid(obstacle, "obstacles", k, _OBSTACLE_RGBA) for k, obstacle in enumerate(single)
    ]
    return [*walls, *obstacles, *_box_lists(listed)]


def quadcopter_markers(n_robots: int) -> List[Marker]:
    """A body, arms, rotors and the LIDAR for each quadcopter, moving with ``base_link{i}``."""
    return [marker for robot in range(n_robots) for marker in _quadcopter(robot)]


def _quadcopter(robot: int) -> List[Marker]:
    """Rotors are at 45 degrees; the two in front are in the quadcopter's colour."""
    frame, name, rgba = f"base_link{robot}", f"quad{robot}", robot_rgba(robot)
    parts = [
        Marker(frame, name, 0, CUBE, (0.0, 0.0, 0.0), (0.16, 0.10, 0.05), rgba),
        Marker(
            frame,
            name,
            1,
            CYLINDER,
            (0.0, 0.0, MOUNT_HEIGHT_M - 0.015),
            (0.07, 0.07, 0.05),
            _DARK_RGBA,
        ),
        Marker(
            frame,
            name,
            2,
            CYLINDER,
            (0.0, 0.0, MOUNT_HEIGHT_M),
            (2 * BODY_RADIUS_M, 2 * BODY_RADIUS_M, 0.01),
            robot_rgba(robot, 0.15),
        ),
    ]
    for k, angle in enumerate((math.pi / 4, -math.pi / 4)):
        parts.append(
            Marker(
                frame,
                name,
                3 + k,
                CUBE,
                (0.0, 0.0, 0.0),
                (2 * _ARM_M, 0.025, 0.02),
                _DARK_RGBA,
                angle,
            )
        )
    for k in range(4):
        angle = math.pi / 4 + k * math.pi / 2
        place = (*Pose2D(0.0, 0.0, angle).rotate(_ARM_M, 0.0), 0.03)
        colour = robot_rgba(robot, 0.8) if k in (0, 3) else (0.3, 0.3, 0.32, 0.7)
        parts.append(
            Marker(
                frame,
                name,
                5 + k,
                CYLINDER,
                place,
                (_ROTOR_DIAMETER_M, _ROTOR_DIAMETER_M, 0.01),
                colour,
            )
        )
    return [replace(part, frame_locked=True) for part in parts]


def _by_number(obstacles: Sequence[Obstacle]) -> Tuple[Sequence[Obstacle], Sequence[Box]]:
    """Obstacles that get a marker each, and small boxes that go into lists.

    RViz cannot take a marker each from thousands on. It does not draw a list whose
    centres are all out of view, so that large boxes would vanish at its edges.
    """
    small = [o for o in obstacles if isinstance(o, Box) and max(o.size_x_m, o.size_y_m) <= _SMALL_M]
    if len(small) < _MANY_BOXES:
        return obstacles, []
    names = {box.name for box in small}
    return [o for o in obstacles if o.name not in names], small


def _box_lists(boxes: Sequence[Box]) -> List[Marker]:
    """One marker for all boxes of a size and yaw."""
    alike: Dict[Tuple[Triple, float], List[Box]] = defaultdict(list)
    for box in boxes:
        alike[(box.size_x_m, box.size_y_m, box.height_m), box.yaw_rad].append(box)
    markers = []
    for number, ((size, yaw_rad), group) in enumerate(alike.items()):
        turned = Pose2D(0.0, 0.0, yaw_rad)
        points = tuple(
            (*turned.inverse_transform(b.x_m, b.y_m), b.bottom_m + b.height_m / 2) for b in group
        )
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
    place = (solid.x_m, solid.y_m, solid.bottom_m + solid.height_m / 2)
    if isinstance(solid, Box):
        return Marker(
            "map",
            namespace,
            number,
            CUBE,
            place,
            (solid.size_x_m, solid.size_y_m, solid.height_m),
            rgba,
            solid.yaw_rad,
        )
    diameter = 2 * solid.radius_m
    kind = SPHERE if isinstance(solid, Sphere) else CYLINDER
    return Marker("map", namespace, number, kind, place, (diameter, diameter, solid.height_m), rgba)
