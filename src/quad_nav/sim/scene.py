"""The place that quadcopters fly in: an arena with walls and obstacles.

In frame ``map`` the floor is at z = 0, x runs along the arena's first size, y
along the second, z up; the arena's lower left corner is at the scene's origin.
Walls stand outside the arena, with their inner faces on its border.

Scenes are read from files by ``scene_file.load_scene``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, List, Sequence, Tuple, Union

import numpy as np

from quad_nav.geometry import Pose2D, rotate_vectors

Lengths = Union[float, np.ndarray]

BODY_RADIUS_M = 0.30
"""Radius of the cylinder that a quadcopter touches things with, if nothing else is asked for."""
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
        x, y = Pose2D(self.x_m, self.y_m, self.yaw_rad).inverse_transform(x_m, y_m)
        outside = (
            np.abs(x) - self.size_x_m / 2.0,
            np.abs(y) - self.size_y_m / 2.0,
            _outside_slab(z_m, self.bottom_m, self.height_m),
        )
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
        outside = (
            np.hypot(x_m - self.x_m, y_m - self.y_m) - self.radius_m,
            _outside_slab(z_m, self.bottom_m, self.height_m),
        )
        return _signed_distance(outside)


@dataclass(frozen=True)
class Sphere:
    """A ball around (x, y, z)."""

    name: str
    x_m: float
    y_m: float
    z_m: float
    radius_m: float

    @property
    def bottom_m(self) -> float:
        return self.z_m - self.radius_m

    @property
    def height_m(self) -> float:
        return 2.0 * self.radius_m

    def clearance_m(self, x_m: Lengths, y_m: Lengths, z_m: float) -> Any:
        """Distance from a point, or from each of many, to the surface; negative inside."""
        dx, dy, dz = x_m - self.x_m, y_m - self.y_m, z_m - self.z_m
        return np.sqrt(dx * dx + dy * dy + dz * dz) - self.radius_m


Obstacle = Union[Box, Cylinder, Sphere]


@dataclass(frozen=True)
class Walls:
    """The four walls around the arena."""

    height_m: float = 2.0
    thickness_m: float = 0.1


@dataclass(frozen=True)
class Scene:
    """Arena, walls, obstacles, flying altitude and where each quadcopter starts.

    ``remarks`` is what whoever flies should know about it: what a file holds that
    the scene does not, what was chosen where the file says nothing.
    """

    name: str
    size_x_m: float
    size_y_m: float
    altitude_m: float
    walls: Walls
    obstacles: Tuple[Obstacle, ...]
    starts: Tuple[Pose2D, ...]
    origin_x_m: float = 0.0
    origin_y_m: float = 0.0
    remarks: Tuple[str, ...] = ()

    @property
    def end_x_m(self) -> float:
        """X of the arena's upper right corner."""
        return self.origin_x_m + self.size_x_m

    @property
    def end_y_m(self) -> float:
        """Y of the arena's upper right corner."""
        return self.origin_y_m + self.size_y_m

    @property
    def centre(self) -> Tuple[float, float]:
        """X and y of the arena's centre."""
        return (self.origin_x_m + self.size_x_m / 2, self.origin_y_m + self.size_y_m / 2)

    def contains(self, x_m: float, y_m: float) -> bool:
        """Whether a point lies on the arena's floor, border excluded."""
        return self.origin_x_m < x_m < self.end_x_m and self.origin_y_m < y_m < self.end_y_m

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
        for solid in self._nearest_to_any(positions_m.reshape(-1, 2)):
            np.minimum(nearest, solid.clearance_m(x_m, y_m, self.altitude_m), out=nearest)
        return nearest

    def _nearest_to_any(self, positions_m: np.ndarray) -> List[Obstacle]:
        """Everything that can be the nearest to one of these points, float64[n, 2].

        A clearance changes by no more than the way between two points.
        """
        x_m, y_m = positions_m[0]
        reach_m = float(np.hypot(*(positions_m - positions_m[0]).T).max())
        boxes = self._boxes.within(x_m, y_m, self.altitude_m, 2 * reach_m)
        return [*boxes, *self._round_obstacles]

    def nearest(self, x_m: float, y_m: float, z_m: float) -> Obstacle:
        """The obstacle or wall whose surface is nearest to a point."""
        nearest: List[Obstacle] = [self._boxes.nearest(x_m, y_m, z_m)]
        if self._round_obstacles:
            nearest.append(self._rounds.nearest(x_m, y_m, z_m))
        return min(nearest, key=lambda solid: solid.clearance_m(x_m, y_m, z_m))

    def wall_boxes(self) -> List[Box]:
        """The walls as boxes; the ones at the lower and upper y hold the corners."""
        t, h = self.walls.thickness_m, self.walls.height_m
        size_x, size_y = self.size_x_m, self.size_y_m
        x, y = self.centre
        return [
            Box("wall_west", self.origin_x_m - t / 2, y, t, size_y, h),
            Box("wall_east", self.end_x_m + t / 2, y, t, size_y, h),
            Box("wall_south", x, self.origin_y_m - t / 2, size_x + 2 * t, t, h),
            Box("wall_north", x, self.end_y_m + t / 2, size_x + 2 * t, t, h),
        ]

    @cached_property
    def _boxes(self) -> _Boxes:
        return _Boxes([*self.wall_boxes(), *(o for o in self.obstacles if isinstance(o, Box))])

    @cached_property
    def _round_obstacles(self) -> List[Union[Cylinder, Sphere]]:
        return [o for o in self.obstacles if not isinstance(o, Box)]

    @cached_property
    def _rounds(self) -> _Rounds:
        return _Rounds(self._round_obstacles)


