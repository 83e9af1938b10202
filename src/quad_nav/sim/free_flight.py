"""Free flight: quadcopters that are far from everything move without the physics engine.

While a quadcopter cannot touch anything, only gravity and its own thrust and torque act on it.
Its distance to the nearest surface at rest changes by at most the distance that it flies, so that
this distance is computed only now and then. What moves by itself may jump, so that its distance is
checked at every step, from a cylinder that holds it.
"""

from __future__ import annotations

import math
from typing import Callable, List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.sim.flight import BodyState, FlightLaw
from quad_nav.sim.rigid_body import MOVING, NO_INDEX, FreeSpace, MovingSolids, fly_freely
from quad_nav.sim.scene import GUARD_HEIGHT_M, MOUNT_HEIGHT_M, Scene

Floats = NDArray[np.float64]

_MARGIN_M = 0.03
"""More than two quadcopters approach in a step, plus the engine's collision margin."""

_MOVING_STEPS = 60
"""Most steps for which the poses of moving obstacles are computed at once."""

MovingPoses = Callable[[int], Floats]
"""Poses float64[steps, m, 3] of the scene's moving obstacles after each of the next steps."""


class FreeFlight:
    """Moves quadcopters with guards of ``radius_m`` through a scene, in steps of ``step_s``."""

    def __init__(
        self, scene: Scene, n_robots: int, radius_m: float, law: FlightLaw, step_s: float
    ) -> None:
        self._scene = scene
        self._rules = (step_s, scene.altitude_m, law.constants, law.gains)
        # Radius of a sphere that contains the guard at any tilt.
        self._reach_m = math.hypot(radius_m, GUARD_HEIGHT_M / 2) + _MARGIN_M
        self._space = FreeSpace(
            mount_m=MOUNT_HEIGHT_M,
            pair_m=2 * self._reach_m,
            checked_m=np.zeros((n_robots, 3)),
            free_m=np.zeros(n_robots),  # not known yet
            centres_m=np.empty((n_robots, 3)),
        )
        shapes, reach = scene.moving_shapes, self._reach_m
        self._moving = MovingSolids(
            np.zeros((1, len(shapes), 3)),
            np.array([shape.reach_m + reach for shape in shapes], float),
            np.array([shape.bottom_m - reach for shape in shapes], float),
            np.array([shape.top_m + reach for shape in shapes], float),
        )

    def advance(
        self,
        bodies: BodyState,
        commands: Floats,
        excluded: NDArray[np.bool_],
        steps: int,
        moving_poses: Optional[MovingPoses] = None,
    ) -> Tuple[BodyState, int, List[int]]:
        """Move quadcopters until one may touch something.

        Args:
            bodies: State of all quadcopters.
            commands: float64[n, 3], as for the flight controller.
            excluded: bool[n], quadcopters that do not move.
            steps: Largest number of steps.
            moving_poses: Needed if obstacles of the scene move.

        Returns:
            The new state, the number of steps, and the robots that may touch something next.
        """
        rows, done, poses = bodies.rows.copy(), 0, self._moving.poses
        if moving_poses is not None and len(self._moving.reaches_m) > 0:
            steps = min(steps, _MOVING_STEPS)
            poses = moving_poses(steps)
        while done < steps:
            moving = self._moving._replace(poses=poses[done:])
            more, found, other = fly_freely(
                rows, commands, excluded, steps - done, *self._rules, self._space, moving
            )
            done += more
            if other == MOVING:
                return BodyState(rows), done, [found]
            if other != NO_INDEX:
                return BodyState(rows), done, [found, other]
            if found != NO_INDEX and not self._is_far(found):
                return BodyState(rows), done, [found]
        return BodyState(rows), done, []

    def _is_far(self, robot: int) -> bool:
        """Compute a robot's distance to the nearest surface; return whether it is far from it."""
        x_m, y_m, z_m = self._space.centres_m[robot].tolist()
        distance_m = min(self._scene.surface_distance_m(x_m, y_m, z_m), z_m)
        self._space.checked_m[robot] = x_m, y_m, z_m
        self._space.free_m[robot] = max(0.0, distance_m - self._reach_m)
        return bool(self._space.free_m[robot] > 0.0)
