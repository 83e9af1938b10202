"""States of quadcopters: poses and velocities, one by one or as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose3D, Twist2D, rotate
from quad_nav.sim.flight import BodyState
from quad_nav.sim.flight_law import planar_states
from quad_nav.sim.odometry import FIXED_FRAMES, OdomFrames


@dataclass(frozen=True)
class RobotState:
    """Pose and velocities of one quadcopter.

    Attributes:
        map_from_base: Pose of ``base_link`` in ``map``.
        map_velocities: Velocity (x, y, z) and angular velocity (x, y, z) in ``map``.
    """

    map_from_base: Pose3D
    map_velocities: Sequence[float]

    @cached_property
    def linear_mps(self) -> Tuple[float, float, float]:
        """Velocity (x, y, z) in ``base_link``."""
        return self._in_base(self.map_velocities[:3])

    @cached_property
    def angular_radps(self) -> Tuple[float, float, float]:
        """Angular velocity (x, y, z) in ``base_link``."""
        return self._in_base(self.map_velocities[3:])

    @property
    def twist(self) -> Twist2D:
        """Planar velocity in ``base_link``."""
        return Twist2D(self.linear_mps[0], self.linear_mps[1], self.angular_radps[2])

    def _in_base(self, vector: Sequence[float]) -> Tuple[float, float, float]:
        qx, qy, qz, qw = self.map_from_base.quaternion
        return rotate((-qx, -qy, -qz, qw), vector)


class RobotStates(Sequence[RobotState]):
    """States of all quadcopters at one instant; each is computed on its first access.

    Attributes:
        bodies: The states as arrays.
        frames: The odometry frames.
    """

    def __init__(self, bodies: BodyState, frames: OdomFrames = FIXED_FRAMES) -> None:
        self.bodies, self.frames = bodies, frames
        self._states: List[Optional[RobotState]] = [None] * len(bodies.rows)

    def __len__(self) -> int:
        return len(self._states)

    def __getitem__(self, robot: int) -> RobotState:  # type: ignore[override]
        state = self._states[robot]
        if state is None:
            state = self._states[robot] = robot_state(self.bodies.rows[robot])
        return state

    @cached_property
    def planar(self) -> NDArray[np.float64]:
        """Planar states float64[n, 8], see ``sim.flight_law.planar_states``."""
        states = np.empty((len(self._states), 8))
        planar_states(self.bodies.rows, states)
        return states

    @property
    def poses(self) -> NDArray[np.float64]:
        """Poses float64[n, 3] of (x_m, y_m, yaw_rad) in ``map``."""
        return self.planar[:, :3]


def robot_state(row: NDArray[np.float64]) -> RobotState:
    """Return the state of the quadcopter that a row of ``BodyState`` describes."""
    x, y, z, qx, qy, qz, qw, *velocities = row.tolist()
    return RobotState(Pose3D(x, y, z, (qx, qy, qz, qw)), velocities)
