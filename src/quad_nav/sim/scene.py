"""Scenes: an arena with walls and obstacles that quadcopters fly in.

In ``map`` the floor is at z = 0, x runs along the arena's first size, y along the second and z
upwards. The arena's lower left corner is at the scene's origin. The walls stand outside the arena
with their inner faces on its border.

``scene_file.load_scene`` reads a scene from a file.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, Dict, Iterable, List, Optional, Sequence, Tuple, Type, cast

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D
from quad_nav.sim.motion import Motion, Walkers
from quad_nav.sim.obstacles import Box, Cylinder, Obstacle

Floats = NDArray[np.float64]

BODY_RADIUS_M = 0.30
"""Default radius of the quadcopter's guard, the cylinder that collides and that beams hit."""
GUARD_HEIGHT_M = 0.24
"""Height of the guard; the LIDAR is at its centre."""
MOUNT_HEIGHT_M = 0.06
"""Height of the LIDAR above the quadcopter's origin, which flies at the altitude."""


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
        is_map: A map of ``map_server`` gave the obstacles.
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
    is_map: bool = field(default=False, compare=False)

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
        """Return the distance along the floor to the nearest of ``in_flight``; +inf without any."""
        return float(self.flight_surface_distances_m(np.array([x_m, y_m])))

    def flight_surface_distances_m(self, positions_m: Floats) -> Floats:
        """Return ``flight_surface_distance_m`` of many points: float64[..., 2] to float64[...]."""
        return _distances_m(self._in_flight_by_shape, positions_m, self.altitude_m)

    def surface_distances_m(self, positions_m: Floats, z_m: float) -> Floats:
        """Return ``surface_distance_m`` of many points: float64[..., 2] to float64[...]."""
        return _distances_m(self._by_shape, positions_m, z_m)

    @cached_property
    def in_flight(self) -> Tuple[Obstacle, ...]:
        """Walls and obstacles that a hull at the flying altitude can touch, see ``touchable``."""
        return tuple(self.touchable((*self.wall_boxes(), *self.obstacles)))

    def touchable(self, solids: Iterable[Obstacle]) -> List[Obstacle]:
        """Return the solids that a hull at the flying altitude can touch.

        They are stretched to that altitude: a hull has a height, and distances are those of points.
        """
        bottom_m, top_m = hull_heights_m(self.altitude_m)
        return [
            _stretched(one, self.altitude_m)
            for one in solids
            if one.bottom_m < top_m and one.top_m > bottom_m
        ]

    def nearest(self, x_m: float, y_m: float, z_m: float) -> Obstacle:
        """Return the obstacle or wall whose surface is nearest to a point."""
        nearest = [alike.nearest(x_m, y_m, z_m) for alike in self._by_shape]
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

    def moving_solids(self, poses: Iterable[Sequence[float]]) -> List[Obstacle]:
        """Return ``moving_shapes`` at poses (x_m, y_m, yaw_rad); those with NaN are left out."""
        placed = zip(self.moving_shapes, poses)
        return [shape.placed(pose) for shape, pose in placed if np.isfinite(pose).all()]

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
    def _by_shape(self) -> List[_Alike]:
        return _by_shape((*self.wall_boxes(), *self.obstacles))

    @cached_property
    def _in_flight_by_shape(self) -> List[_Alike]:
        return _by_shape(self.in_flight)


def hull_heights_m(altitude_m: float) -> Tuple[float, float]:
    """Return the lowest and the highest point of a quadcopter's guard at an altitude."""
    centre_m = altitude_m + MOUNT_HEIGHT_M
    return centre_m - 0.5 * GUARD_HEIGHT_M, centre_m + 0.5 * GUARD_HEIGHT_M


def _stretched(solid: Obstacle, altitude_m: float) -> Obstacle:
    given = {one.name for one in fields(cast(Any, solid)) if one.init}
    if solid.crosses(altitude_m) or not given >= {"bottom_m", "height_m"}:
        return solid  # a sphere is nowhere as wide as at its middle
    bottom_m = min(solid.bottom_m, altitude_m)
    return solid.changed(bottom_m=bottom_m, height_m=max(solid.top_m, altitude_m) - bottom_m)


def _by_shape(solids: Iterable[Obstacle]) -> List[_Alike]:
    alike: Dict[Type[Obstacle], List[Obstacle]] = {}
    for solid in solids:
        alike.setdefault(type(solid), []).append(solid)
    return [_Alike(one) for one in alike.values()]


def _distances_m(by_shape: Sequence[_Alike], positions_m: Floats, z_m: float) -> Floats:
    """Return the distances of points float64[..., 2] to the nearest surface; +inf without any.

    The surface distances of two points differ by at most the distance of the points: obstacles
    that are farther from the first point are the nearest to none.
    """
    x_m, y_m = positions_m[..., 0], positions_m[..., 1]
    nearest = np.full(x_m.shape, np.inf)
    points_m = positions_m.reshape(-1, 2)
    reach_m = float(np.hypot(*(points_m - points_m[0]).T).max())
    for alike in by_shape:
        for solid in alike.within(points_m[0, 0], points_m[0, 1], z_m, 2 * reach_m):
            np.minimum(nearest, solid.surface_distance_m(x_m, y_m, z_m), out=nearest)
    return nearest


class _Alike:
    """Obstacles of one shape, of which the nearest is searched."""

    def __init__(self, obstacles: Sequence[Obstacle]) -> None:
        self._obstacles = obstacles
        self._distances_m = type(obstacles[0]).distances_to(obstacles)

    def nearest(self, x_m: float, y_m: float, z_m: float) -> Obstacle:
        """Return the obstacle whose surface is nearest."""
        return self._obstacles[int(np.argmin(self._distances_m(x_m, y_m, z_m)))]

    def within(self, x_m: float, y_m: float, z_m: float, margin_m: float) -> List[Obstacle]:
        """Return the obstacles that are up to ``margin_m`` further away than the nearest one."""
        distances_m = self._distances_m(x_m, y_m, z_m)
        rows = np.flatnonzero(distances_m <= distances_m.min() + margin_m + 1e-9)
        return [self._obstacles[row] for row in rows.tolist()]