class _Boxes:
    """Many boxes, asked for the nearest one: a map has thousands of them."""

    def __init__(self, boxes: Sequence[Box]):
        self.boxes = boxes
        self._centres = np.array([[b.x_m, b.y_m, b.bottom_m + b.height_m / 2] for b in boxes])
        self._halves = np.array([[b.size_x_m, b.size_y_m, b.height_m] for b in boxes]) / 2
        self._cos = np.array([math.cos(b.yaw_rad) for b in boxes])
        self._sin = np.array([math.sin(b.yaw_rad) for b in boxes])

    def nearest(self, x_m: float, y_m: float, z_m: float) -> Box:
        """The box with the least clearance."""
        return self.boxes[int(np.argmin(self._clearances_m(x_m, y_m, z_m)))]

    def within(self, x_m: float, y_m: float, z_m: float, margin_m: float) -> List[Box]:
        """The boxes with up to ``margin_m`` more clearance than the nearest one."""
        clearances_m = self._clearances_m(x_m, y_m, z_m)
        near = clearances_m <= clearances_m.min() + margin_m + 1e-9
        return [self.boxes[k] for k in np.flatnonzero(near)]

    def _clearances_m(self, x_m: float, y_m: float, z_m: float) -> np.ndarray:
        """Of each box, float64[n]; see ``Box.clearance_m``."""
        dx, dy, dz = ((x_m, y_m, z_m) - self._centres).T
        local = (*rotate_vectors(self._cos, -self._sin, dx, dy), dz)
        outside = np.abs(local).T - self._halves
        return _signed_distance((outside[:, 0], outside[:, 1], outside[:, 2]))


class _Rounds:
    """Many cylinders and spheres, asked for the nearest one."""

    def __init__(self, rounds: Sequence[Union[Cylinder, Sphere]]):
        self._rounds = rounds
        self._centres = np.array([[o.x_m, o.y_m, o.bottom_m + o.height_m / 2] for o in rounds])
        self._radii = np.array([o.radius_m for o in rounds])
        self._half_heights = np.array([o.height_m / 2 for o in rounds])
        self._are_spheres = np.array([isinstance(o, Sphere) for o in rounds])

    def nearest(self, x_m: float, y_m: float, z_m: float) -> Union[Cylinder, Sphere]:
        """The one with the least clearance; see ``Cylinder.clearance_m``."""
        dx, dy, dz = ((x_m, y_m, z_m) - self._centres).T
        beside = np.hypot(dx, dy)
        upright_m = _signed_distance((beside - self._radii, np.abs(dz) - self._half_heights))
        clearances_m = np.where(self._are_spheres, np.hypot(beside, dz) - self._radii, upright_m)
        return self._rounds[int(np.argmin(clearances_m))]


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
