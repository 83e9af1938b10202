"""Quadcopters far from everything, which fly without the physics engine.

As long as a quadcopter can touch nothing, only its own thrust moves it. A clearance changes
by no more than the way flown since it was taken, so that it is asked for only now and then.
"""

from __future__ import annotations

import math
from typing import List, Tuple

import numpy as np

from quad_nav.kernels.rigid_body import NOBODY, fly_freely
from quad_nav.sim.flight import GRAVITY_MPS2, BodyState, FlightLaw
from quad_nav.sim.lidar import MOUNT_HEIGHT_M
from quad_nav.sim.scene import GUARD_HEIGHT_M, Scene

_MARGIN_M = 0.03
"""More than two quadcopters fly in a step, and than the engine adds to its shapes."""


class FreeFlight:
    """Moves ``n_robots`` quadcopters with guards of a radius through a scene."""

    def __init__(self, scene: Scene, n_robots: int, radius_m: float, law: FlightLaw, step_s: float):
        self._scene = scene
        self._law = law
        self._step_s = step_s
        # A ball around the guard's centre holds it, however the quadcopter tilts.
        self._reach_m = math.hypot(radius_m, GUARD_HEIGHT_M / 2) + _MARGIN_M
        self._centres_m = np.empty((n_robots, 3))
        self._known_m = np.zeros((n_robots, 3))
        self._rooms_m = np.zeros(n_robots)  # around known_m, no clearance is known yet

    def advance(
        self, bodies: BodyState, commands: np.ndarray, held: np.ndarray, steps: int
    ) -> Tuple[BodyState, int, List[int]]:
        """Move all but those that are held, bool[n], by up to so many steps.

        ``commands`` as for the flight law. Returns the bodies after it, the steps done, and
        who may touch something in the next one, which is why they are fewer.
        """
        rows, done = bodies.rows.copy(), 0
        while done < steps:
            more, found, other = fly_freely(
                rows,
                commands,
                held,
                steps - done,
                self._step_s,
                self._scene.altitude_m,
                GRAVITY_MPS2,
                self._law.airframe,
                self._law.law,
                MOUNT_HEIGHT_M,
                2 * self._reach_m,
                self._known_m,
                self._rooms_m,
                self._centres_m,
            )
            done += more
            if other != NOBODY:
                return BodyState(rows), done, [found, other]
            if found != NOBODY and not self._has_room(found):
                return BodyState(rows), done, [found]
        return BodyState(rows), done, []

    def _has_room(self, robot: int) -> bool:
        x_m, y_m, z_m = self._centres_m[robot].tolist()
        clearance_m = min(self._scene.surface_distance_m(x_m, y_m, z_m), z_m)
        self._known_m[robot] = x_m, y_m, z_m
        self._rooms_m[robot] = max(0.0, clearance_m - self._reach_m)
        return bool(self._rooms_m[robot] > 0.0)
