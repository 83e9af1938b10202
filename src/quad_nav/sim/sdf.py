"""Values, shapes and actors of SDF files; one with a fault is left out, with the fault's line.

Gazebo classic leads an actor through the waypoints of its trajectories, one trajectory after the
other, by the spline of ``motion``. ``<delay_start>`` is waited before each cycle, as SDF says. The
heights of waypoints are those of the skin's origin, and do not count: a person, who becomes a
cylinder, stands on the floor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.xml_tree import Element
from quad_nav.geometry import Pose3D, quaternion_from_euler
from quad_nav.sim.mesh import FLOOR_M, NotRepresented, boxes_of, prism
from quad_nav.sim.motion import SPLINE, Motion, Walkers
from quad_nav.sim.obstacles import Box, Cylinder, Obstacle, Sphere
from quad_nav.sim.scene import MovingObstacle

MAX_LENGTH_M = 1e5
IDENTITY = Pose3D(0.0, 0.0, 0.0)
UPRIGHT_RAD = 1e-3
"""Tilt up to which an axis counts as vertical: saved worlds have numerical errors."""
PERSON_RADIUS_M, PERSON_HEIGHT_M = Walkers(1).radius_m, Walkers(1).height_m
MAX_WAYPOINTS = 10_000
_MAX_TIME_S = 1e5
_TRUE = ("true", "1")
_SQUARE = np.array([(0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)])


@dataclass(frozen=True)
class SdfReader:
    """Reader of the values in one file."""

    path: Path

    def fault(self, element: Element, problem: str) -> NotRepresented:
        """Return the exception for a fault of an element."""
        place = f"{self.path.name}: line {element.line}: <{element.tag}>"
        return NotRepresented(f"{place}: {problem}")

    def pose(self, parent: Element, default: Pose3D = IDENTITY) -> Pose3D:
        """Return the ``<pose>`` of an element, relative to the element that contains it.

        Raises:
            NotRepresented: It has a fault, or is relative to a named frame.
        """
        element = parent.first("pose")
        if element is not None and element.attributes.get("relative_to", "world") != "world":
            raise NotRepresented("pose relative to a named frame")
        if element is None or not element.text.strip():
            return default
        if element.attributes.get("rotation_format") == "quat_xyzw":
            values = self.numbers(element, 7, "x y z and a quaternion x y z w")
            length = math.sqrt(sum(v * v for v in values[3:]))
            if length == 0.0:
                return default
            qx, qy, qz, qw = (v / length for v in values[3:])
            return Pose3D(values[0], values[1], values[2], (qx, qy, qz, qw))
        values = self.numbers(element, 6, "x y z roll pitch yaw")
        unit = math.pi / 180 if element.attributes.get("degrees") in _TRUE else 1.0
        roll, pitch, yaw = (unit * v for v in values[3:])
        return Pose3D(values[0], values[1], values[2], quaternion_from_euler(roll, pitch, yaw))

    def length(self, parent: Element, tag: str) -> float:
        """Return a length above 0 in m."""
        return self.lengths(parent, tag, 1, "a number of metres")[0]

    def lengths(self, parent: Element, tag: str, count: int, expected: str) -> List[float]:
        """Return lengths above 0 in m."""
        element = parent.first(tag)
        if element is None:
            raise self.fault(parent, f"<{tag}> is missing, expected {expected}")
        values = self.numbers(element, count, expected)
        if min(values) <= 0.0:
            raise self.fault(element, f"'{element.text.strip()}', expected {expected}, above 0")
        return values

    def numbers(self, element: Element, count: int, expected: str) -> List[float]:
        """Return the finite numbers of a text, separated by blanks."""
        text = element.text.strip()
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        if len(values) != count or not all(abs(v) <= MAX_LENGTH_M for v in values):
            limit = f", at most {MAX_LENGTH_M:g}" if len(values) == count else ""
            raise self.fault(element, f"'{text}', expected {expected}{limit}")
        return values


def is_true(text: str) -> bool:
    """Return whether a text is SDF's true."""
    return text.strip().lower() in _TRUE


def obstacles_of(
    reader: SdfReader, geometry: Element, name: str, map_from_shape: Pose3D
) -> Sequence[Obstacle]:
    """Convert a collision's ``<geometry>`` to obstacles, none if it is the floor.

    A tilted box or cylinder is treated as a mesh.

    Raises:
        NotRepresented: It has a fault, or no obstacle has this shape or pose.
    """
    if not geometry.children:
        raise NotRepresented("geometry without a shape")
    shape = geometry.children[0]
    makers = {"box": _box, "cylinder": _cylinder, "sphere": _sphere, "plane": _plane}
    if shape.tag == "empty":
        return []
    if shape.tag not in makers:
        raise NotRepresented(shape.tag)
    obstacles = makers[shape.tag](reader, shape, name, map_from_shape)
    if any(one.top_m <= FLOOR_M for one in obstacles):
        raise NotRepresented("nothing above the floor")
    return obstacles


def _above_floor(height_m: float, middle_m: float) -> Tuple[float, float]:
    """Return height and bottom of the part above the floor of a solid around ``middle_m``."""
    bottom_m = middle_m - height_m / 2
    sunk_m = max(0.0, -bottom_m)
    return height_m - sunk_m, bottom_m + sunk_m


