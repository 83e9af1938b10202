"""Scenes: an arena with walls and obstacles that quadcopters fly in.

In ``map`` the floor is at z = 0, x runs along the arena's first size, y along the second and z
upwards. The arena's lower left corner is at the scene's origin. The walls stand outside the arena
with their inner faces on its border.

``scene_file.load_scene`` reads a scene from a file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Coordinate, Pose2D, rotate_vectors
from quad_nav.sim.motion import Motion, Walkers

Floats = NDArray[np.float64]
Lengths = Union[float, Floats]

BODY_RADIUS_M = 0.30
"""Default radius of the quadcopter's guard, the cylinder that collides and that beams hit."""
GUARD_HEIGHT_M = 0.24
"""Height of the guard; the LIDAR is at its centre."""


@dataclass(frozen=True)
class Box:
    """Upright box with its centre at (x, y), rotated by ``yaw_rad`` about its vertical axis."""

    name: str
    x_m: float
    y_m: float
    size_x_m: float
    size_y_m: float
    height_m: float
    yaw_rad: float = 0.0
    bottom_m: float = 0.0

    def surface_distance_m(self, x_m: Coordinate, y_m: Coordinate, z_m: float) -> Any:
        """Return the distance from a point, or from each of many, to the surface.

        Args:
            x_m: Number or float64[...], in ``map``.
            y_m: Of the same shape.
            z_m: Height above the floor.

        Returns:
            Of the same shape; negative inside the obstacle.
        """
        x, y = Pose2D(self.x_m, self.y_m, self.yaw_rad).inverse_transform(x_m, y_m)
        outside = (
            np.abs(x) - self.size_x_m / 2.0,
            np.abs(y) - self.size_y_m / 2.0,
            _outside_slab(z_m, self.bottom_m, self.height_m),
        )
        return _signed_distance(outside)


@dataclass(frozen=True)
class Cylinder:
    """Upright cylinder with its axis at (x, y)."""

    name: str
    x_m: float
    y_m: float
    radius_m: float
    height_m: float
    bottom_m: float = 0.0

    def surface_distance_m(self, x_m: Coordinate, y_m: Coordinate, z_m: float) -> Any:
        """Return the distance from a point, or from each of many, to the surface.

        Args:
            x_m: Number or float64[...], in ``map``.
            y_m: Of the same shape.
            z_m: Height above the floor.

        Returns:
            Of the same shape; negative inside the obstacle.
        """
        outside = (
            np.hypot(x_m - self.x_m, y_m - self.y_m) - self.radius_m,
            _outside_slab(z_m, self.bottom_m, self.height_m),
        )
        return _signed_distance(outside)


@dataclass(frozen=True)
class Sphere:
    """Sphere with its centre at (x, y, z)."""

    name: str
    x_m: float
    y_m: float
    z_m: float
    radius_m: float

    @property
    def bottom_m(self) -> float:
        """Height of the lowest point above the floor."""
        return self.z_m - self.radius_m

    @property
    def height_m(self) -> float:
        """Distance from the lowest to the highest point."""
        return 2.0 * self.radius_m

    def surface_distance_m(self, x_m: Coordinate, y_m: Coordinate, z_m: float) -> Any:
        """Return the distance from a point, or from each of many, to the surface.

        Args:
            x_m: Number or float64[...], in ``map``.
            y_m: Of the same shape.
            z_m: Height above the floor.

        Returns:
            Of the same shape; negative inside the obstacle.
        """
        dx, dy, dz = x_m - self.x_m, y_m - self.y_m, z_m - self.z_m
        return np.sqrt(dx * dx + dy * dy + dz * dz) - self.radius_m


Obstacle = Union[Box, Cylinder, Sphere]


@dataclass(frozen=True)
class MovingObstacle:
    """Obstacle that moves; its shape's place and yaw are those of the first keyframe."""

    shape: Obstacle
    motion: Motion


@dataclass(frozen=True)
class Walls:
    """Dimensions of the four walls around the arena."""

    height_m: float = 2.0
    thickness_m: float = 0.1


