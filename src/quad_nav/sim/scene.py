"""The place that quadcopters fly in: an arena with walls and obstacles.

Frame ``map`` has its origin at the arena's lower left corner, on the floor; x
runs along the first size, y along the second, z up. Walls stand outside the
arena, with their inner faces on its border.

Scenes are read from YAML by ``scene_file.load_scene``.
"""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, List, Tuple, Union

import numpy as np

from quad_nav.geometry import Pose2D

Lengths = Union[float, np.ndarray]

BODY_RADIUS_M = 0.30
"""Radius of the cylinder that a quadcopter touches things with."""
GUARD_HEIGHT_M = 0.24
"""Its height; its centre is the LIDAR."""


@dataclass(frozen=True)
class Box:
    """Upright box, turned by ``yaw_rad`` about its vertical axis."""

    name: str
    x_m: float
    y_m: float
    size_x_m: float
    size_y_m: float
    height_m: float
    yaw_rad: float = 0.0
    bottom_m: float = 0.0

    def clearance_m(self, x_m: Lengths, y_m: Lengths, z_m: float) -> Any:
        """Distance from a point, or from each of many, to the surface; negative inside."""
        cos, sin = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        dx, dy = x_m - self.x_m, y_m - self.y_m
        outside = (np.abs(cos * dx + sin * dy) - self.size_x_m / 2.0,
                   np.abs(-sin * dx + cos * dy) - self.size_y_m / 2.0,
                   _outside_slab(z_m, self.bottom_m, self.height_m))
        return _signed_distance(outside)


@dataclass(frozen=True)
class Cylinder:
    """Upright cylinder."""

    name: str
    x_m: float
    y_m: float
    radius_m: float
    height_m: float
    bottom_m: float = 0.0

    def clearance_m(self, x_m: Lengths, y_m: Lengths, z_m: float) -> Any:
        """Distance from a point, or from each of many, to the surface; negative inside."""
        outside = (np.hypot(x_m - self.x_m, y_m - self.y_m) - self.radius_m,
                   _outside_slab(z_m, self.bottom_m, self.height_m))
        return _signed_distance(outside)


Obstacle = Union[Box, Cylinder]


@dataclass(frozen=True)
class Walls:
    """The four walls around the arena."""

    height_m: float = 2.0
    thickness_m: float = 0.1


@dataclass(frozen=True)
class Scene:
    """Arena, walls, obstacles, flying altitude and where each quadcopter starts."""

    name: str
    size_x_m: float
    size_y_m: float
    altitude_m: float
    walls: Walls
    obstacles: Tuple[Obstacle, ...]
    starts: Tuple[Pose2D, ...]

    def contains(self, x_m: float, y_m: float) -> bool:
        """Whether a point lies on the arena's floor, border excluded."""
        return 0.0 < x_m < self.size_x_m and 0.0 < y_m < self.size_y_m

    def clearance_m(self, x_m: float, y_m: float, z_m: float) -> float:
        """Distance from a point to the nearest obstacle or wall; negative inside one.

        The floor does not count. Above the walls their upper edge is the
        nearest part of them.
        """
        return self.nearest(x_m, y_m, z_m).clearance_m(x_m, y_m, z_m)

    def flight_clearance_m(self, x_m: float, y_m: float) -> float:
        """``clearance_m`` at the flying altitude."""
        return self.clearance_m(x_m, y_m, self.altitude_m)

    def flight_clearances_m(self, positions_m: np.ndarray) -> np.ndarray:
        """``flight_clearance_m`` of many points: float64[..., 2] to float64[...]."""
        x_m, y_m = positions_m[..., 0], positions_m[..., 1]
        nearest = np.full(x_m.shape, np.inf)
        for solid in (*self.wall_boxes(), *self.obstacles):
            np.minimum(nearest, solid.clearance_m(x_m, y_m, self.altitude_m), out=nearest)
        return nearest

    def nearest(self, x_m: float, y_m: float, z_m: float) -> Obstacle:
        """The obstacle or wall whose surface is nearest to a point."""
        return min((*self.wall_boxes(), *self.obstacles),
                   key=lambda solid: solid.clearance_m(x_m, y_m, z_m))

    def wall_boxes(self) -> List[Box]:
        """The walls as boxes; the ones at the lower and upper y hold the corners."""
        t, h = self.walls.thickness_m, self.walls.height_m
        size_x, size_y = self.size_x_m, self.size_y_m
        return [
            Box("wall_west", -t / 2, size_y / 2, t, size_y, h),
            Box("wall_east", size_x + t / 2, size_y / 2, t, size_y, h),
            Box("wall_south", size_x / 2, -t / 2, size_x + 2 * t, t, h),
            Box("wall_north", size_x / 2, size_y + t / 2, size_x + 2 * t, t, h),
        ]


def _outside_slab(z_m: float, bottom_m: float, height_m: float) -> float:
    """How far z is above or below a horizontal slab; negative inside."""
    return max(bottom_m - z_m, z_m - bottom_m - height_m)


def _signed_distance(outside_m: Tuple[Lengths, ...]) -> Any:
    """Distance to a product of intervals from how far outside each one a point is.

    Outside, the positive parts are the legs of a right triangle; inside, the
    nearest face decides.
    """
    distance_m = np.sqrt(sum(np.maximum(d, 0.0) ** 2 for d in outside_m))
    deepest_m = outside_m[0]
    for d in outside_m[1:]:
        deepest_m = np.maximum(deepest_m, d)
    return np.where(distance_m > 0.0, distance_m, deepest_m)[()]