def _box(reader: SdfReader, shape: Element, name: str, pose: Pose3D) -> Sequence[Obstacle]:
    """Convert a box, which may lie on any of its sides."""
    sizes = reader.lengths(shape, "size", 3, "three numbers of metres")
    rotation = pose.rotation
    up = [axis for axis in range(3) if _tilt_rad(rotation[:, axis]) <= UPRIGHT_RAD]
    if not up:
        return boxes_of(name, prism(_SQUARE) * sizes, pose)
    along, across = (up[0] + 1) % 3, (up[0] + 2) % 3
    yaw_rad = math.atan2(rotation[1, along], rotation[0, along])
    height_m, bottom_m = _above_floor(sizes[up[0]], pose.z_m)
    place = (pose.x_m, pose.y_m)
    return [Box(name, *place, sizes[along], sizes[across], height_m, yaw_rad, bottom_m)]


def _cylinder(reader: SdfReader, shape: Element, name: str, pose: Pose3D) -> Sequence[Obstacle]:
    radius_m, length_m = reader.length(shape, "radius"), reader.length(shape, "length")
    if _tilt_rad(pose.rotation[:, 2]) > UPRIGHT_RAD:
        outline = Cylinder(name, 0.0, 0.0, radius_m, length_m).corners_m()
        return boxes_of(name, prism(outline) * (1.0, 1.0, length_m), pose)
    return [Cylinder(name, pose.x_m, pose.y_m, radius_m, *_above_floor(length_m, pose.z_m))]


def _sphere(reader: SdfReader, shape: Element, name: str, pose: Pose3D) -> Sequence[Obstacle]:
    return [Sphere(name, pose.x_m, pose.y_m, pose.z_m, reader.length(shape, "radius"))]


def _plane(reader: SdfReader, shape: Element, name: str, pose: Pose3D) -> Sequence[Obstacle]:
    """Check that a plane is the floor: horizontal, at z = 0 and with its normal upwards."""
    element = shape.first("normal")
    given = reader.numbers(element, 3, "three numbers") if element else None
    normal = pose.rotation @ (given or (0.0, 0.0, 1.0))
    if _tilt_rad(normal) > UPRIGHT_RAD or normal[2] <= 0.0 or abs(pose.z_m) > FLOOR_M:
        raise NotRepresented("plane that is not the floor")
    return []


def _tilt_rad(axis: NDArray[np.float64]) -> float:
    """Return the angle between a line and the vertical."""
    return math.atan2(math.hypot(axis[0], axis[1]), abs(axis[2]))


def actor_of(reader: SdfReader, actor: Element, name: str) -> Union[Cylinder, MovingObstacle]:
    """Convert an ``<actor>`` to a moving obstacle.

    Without waypoints or with ``<auto_start>`` false it is a cylinder at rest.

    Raises:
        NotRepresented: It has a fault, a plugin moves it, or a pose is relative to a frame.
    """
    if actor.first("plugin") is not None:
        raise NotRepresented("actor that a plugin moves")
    pose = reader.pose(actor)
    script = actor.first("script") or Element("script", {}, actor.line)
    delay_s = _seconds(reader, script, "delay_start")
    times_s, poses, tension = _waypoints(reader, script)
    if not times_s or not is_true(script.text_of("auto_start", "true")):
        return Cylinder(name, pose.x_m, pose.y_m, PERSON_RADIUS_M, PERSON_HEIGHT_M)
    motion = Motion(
        tuple(delay_s + time_s for time_s in times_s),
        tuple(poses),
        is_true(script.text_of("loop", "true")),
        SPLINE,
        tension,
    )
    person = Cylinder(name, *poses[0][:2], PERSON_RADIUS_M, PERSON_HEIGHT_M)
    return MovingObstacle(person, motion)


def _waypoints(
    reader: SdfReader, script: Element
) -> Tuple[List[float], List[Tuple[float, float, float]], float]:
    """Return times and poses (x_m, y_m, yaw_rad) of all waypoints, and the spline's tension."""
    times_s: List[float] = []
    poses: List[Tuple[float, float, float]] = []
    tension, begin_s = 0.0, 0.0
    for trajectory in script.all("trajectory"):
        tension = _tension(reader, trajectory)
        waypoints: Dict[float, Pose3D] = {}
        for waypoint in trajectory.all("waypoint"):
            time_s = _seconds(reader, waypoint, "time", required=True)
            waypoints[time_s] = reader.pose(waypoint, IDENTITY)
        if len(times_s) + len(waypoints) > MAX_WAYPOINTS:
            raise reader.fault(script, f"more than {MAX_WAYPOINTS} waypoints")
        for time_s in sorted(waypoints):
            if not times_s or begin_s + time_s > times_s[-1]:
                planar = waypoints[time_s].to_2d()
                times_s.append(begin_s + time_s)
                poses.append((planar.x_m, planar.y_m, planar.yaw_rad))
        begin_s = times_s[-1] if times_s else 0.0
    return times_s, poses, tension


def _seconds(reader: SdfReader, parent: Element, tag: str, required: bool = False) -> float:
    """Return a time of 0 or more; 0 without one."""
    element = parent.first(tag)
    if element is None:
        if required:
            raise reader.fault(parent, f"<{tag}> is missing, expected seconds")
        return 0.0
    (seconds,) = reader.numbers(element, 1, "seconds")
    if not 0.0 <= seconds <= _MAX_TIME_S:
        raise reader.fault(element, f"'{element.text.strip()}', expected seconds, 0 or more")
    return seconds


def _tension(reader: SdfReader, trajectory: Element) -> float:
    """Return the tension of a trajectory, default 0."""
    text = trajectory.attributes.get("tension", "0")
    try:
        tension = float(text)
    except ValueError:
        tension = -1.0
    if not 0.0 <= tension <= 1.0:
        raise reader.fault(trajectory, f"tension '{text}', expected a number from 0 to 1")
    return tension
