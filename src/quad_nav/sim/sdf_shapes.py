"""Shapes of SDF collisions as obstacles, if an obstacle can have their shape and pose."""

from __future__ import annotations

import math
from typing import Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.xml_tree import Element
from quad_nav.geometry import Pose3D
from quad_nav.sim.obstacles import Box, Cylinder, Obstacle, Sphere
from quad_nav.sim.sdf_values import NotRepresented, SdfReader

UPRIGHT_RAD = 1e-3
"""Tilt up to which an axis counts as vertical: saved worlds have numerical errors."""

FLOOR_M = 1e-3
"""Height up to which planes and solids count as part of the floor."""


def obstacle_of(
    reader: SdfReader, geometry: Element, name: str, map_from_shape: Pose3D
) -> Optional[Obstacle]:
    """Convert a collision's geometry.

    Args:
        reader: Reader of the file; collects faults.
        geometry: The ``<geometry>`` element.
        name: Name of the obstacle.
        map_from_shape: Pose of the shape.

    Returns:
        The obstacle, or None if it is the floor or has a fault.

    Raises:
        NotRepresented: No obstacle has this shape or pose.
    """
    if not geometry.children:
        raise NotRepresented("geometry without a shape")
    shape = geometry.children[0]
    make = {
        "box": _box,
        "cylinder": _cylinder,
        "sphere": _sphere,
        "plane": _plane,
        "empty": _nothing,
    }.get(shape.tag)
    if make is None:
        raise NotRepresented(shape.tag)
    faults_before = len(reader.problems)
    obstacle = make(reader, shape, name, map_from_shape)
    if obstacle is None or len(reader.problems) > faults_before:
        return None
    if obstacle.top_m <= FLOOR_M:
        raise NotRepresented("nothing above the floor")
    return obstacle


def _above_floor(height_m: float, middle_m: float) -> Tuple[float, float]:
    """Return height and bottom of the part above the floor of a solid around ``middle_m``."""
    bottom_m = middle_m - height_m / 2
    sunk_m = max(0.0, -bottom_m)
    return height_m - sunk_m, bottom_m + sunk_m


def _box(reader: SdfReader, shape: Element, name: str, pose: Pose3D) -> Obstacle:
    """Convert a box, which may lie on any of its sides."""
    sizes = reader.lengths(shape, "size", 3, "three numbers of metres")
    rotation = pose.rotation
    up = [axis for axis in range(3) if _tilt_rad(rotation[:, axis]) <= UPRIGHT_RAD]
    if not up:
        raise NotRepresented("tilted box")
    along, across = (up[0] + 1) % 3, (up[0] + 2) % 3
    yaw_rad = math.atan2(rotation[1, along], rotation[0, along])
    height_m, bottom_m = _above_floor(sizes[up[0]], pose.z_m)
    place = (pose.x_m, pose.y_m)
    return Box(name, *place, sizes[along], sizes[across], height_m, yaw_rad, bottom_m)


def _cylinder(reader: SdfReader, shape: Element, name: str, pose: Pose3D) -> Obstacle:
    radius_m, length_m = reader.length(shape, "radius"), reader.length(shape, "length")
    if _tilt_rad(pose.rotation[:, 2]) > UPRIGHT_RAD:
        raise NotRepresented("tilted cylinder")
    return Cylinder(name, pose.x_m, pose.y_m, radius_m, *_above_floor(length_m, pose.z_m))


def _sphere(reader: SdfReader, shape: Element, name: str, pose: Pose3D) -> Obstacle:
    return Sphere(name, pose.x_m, pose.y_m, pose.z_m, reader.length(shape, "radius"))


def _plane(reader: SdfReader, shape: Element, name: str, pose: Pose3D) -> None:
    """Check that a plane is the floor: horizontal, at z = 0 and with its normal upwards."""
    element = shape.first("normal")
    given = reader.numbers(element, 3, "three numbers") if element else None
    normal = pose.rotation @ (given or (0.0, 0.0, 1.0))
    if _tilt_rad(normal) > UPRIGHT_RAD or normal[2] <= 0.0 or abs(pose.z_m) > FLOOR_M:
        raise NotRepresented("plane that is not the floor")


def _nothing(reader: SdfReader, shape: Element, name: str, pose: Pose3D) -> None:
    return None


def _tilt_rad(axis: NDArray[np.float64]) -> float:
    """Return the angle between a line and the vertical."""
    return math.atan2(math.hypot(axis[0], axis[1]), abs(axis[2]))
