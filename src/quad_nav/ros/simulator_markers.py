"""Scene and quadcopters for RViz, and goal spheres from there for pybullet's window."""
from __future__ import annotations

import math
from collections import defaultdict
from typing import Dict, List, Sequence, Tuple

from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from quad_nav.geometry import quaternion_from_yaw
from quad_nav.sim.body import GoalSphere
from quad_nav.sim.colours import robot_rgba
from quad_nav.sim.lidar import MOUNT_HEIGHT_M
from quad_nav.sim.scene import BODY_RADIUS_M, Box, Obstacle, Scene, Sphere

_WALL_RGBA = (0.55, 0.60, 0.65, 0.35)
_OBSTACLE_RGBA = (0.62, 0.50, 0.38, 1.0)
_DARK_RGBA = (0.15, 0.15, 0.17, 1.0)
_MANY_BOXES = 256
_SMALL_M = 1.0
_ARM_M = 0.19
_ROTOR_DIAMETER_M = 0.20

_Size = Tuple[float, float, float]
_Rgba = Tuple[float, float, float, float]


def scene_markers(scene: Scene) -> MarkerArray:
    """Walls and obstacles in ``map``. No floor: RViz would draw it over the costmaps."""
    walls = [_solid(wall, "walls", k, _WALL_RGBA) for k, wall in enumerate(scene.wall_boxes())]
    single, listed = _by_number(scene.obstacles)
    obstacles = [_solid(obstacle, "obstacles", k, _OBSTACLE_RGBA)
                 for k, obstacle in enumerate(single)]
    return MarkerArray([*walls, *obstacles, *_box_lists(listed)])


def quadcopter_markers(n_robots: int) -> MarkerArray:
    """A body, arms, rotors and the LIDAR for each quadcopter, moving with ``base_link{i}``."""
    return MarkerArray([marker for robot in range(n_robots) for marker in _quadcopter(robot)])


def goal_spheres(message: MarkerArray) -> List[GoalSphere]:
    """The spheres among markers in ``map``."""
    return [((m.pose.position.x, m.pose.position.y, m.pose.position.z), m.scale.x / 2,
             (m.color.r, m.color.g, m.color.b, m.color.a))
            for m in message.markers if m.type == Marker.SPHERE and m.action == Marker.ADD]


def _quadcopter(robot: int) -> List[Marker]:
    """Rotors are at 45 degrees; the two in front are in the quadcopter's colour."""
    frame, name, rgba = f"base_link{robot}", f"quad{robot}", robot_rgba(robot)
    parts = [
        _marker(frame, name, 0, Marker.CUBE, (0.0, 0.0, 0.0), (0.16, 0.10, 0.05), rgba),
        _marker(frame, name, 1, Marker.CYLINDER, (0.0, 0.0, MOUNT_HEIGHT_M - 0.015),
                (0.07, 0.07, 0.05), _DARK_RGBA),
        _marker(frame, name, 2, Marker.CYLINDER, (0.0, 0.0, MOUNT_HEIGHT_M),
                (2 * BODY_RADIUS_M, 2 * BODY_RADIUS_M, 0.01), robot_rgba(robot, 0.15)),
    ]
    for k, angle in enumerate((math.pi / 4, -math.pi / 4)):
        parts.append(_marker(frame, name, 3 + k, Marker.CUBE, (0.0, 0.0, 0.0),
                             (2 * _ARM_M, 0.025, 0.02), _DARK_RGBA, angle))
    for k in range(4):
        angle = math.pi / 4 + k * math.pi / 2
        place = (_ARM_M * math.cos(angle), _ARM_M * math.sin(angle), 0.03)
        colour = robot_rgba(robot, 0.8) if k in (0, 3) else (0.3, 0.3, 0.32, 0.7)
        parts.append(_marker(frame, name, 5 + k, Marker.CYLINDER, place,
                             (_ROTOR_DIAMETER_M, _ROTOR_DIAMETER_M, 0.01), colour))
    for part in parts:
        part.frame_locked = True
    return parts


def _by_number(obstacles: Sequence[Obstacle]) -> Tuple[Sequence[Obstacle], Sequence[Box]]:
    """Obstacles that get a marker each, and small boxes that go into lists.

    RViz cannot take a marker each from thousands on. It does not draw a list whose
    centres are all out of view, so that large boxes would vanish at its edges.
    """
    small = [o for o in obstacles
             if isinstance(o, Box) and max(o.size_x_m, o.size_y_m) <= _SMALL_M]
    if len(small) < _MANY_BOXES:
        return obstacles, []
    names = {box.name for box in small}
    return [o for o in obstacles if o.name not in names], small


def _box_lists(boxes: Sequence[Box]) -> List[Marker]:
    """One marker for all boxes of a size and yaw."""
    alike: Dict[Tuple[_Size, float], List[Box]] = defaultdict(list)
    for box in boxes:
        alike[(box.size_x_m, box.size_y_m, box.height_m), box.yaw_rad].append(box)
    markers = []
    for number, ((size, yaw_rad), group) in enumerate(alike.items()):
        marker = _marker("map", "boxes", number, Marker.CUBE_LIST, (0.0, 0.0, 0.0), size,
                         _OBSTACLE_RGBA, yaw_rad)
        cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
        marker.points = [Point(cos * b.x_m + sin * b.y_m, cos * b.y_m - sin * b.x_m,
                               b.bottom_m + b.height_m / 2) for b in group]
        markers.append(marker)
    return markers


def _solid(solid: Obstacle, namespace: str, number: int, rgba: _Rgba) -> Marker:
    place = (solid.x_m, solid.y_m, solid.bottom_m + solid.height_m / 2)
    if isinstance(solid, Box):
        return _marker("map", namespace, number, Marker.CUBE, place,
                       (solid.size_x_m, solid.size_y_m, solid.height_m), rgba, solid.yaw_rad)
    diameter = 2 * solid.radius_m
    kind = Marker.SPHERE if isinstance(solid, Sphere) else Marker.CYLINDER
    return _marker("map", namespace, number, kind, place,
                   (diameter, diameter, solid.height_m), rgba)


def _marker(frame: str, namespace: str, number: int, kind: int, place: _Size, size: _Size,
            rgba: _Rgba, yaw_rad: float = 0.0) -> Marker:
    marker = Marker(ns=namespace, id=number, type=kind, action=Marker.ADD,
                    pose=Pose(Point(*place), Quaternion(*quaternion_from_yaw(yaw_rad))),
                    scale=Vector3(*size), color=ColorRGBA(*rgba))
    marker.header.frame_id = frame
    return marker
