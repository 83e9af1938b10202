"""Whether quadcopters are so near to something that they may touch it.

As long as they are not, nothing but their own thrust moves them, and the physics engine
is not needed. A clearance changes by no more than the way flown since it was taken, so
that it is asked for only now and then.
"""
from __future__ import annotations

import math

import numpy as np

from quad_nav.kernels.rigid_body import A_PAIR, NOBODY, find_near
from quad_nav.sim.flight import BodyState
from quad_nav.sim.lidar import MOUNT_HEIGHT_M
from quad_nav.sim.scene import GUARD_HEIGHT_M, Scene

_MARGIN_M = 0.03
"""More than two quadcopters fly in a step, and than the engine adds to its shapes."""
_STEPS_NEAR = 12
"""Who is near something stays so for a while; asking less often is cheaper."""


class Proximity:
    """Watches ``n_robots`` quadcopters with guards of a radius in a scene."""

    def __init__(self, scene: Scene, n_robots: int, radius_m: float):
        self._scene = scene
        # A ball around the guard's centre holds it, however the quadcopter tilts.
        self._reach_m = math.hypot(radius_m, GUARD_HEIGHT_M / 2) + _MARGIN_M
        self._centres_m = np.empty((n_robots, 3))
        self._known_m = np.zeros((n_robots, 3))
        self._rooms_m = np.zeros(n_robots)
        self._steps_left = 0

    def may_touch(self, bodies: BodyState) -> bool:
        """Whether any of them may touch something in the next step."""
        if self._steps_left > 0:
            self._steps_left -= 1
            return True
        while True:
            found = find_near(bodies.rows, MOUNT_HEIGHT_M, 2 * self._reach_m, self._known_m,
                              self._rooms_m, self._centres_m)
            if found == NOBODY:
                return False
            if found == A_PAIR or not self._has_room(found):
                self._steps_left = _STEPS_NEAR
                return True

    def _has_room(self, robot: int) -> bool:
        x_m, y_m, z_m = self._centres_m[robot].tolist()
        clearance_m = min(self._scene.clearance_m(x_m, y_m, z_m), z_m)
        self._known_m[robot] = x_m, y_m, z_m
        self._rooms_m[robot] = max(0.0, clearance_m - self._reach_m)
        return bool(self._rooms_m[robot] > 0.0)