@dataclass(frozen=True)
class Scene:
    """Arena, walls, obstacles, flying altitude and start poses.

    Attributes:
        name: Name for messages and reports.
        size_x_m: Size of the arena along x.
        size_y_m: Size of the arena along y.
        altitude_m: Altitude that all quadcopters fly at.
        walls: The walls around the arena.
        obstacles: The obstacles, with unique names.
        starts: Start pose of quadcopter 0, 1, ... in ``map``.
        origin_x_m: x of the arena's lower left corner.
        origin_y_m: y of the arena's lower left corner.
        remarks: Notes for the user: content of the file that the scene leaves out, and values
            that were chosen because the file does not give them.
        moving: Obstacles that move; no method of a scene knows them, see ``movers``.
        motion_phase_s: Time by which all motions are ahead of the clock; None for a random part of
            the longest loop.
        walkers: People who walk, if there are any.
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
    moving: Tuple[MovingObstacle, ...] = ()
    motion_phase_s: Optional[float] = 0.0
    walkers: Optional[Walkers] = None

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
        """Return whether a point lies inside the arena, not on its border."""
        return self.origin_x_m < x_m < self.end_x_m and self.origin_y_m < y_m < self.end_y_m

    def surface_distance_m(self, x_m: float, y_m: float, z_m: float) -> float:
        """Return the distance from a point to the nearest obstacle or wall, not to the floor.

        It is negative inside an obstacle or wall. Above the walls, their upper edge is nearest.
        """
        return self.nearest(x_m, y_m, z_m).surface_distance_m(x_m, y_m, z_m)

    def flight_surface_distance_m(self, x_m: float, y_m: float) -> float:
        """Return the distance to the nearest obstacle or wall at the flying altitude."""
        return self.surface_distance_m(x_m, y_m, self.altitude_m)

    def flight_surface_distances_m(self, positions_m: Floats) -> Floats:
        """Return ``flight_surface_distance_m`` of many points: float64[..., 2] to float64[...]."""
        x_m, y_m = positions_m[..., 0], positions_m[..., 1]
        nearest = np.full(x_m.shape, np.inf)
        for solid in self._nearest_to_any(positions_m.reshape(-1, 2)):
            np.minimum(nearest, solid.surface_distance_m(x_m, y_m, self.altitude_m), out=nearest)
        return nearest

    def _nearest_to_any(self, positions_m: Floats) -> List[Obstacle]:
        """Return all obstacles that can be the nearest to one of the points float64[n, 2].

        The surface distances of two points differ by at most the distance of the points.
        """
        x_m, y_m = positions_m[0]
        reach_m = float(np.hypot(*(positions_m - positions_m[0]).T).max())
        near: List[Obstacle] = [*self._boxes.within(x_m, y_m, self.altitude_m, 2 * reach_m)]
        if self._round_obstacles:
            near += self._rounds.within(x_m, y_m, self.altitude_m, 2 * reach_m)
        return near

    def nearest(self, x_m: float, y_m: float, z_m: float) -> Obstacle:
        """Return the obstacle or wall whose surface is nearest to a point."""
        nearest: List[Obstacle] = [self._boxes.nearest(x_m, y_m, z_m)]
        if self._round_obstacles:
            nearest.append(self._rounds.nearest(x_m, y_m, z_m))
        return min(nearest, key=lambda solid: solid.surface_distance_m(x_m, y_m, z_m))

    @cached_property
    def moving_shapes(self) -> Tuple[Obstacle, ...]:
        """Shapes of all obstacles that move and of all walkers, who are called person_0, ..."""
        people: Tuple[Cylinder, ...] = ()
        if self.walkers is not None:
            people = tuple(
                Cylinder(f"person_{k}", *self.centre, self.walkers.radius_m, self.walkers.height_m)
                for k in range(self.walkers.count)
            )
        return (*(obstacle.shape for obstacle in self.moving), *people)

    @property
    def walker_rows(self) -> slice:
        """Rows of the walkers in ``moving_shapes``; they are the last ones."""
        return slice(len(self.moving), None)

    @property
    def people_react(self) -> bool:
        """There are walkers, and they react to quadcopters."""
        return self.walkers is not None and self.walkers.reacting

    def wall_boxes(self) -> List[Box]:
        """Return the walls as boxes; the southern and northern ones include the corners."""
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


def placed(shape: Obstacle, pose: Sequence[float]) -> Obstacle:
    """Return a shape at a pose (x_m, y_m, yaw_rad) in ``map``."""
    x_m, y_m, yaw_rad = map(float, pose)
    if isinstance(shape, Box):
        return replace(shape, x_m=x_m, y_m=y_m, yaw_rad=yaw_rad)
    return replace(shape, x_m=x_m, y_m=y_m)


class _Boxes:
    """Index of many boxes for the nearest one; a map has thousands."""

    def __init__(self, boxes: Sequence[Box]) -> None:
        self.boxes = boxes
        self._centres = np.array([[b.x_m, b.y_m, b.bottom_m + b.height_m / 2] for b in boxes])
        self._halves = np.array([[b.size_x_m, b.size_y_m, b.height_m] for b in boxes]) / 2
        self._cos = np.array([math.cos(b.yaw_rad) for b in boxes])
        self._sin = np.array([math.sin(b.yaw_rad) for b in boxes])

    def nearest(self, x_m: float, y_m: float, z_m: float) -> Box:
        """Return the box whose surface is nearest."""
        return self.boxes[int(np.argmin(self._surface_distances_m(x_m, y_m, z_m)))]

    def within(self, x_m: float, y_m: float, z_m: float, margin_m: float) -> List[Box]:
        """Return the boxes that are up to ``margin_m`` further away than the nearest one."""
        distances_m = self._surface_distances_m(x_m, y_m, z_m)
        return [self.boxes[k] for k in _within(distances_m, margin_m)]

    def _surface_distances_m(self, x_m: float, y_m: float, z_m: float) -> Floats:
        """Return the distances float64[n] to the boxes; see ``Box.surface_distance_m``."""
        dx, dy, dz = ((x_m, y_m, z_m) - self._centres).T
        local = (*rotate_vectors(self._cos, -self._sin, dx, dy), dz)
        outside = np.abs(local).T - self._halves
        return _signed_distance((outside[:, 0], outside[:, 1], outside[:, 2]))


class _Rounds:
    """Index of many cylinders and spheres for the nearest one."""

    def __init__(self, rounds: Sequence[Union[Cylinder, Sphere]]) -> None:
        self._rounds = rounds
        self._centres = np.array([[o.x_m, o.y_m, o.bottom_m + o.height_m / 2] for o in rounds])
        self._radii = np.array([o.radius_m for o in rounds])
        self._half_heights = np.array([o.height_m / 2 for o in rounds])
        self._are_spheres = np.array([isinstance(o, Sphere) for o in rounds])

    def nearest(self, x_m: float, y_m: float, z_m: float) -> Union[Cylinder, Sphere]:
        """Return the one whose surface is nearest."""
        return self._rounds[int(np.argmin(self._surface_distances_m(x_m, y_m, z_m)))]

    def within(
        self, x_m: float, y_m: float, z_m: float, margin_m: float
    ) -> List[Union[Cylinder, Sphere]]:
        """Return those that are up to ``margin_m`` further away than the nearest one."""
        distances_m = self._surface_distances_m(x_m, y_m, z_m)
        return [self._rounds[k] for k in _within(distances_m, margin_m)]

    def _surface_distances_m(self, x_m: float, y_m: float, z_m: float) -> Floats:
        """Return the distances float64[n]; see ``Cylinder.surface_distance_m``."""
        dx, dy, dz = ((x_m, y_m, z_m) - self._centres).T
        beside = np.hypot(dx, dy)
        upright_m = _signed_distance((beside - self._radii, np.abs(dz) - self._half_heights))
        return np.where(self._are_spheres, np.hypot(beside, dz) - self._radii, upright_m)


def _within(distances_m: Floats, margin_m: float) -> NDArray[np.intp]:
    """Return the indices of distances, float64[n], up to ``margin_m`` above the least."""
    return np.flatnonzero(distances_m <= distances_m.min() + margin_m + 1e-9)


def _outside_slab(z_m: float, bottom_m: float, height_m: float) -> float:
    """Return the distance of z from a horizontal slab; negative inside."""
    return max(bottom_m - z_m, z_m - bottom_m - height_m)


def _signed_distance(outside_m: Tuple[Lengths, ...]) -> Any:
    """Return the distance to a product of intervals from the distances to each interval.

    Outside, the distance is the norm of the positive parts. Inside, it is that to the nearest
    face.
    """
    distance_m = np.sqrt(sum(np.maximum(d, 0.0) ** 2 for d in outside_m))
    deepest_m = outside_m[0]
    for d in outside_m[1:]:
        deepest_m = np.maximum(deepest_m, d)
    return np.where(distance_m > 0.0, distance_m, deepest_m)[()]
