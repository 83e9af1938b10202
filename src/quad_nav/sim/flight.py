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
from typing import Tuple, Union

import numpy as np

from quad_nav.geometry import Twist2D, rotation_from_quaternion

GRAVITY_MPS2 = 9.81


@dataclass(frozen=True)
class Airframe:
    """Mass properties and limits of a 1 kg quadcopter with 0.2 m arms."""

    mass_kg: float = 1.0
    inertia_kgm2: Tuple[float, float, float] = (0.010, 0.010, 0.020)
    max_thrust_n: float = 2.0 * 9.81
    max_torques_nm: Tuple[float, float, float] = (1.4, 1.4, 0.4)


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

    positions_m, velocities_mps and angular_radps float64[n, 3]; quaternions
    float64[n, 4], (x, y, z, w).
    """

    positions_m: np.ndarray
    quaternions: np.ndarray
    velocities_mps: np.ndarray
    angular_radps: np.ndarray

    @cached_property
    def rotations(self) -> np.ndarray:
        """float64[n, 3, 3], the body axes as columns."""
        x, y, z, w = self.quaternions.T
        return np.moveaxis(rotation_from_quaternion((x, y, z, w)), 2, 0)

    @property
    def headings(self) -> np.ndarray:
        """float64[n, 2], the body's x axis seen from above, of length 1."""
        forward = self.rotations[:, :2, 0]
        return forward / np.hypot(forward[:, :1], forward[:, 1:])


def limit_command(twist: Twist2D, params: FlightParams) -> Tuple[float, float, float]:
    """(vx, vy, vyaw) within the limits; a velocity that is too long keeps its direction."""
    speed = math.hypot(twist.vx_mps, twist.vy_mps)
    shorten = min(1.0, params.max_speed_mps / speed) if speed > 0.0 else 1.0
    limit = params.max_yaw_rate_radps
    return (shorten * twist.vx_mps, shorten * twist.vy_mps,
            min(max(twist.vyaw_radps, -limit), limit))


def thrust_and_torque(state: BodyState, commands: np.ndarray, altitude_m: float,
                      airframe: Airframe, params: FlightParams) -> Tuple[np.ndarray, np.ndarray]:
    """Forces and torques float64[n, 3] in ``map`` that track the commands.

    ``commands`` float64[n, 3] are (vx, vy, vyaw) as from ``limit_command``: m/s
    ahead and to the left of the heading, rad/s.
    """
    up = state.rotations[:, :, 2]
    vertical = GRAVITY_MPS2 + _altitude_acceleration(state, altitude_m, params)
    wanted_up = np.empty_like(up)
    wanted_up[:, :2] = _commanded_acceleration(state, commands, params)
    wanted_up[:, 2] = GRAVITY_MPS2
    wanted_up /= np.sqrt(np.sum(wanted_up * wanted_up, axis=1, keepdims=True))

    thrust = airframe.mass_kg * vertical / np.maximum(up[:, 2], 0.5)
    forces = np.minimum(np.maximum(thrust, 0.0), airframe.max_thrust_n)[:, None] * up
    torques = _attitude_torque(state, wanted_up, commands[:, 2], airframe, params)
    return forces, torques


def _commanded_acceleration(state: BodyState, commands: np.ndarray,
                            params: FlightParams) -> np.ndarray:
    """Horizontal acceleration float64[n, 2] in ``map``."""
    forward = state.headings
    left = _turned_left(forward)
    wanted = commands[:, 0:1] * forward + commands[:, 1:2] * left
    turning = state.angular_radps[:, 2:3] * _turned_left(wanted)
    error = wanted - state.velocities_mps[:, :2]
    limit = min(params.max_acceleration_mps2, GRAVITY_MPS2 * math.tan(params.max_tilt_rad))
    return _limit_length(params.velocity_gain_per_s * error + turning, limit)


def _altitude_acceleration(state: BodyState, altitude_m: float,
                           params: FlightParams) -> np.ndarray:
    w = params.altitude_bandwidth_radps
    return w * w * (altitude_m - state.positions_m[:, 2]) - 2.0 * w * state.velocities_mps[:, 2]


def _attitude_torque(state: BodyState, wanted_up: np.ndarray, yaw_rates: np.ndarray,
                     airframe: Airframe, params: FlightParams) -> np.ndarray:
    """Torques float64[n, 3] in ``map``, each body axis within its limit."""
    w = params.attitude_bandwidth_radps
    to_body = np.swapaxes(state.rotations, 1, 2)
    goal = _rotate(to_body, wanted_up)
    omega = _rotate(to_body, state.angular_radps)
    angular = np.empty_like(omega)
    angular[:, 0] = -w * w * goal[:, 1] - 2.0 * w * omega[:, 0]
    angular[:, 1] = w * w * goal[:, 0] - 2.0 * w * omega[:, 1]
    angular[:, 2] = _limit(params.yaw_rate_gain_per_s * (yaw_rates - omega[:, 2]),
                           params.max_yaw_acceleration_radps2)
    torques = _limit(angular * airframe.inertia_kgm2, airframe.max_torques_nm)
    return _rotate(state.rotations, torques)


def _rotate(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return (matrices @ vectors[:, :, None])[:, :, 0]


def _turned_left(vectors: np.ndarray) -> np.ndarray:
    """Horizontal vectors float64[n, 2] turned by a quarter, counter-clockwise."""
    return vectors[:, ::-1] * (-1.0, 1.0)


def _limit(values: np.ndarray, limits: Union[float, Tuple[float, ...]]) -> np.ndarray:
    return np.minimum(np.maximum(values, np.negative(limits)), limits)


def _limit_length(vectors: np.ndarray, limit: float) -> np.ndarray:
    """Vectors float64[n, 2], shortened to the limit where they are longer."""
    lengths = np.hypot(vectors[:, :1], vectors[:, 1:])
    return vectors * (limit / np.maximum(lengths, limit))
