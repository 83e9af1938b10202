"""From a commanded velocity to thrust and torque.

Three loops, each faster than the one around it; all arrays hold one row per
quadcopter.

1. Velocity. ``a = k_v (v_commanded - v)`` in the horizontal plane, plus the
   acceleration that a turning quadcopter needs to keep its body-frame velocity,
   ``r z x v_commanded``. Its length is limited to the acceleration limit and to
   what the largest tilt gives, ``g tan(tilt)``.
2. Altitude. ``a_z = w_z^2 (z_0 - z) - 2 w_z v_z``, critically damped. The thrust
   is what makes the vertical force right at the present tilt.
3. Attitude. Accelerating by a means thrusting along ``a + g z``, so the body's
   z axis b has to reach that direction d. The rotation error is ``b x d``, which
   is (-d_y, d_x, 0) in the body frame, and ``angular acceleration =
   w_a^2 (b x d) - 2 w_a omega`` is critically damped too. About b, the yaw rate
   is tracked with its acceleration limited.

Loop 3 answers the outer one like a lag of ``2 / w_a``. With ``k_v = w_a / 8``
the velocity loop is a double real pole at ``w_a / 4``: the fastest that does not
overshoot. With ``w_a = 25 rad/s`` a step is within 5 % after 0.76 s.

The law has no memory: equal states and commands give equal forces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Tuple

import numpy as np

from quad_nav.errors import InputError
from quad_nav.geometry import Twist2D
from quad_nav.kernels import flight_law
from quad_nav.sim.scene import BODY_RADIUS_M

GRAVITY_MPS2 = 9.81


@dataclass(frozen=True)
class Airframe:
    """Mass properties and limits of a 1 kg quadcopter with 0.2 m arms.

    ``radius_m`` is that of the cylinder that it touches things with, see ``scene``.
    """

    mass_kg: float = 1.0
    inertia_kgm2: Tuple[float, float, float] = (0.010, 0.010, 0.020)
    max_thrust_n: float = 2.0 * 9.81
    max_torques_nm: Tuple[float, float, float] = (1.4, 1.4, 0.4)
    radius_m: float = BODY_RADIUS_M

    def __post_init__(self) -> None:
        if not 0.0 < self.radius_m < math.inf:
            raise InputError([f"body_radius: {self.radius_m}, expected metres above 0"])


@dataclass(frozen=True)
class FlightParams:
    """What a command is limited to, and how stiffly it is tracked."""

    max_speed_mps: float = 2.0
    max_yaw_rate_radps: float = 2.0
    max_acceleration_mps2: float = 2.0
    max_yaw_acceleration_radps2: float = 6.4
    max_tilt_rad: float = math.radians(20.0)
    attitude_bandwidth_radps: float = 25.0
    altitude_bandwidth_radps: float = 5.0
    yaw_rate_gain_per_s: float = 12.0

    @property
    def velocity_gain_per_s(self) -> float:
        return self.attitude_bandwidth_radps / 8.0


@dataclass(frozen=True)
class BodyState:
    """Where the bodies are and how they move, in the frame ``map``.

    ``rows`` float64[n, 13]: position (3), quaternion (x, y, z, w), velocity (3), angular
    velocity (3); m, m/s and rad/s.
    """

    rows: np.ndarray

    @property
    def positions_m(self) -> np.ndarray:
        """float64[n, 3]"""
        return self.rows[:, 0:3]

    @property
    def quaternions(self) -> np.ndarray:
        """float64[n, 4], (x, y, z, w)."""
        return self.rows[:, 3:7]

    @property
    def velocities_mps(self) -> np.ndarray:
        """float64[n, 3]"""
        return self.rows[:, 7:10]

    @property
    def angular_radps(self) -> np.ndarray:
        """float64[n, 3]"""
        return self.rows[:, 10:13]

    @cached_property
    def rotations(self) -> np.ndarray:
        """float64[n, 3, 3], the body axes as columns."""
        rotations = np.empty((len(self.rows), 3, 3))
        for row, rotation in zip(self.rows, rotations):
            flight_law.rotation_from_quaternion(row[3:7], rotation)
        return rotations


def limit_command(twist: Twist2D, params: FlightParams) -> Tuple[float, float, float]:
    """(vx, vy, vyaw) within the limits; a velocity that is too long keeps its direction."""
    speed = math.hypot(twist.vx_mps, twist.vy_mps)
    shorten = min(1.0, params.max_speed_mps / speed) if speed > 0.0 else 1.0
    limit = params.max_yaw_rate_radps
    return (
        shorten * twist.vx_mps,
        shorten * twist.vy_mps,
        min(max(twist.vyaw_radps, -limit), limit),
    )


class FlightLaw:
    """The law for one airframe; it has no memory of what it was called with.

    ``law`` and ``airframe`` are what ``flight_law.fly`` calls so.
    """

    def __init__(self, airframe: Airframe, params: FlightParams):
        limit_mps2 = min(params.max_acceleration_mps2, GRAVITY_MPS2 * math.tan(params.max_tilt_rad))
        self.law = (
            params.velocity_gain_per_s,
            params.attitude_bandwidth_radps,
            params.altitude_bandwidth_radps,
            params.yaw_rate_gain_per_s,
            limit_mps2,
            params.max_yaw_acceleration_radps2,
        )
        self.airframe = np.array(
            [
                airframe.mass_kg,
                airframe.max_thrust_n,
                *airframe.inertia_kgm2,
                *airframe.max_torques_nm,
            ]
        )

    def thrust_and_torque(
        self, state: BodyState, commands: np.ndarray, altitude_m: float
    ) -> Tuple[np.ndarray, np.ndarray]:
        """Forces and torques float64[n, 3] in ``map`` that track the commands.

        ``commands`` float64[n, 3] are (vx, vy, vyaw) as from ``limit_command``: m/s
        ahead and to the left of the heading, rad/s.
        """
        forces, torques = np.empty_like(commands), np.empty_like(commands)
        flight_law.fly(
            state.rows, commands, altitude_m, GRAVITY_MPS2, self.airframe, self.law, forces, torques
        )
        return forces, torques
