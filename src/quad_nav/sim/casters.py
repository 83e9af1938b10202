"""LIDARs of all quadcopters, and the two ray casters that find what their beams hit.

``KernelCaster`` uses a numba kernel, ``WorldCaster`` the physics engine. Both have the same
shapes. The kernel is exact and about ten times as fast.
"""

from __future__ import annotations

from typing import Callable, List, Protocol, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Scan
from quad_nav.sim.flight import BodyState
from quad_nav.sim.lidar import LidarParams, beam_directions, lidar_poses, make_scan
from quad_nav.sim.lidar_kernel import Beams, Solids, cast_scans
from quad_nav.sim.rays import CYLINDER
from quad_nav.sim.scene import BODY_RADIUS_M, GUARD_HEIGHT_M, MOUNT_HEIGHT_M, Scene
from quad_nav.sim.solids import join, place, solids_of, split_scene

Floats = NDArray[np.float64]


class Caster(Protocol):
    """Finder of what the beams of LIDARs hit."""

    def cast(self, bodies: BodyState, robots: Sequence[int]) -> Floats:
        """Cast the beams of some robots' LIDARs.

        Args:
            bodies: State of all quadcopters and moving obstacles.
            robots: Numbers of the robots.

        Returns:
            float64[len(robots), beams], distances to the first hits in m; +inf for no hit. A beam
            does not hit a solid that it starts in, such as the guard of its own quadcopter.
        """


class WorldCaster:
    """Caster that uses the bodies of the physics engine's world, by ``body.World.cast``."""

    def __init__(self, params: LidarParams, cast_rays: Callable[[Floats, Floats], Floats]) -> None:
        self._params = params
        self._cast_rays = cast_rays
        self._directions = beam_directions(params)

    def cast(self, bodies: BodyState, robots: Sequence[int]) -> Floats:
        """Cast the beams; see ``Caster.cast``."""
        near_m, far_m = self._params.range_min_m, self._params.range_max_m
        origins, rotations = lidar_poses(bodies, robots)
        directions = self._directions @ np.swapaxes(rotations, 1, 2)
        starts = origins[:, None] + near_m * directions
        ends = origins[:, None] + far_m * directions
        fractions = self._cast_rays(starts.reshape(-1, 3), ends.reshape(-1, 3))
        return (near_m + fractions * (far_m - near_m)).reshape(starts.shape[:2])


class KernelCaster:
    """Caster that computes hits with a scene's solids, the floor and the quadcopters' guards.

    Moving obstacles and guards are at the poses in the ``BodyState``.
    """

    def __init__(
        self, params: LidarParams, scene: Scene, n_robots: int, body_radius_m: float = BODY_RADIUS_M
    ) -> None:
        directions = np.ascontiguousarray(beam_directions(params)[:, :2])
        self._beams = Beams(
            directions,
            params.angle_min_rad,
            params.step_size_rad,
            params.range_min_m,
            params.range_max_m,
        )
        resting, self._grid = split_scene(scene)
        moving, count = solids_of(scene.moving_shapes), len(resting.kinds)
        if len(moving.kinds) > 0:
            resting = join(resting, moving)
        self._solids = join(resting, _guards(n_robots, body_radius_m))
        self._moving = Solids(*(column[count : len(resting.kinds)] for column in self._solids))
        self._guard_centres = self._solids.centres[len(resting.kinds) :]
        self._guard_rotations = self._solids.rotations[len(resting.kinds) :]

    def cast(self, bodies: BodyState, robots: Sequence[int]) -> Floats:
        """Cast the beams; see ``Caster.cast``."""
        rotations = bodies.rotations
        self._guard_centres[:] = bodies.positions_m + MOUNT_HEIGHT_M * rotations[:, :, 2]
        self._guard_rotations[:] = rotations.transpose(0, 2, 1)
        if len(self._moving.kinds) > 0:
            place(self._moving, bodies.obstacles)
        origins = self._guard_centres  # the guards are centred on the LIDARs
        if len(robots) < len(origins):
            origins, rotations = origins[list(robots)], rotations[list(robots)]
        distances = np.empty((len(robots), len(self._beams.directions)))
        cast_scans(origins, rotations, self._beams, self._solids, self._grid, distances)
        return distances


def _guards(count: int, radius_m: float) -> Solids:
    """Return the guards' cylinders, at positions that ``KernelCaster.cast`` sets."""
    sizes = (radius_m, radius_m, GUARD_HEIGHT_M / 2)
    return Solids(
        np.full(count, CYLINDER, np.int64),
        np.zeros((count, 3)),
        np.zeros((count, 3, 3)),
        np.tile(sizes, (count, 1)),
    )


class Lidars:
    """LIDARs of all quadcopters.

    ``caster`` finds what the beams hit. The noise of each LIDAR follows from ``seed``.
    """

    def __init__(self, params: LidarParams, caster: Caster, n_robots: int, seed: int) -> None:
        self.params = params
        self._caster = caster
        self._noise = [np.random.default_rng([seed, 1, robot]) for robot in range(n_robots)]

    def scan(self, bodies: BodyState, robots: Sequence[int], now_s: float) -> List[Scan]:
        """Return a scan of each of some robots, with ``now_s`` as its stamp."""
        return [
            make_scan(self.params, now_s, row, self._noise[robot])
            for robot, row in zip(robots, self._caster.cast(bodies, robots))
        ]


def kernel_lidars(
    params: LidarParams,
    scene: Scene,
    n_robots: int,
    seed: int,
    body_radius_m: float = BODY_RADIUS_M,
) -> Lidars:
    """Return LIDARs that need no physics engine."""
    return Lidars(params, KernelCaster(params, scene, n_robots, body_radius_m), n_robots, seed)
