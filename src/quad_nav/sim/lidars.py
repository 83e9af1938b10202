"""The LIDARs of all quadcopters."""

from __future__ import annotations

from typing import List, Sequence

import numpy as np

from quad_nav.geometry import Scan
from quad_nav.sim.casters import Caster, KernelCaster
from quad_nav.sim.flight import BodyState
from quad_nav.sim.lidar import LidarParams, make_scan
from quad_nav.sim.scene import BODY_RADIUS_M, Scene


class Lidars:
    """What beams hit is found by ``caster``; each LIDAR's noise follows from ``seed``."""

    def __init__(self, params: LidarParams, caster: Caster, n_robots: int, seed: int):
        self.params = params
        self._caster = caster
        self._noise = [np.random.default_rng([seed, 1, robot]) for robot in range(n_robots)]

    def scan(self, bodies: BodyState, robots: Sequence[int], now_s: float) -> List[Scan]:
        """What those of some quadcopters see at this instant; ``bodies`` are all quadcopters."""
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
    """LIDARs that need no physics engine."""
    return Lidars(params, KernelCaster(params, scene, n_robots, body_radius_m), n_robots, seed)
