"""What the LIDARs' beams hit: found by a kernel of ours, or by the physics engine.

Both know the same shapes; the kernel is some ten times as fast and exact.
"""

from __future__ import annotations

from typing import Protocol, Sequence

import numpy as np

from quad_nav.kernels.lidar import Beams, Solids, cast_scans
from quad_nav.kernels.rays import CYLINDER
from quad_nav.sim.flight import BodyState
from quad_nav.sim.lidar import MOUNT_HEIGHT_M, LidarParams, beam_directions, lidar_poses
from quad_nav.sim.scene import BODY_RADIUS_M, GUARD_HEIGHT_M, Scene
from quad_nav.sim.solids import join, split_scene


class Caster(Protocol):
    """Finds what the beams of quadcopters' LIDARs hit."""

    def cast(self, bodies: BodyState, robots: Sequence[int]) -> np.ndarray:
        """Distances float64[len(robots), beams] to the first hits, +inf for none.

        ``bodies`` is where all quadcopters are. A solid that a beam begins inside of, as
        each does in the guard of its own quadcopter, is not hit.
        """


class RayWorld(Protocol):
    """Bodies that rays can be cast at; ``body.World`` is one."""

    def cast(self, starts_m: np.ndarray, ends_m: np.ndarray) -> np.ndarray:
        """Fraction of the way to the first hit float64[m], +inf for none.

        ``starts_m`` and ``ends_m`` are float64[m, 3] in ``map``. A solid that
        a ray starts inside of is not hit.
        """


class WorldCaster:
    """Casts at the bodies of a world, which are where that world has them."""

    def __init__(self, params: LidarParams, world: RayWorld):
        self._params = params
        self._world = world
        self._directions = beam_directions(params)

    def cast(self, bodies: BodyState, robots: Sequence[int]) -> np.ndarray:
        """See ``Caster``."""
        near_m, far_m = self._params.range_min_m, self._params.range_max_m
        origins, rotations = lidar_poses(bodies, robots)
        directions = self._directions @ np.swapaxes(rotations, 1, 2)
        starts = origins[:, None] + near_m * directions
        ends = origins[:, None] + far_m * directions
        fractions = self._world.cast(starts.reshape(-1, 3), ends.reshape(-1, 3))
        return (near_m + fractions * (far_m - near_m)).reshape(starts.shape[:2])


class KernelCaster:
    """Casts at a scene's shapes, the floor and the guards of quadcopters."""

    def __init__(
        self, params: LidarParams, scene: Scene, n_robots: int, body_radius_m: float = BODY_RADIUS_M
    ):
        directions = np.ascontiguousarray(beam_directions(params)[:, :2])
        self._beams = Beams(
            directions,
            params.angle_min_rad,
            params.step_size_rad,
            params.range_min_m,
            params.range_max_m,
        )
        resting, self._grid = split_scene(scene)
        self._solids = join(resting, _guards(n_robots, body_radius_m))
        self._guards = slice(len(resting.kinds), None)

    def cast(self, bodies: BodyState, robots: Sequence[int]) -> np.ndarray:
        """See ``Caster``."""
        self._solids.centres[self._guards] = (
            bodies.positions_m + MOUNT_HEIGHT_M * bodies.rotations[:, :, 2]
        )
        self._solids.rotations[self._guards] = np.swapaxes(bodies.rotations, 1, 2)
        origins, rotations = lidar_poses(bodies, robots)
        distances = np.empty((len(robots), len(self._beams.directions)))
        cast_scans(origins, rotations, self._beams, self._solids, self._grid, distances)
        return distances


def _guards(count: int, radius_m: float) -> Solids:
    """Cylinders of quadcopters, anywhere."""
    sizes = (radius_m, radius_m, GUARD_HEIGHT_M / 2)
    return Solids(
        np.full(count, CYLINDER, np.int64),
        np.zeros((count, 3)),
        np.zeros((count, 3, 3)),
        np.tile(sizes, (count, 1)),
    )
