"""Flight controller: thrust and torque that track a commanded velocity.

Three nested loops, each faster than the one around it. All arrays have one row per quadcopter.

1. Velocity. ``a = k_v (v_commanded - v)`` in the horizontal plane, plus the
   acceleration that a turning quadcopter needs to keep its body-frame velocity,
   ``r z x v_commanded``. Its length is limited to the acceleration limit and to
   what the largest tilt gives, ``g tan(tilt)``.
2. Altitude. ``a_z = w_z^2 (z_0 - z) - 2 w_z v_z``, critically damped. The thrust
   gives the vertical force at the present tilt.
3. Attitude. An acceleration a needs a thrust along ``a + g z``, so the body's
   z axis b has to reach that direction d. The rotation error is ``b x d``, which
   is (-d_y, d_x, 0) in the body frame, and ``angular acceleration =
   w_a^2 (b x d) - 2 w_a omega`` is critically damped too. About b, the yaw rate
   is tracked with its acceleration limited.

Loop 3 responds to the outer one like a lag of ``2 / w_a``. With ``k_v = w_a / 8``
the velocity loop is a double real pole at ``w_a / 4``: the fastest that does not
overshoot. With ``w_a = 25 rad/s`` a step is within 5 % after 0.76 s.

The controller has no state: equal states and commands give equal forces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError
from quad_nav.geometry import Twist2D
from quad_nav.sim import flight_law
from quad_nav.sim.scene import BODY_RADIUS_M

Floats = NDArray[np.float64]

GRAVITY_MPS2 = 9.81
BODY_VALUES = 13
"""Numbers in the state of a body."""
NO_OBSTACLES: Floats = np.zeros((0, 3))


@dataclass(frozen=True)
class AutopilotResponse:
    """Response of an autopilot to velocity set-points; the defaults are ArduCopter 4.5.3's.

    They were fitted to its flights in its own simulator (``docs/airframes.md``). The last two are
    what the bridge of vehicles adds in front of it.

    Attributes:
        velocity_delay_s: Delay of the velocity in each of the world's axes.
        velocity_time_s: Time constant of its first-order response.
        yaw_delay_s: Delay of the yaw rate.
        yaw_frequency_radps: Natural frequency of its second-order response.
        yaw_damping: Damping ratio of that.
        max_yaw_rate_radps: Limit of the commanded yaw rate.
        max_acceleration_mps2: Limit of the horizontal acceleration.
        repeat_s: Period in which the bridge sends the command in force again; infinite for never.
        turn_lead_s: Time by which the bridge turns velocities ahead of the heading.
    """

    velocity_delay_s: float = 0.196
    velocity_time_s: float = 0.449
    yaw_delay_s: float = 0.125
    yaw_frequency_radps: float = 5.6
    yaw_damping: float = 0.25
    max_yaw_rate_radps: float = 1.05
    max_acceleration_mps2: float = 2.5
    repeat_s: float = math.inf
    turn_lead_s: float = 0.0


@dataclass(frozen=True)
class Airframe:
    """Mass properties and limits; the defaults are a 1 kg quadcopter with arms of 0.2 m.

    Attributes:
        mass_kg: Mass.
        inertia_kgm2: Principal moments of inertia about the body's x, y and z axes.
        max_thrust_n: Largest thrust.
        max_torques_nm: Largest torques about the body's x, y and z axes.
        radius_m: Radius of the guard, the cylinder that collides.
        response: Response of its autopilot; None for the flight controller of this module alone.

    Raises:
        InputError: The radius is not above 0.
    """

    mass_kg: float = 1.0
    inertia_kgm2: Tuple[float, float, float] = (0.010, 0.010, 0.020)
    max_thrust_n: float = 2.0 * 9.81
    max_torques_nm: Tuple[float, float, float] = (1.4, 1.4, 0.4)
    radius_m: float = BODY_RADIUS_M
    response: Optional[AutopilotResponse] = None

    def __post_init__(self) -> None:
        if not 0.0 < self.radius_m < math.inf:
            raise InputError([f"body_radius: {self.radius_m}, expected metres above 0"])


AIRFRAMES = {
    "default": Airframe(),
    "arducopter": Airframe(response=AutopilotResponse(repeat_s=0.05, turn_lead_s=0.6)),
}
"""Airframes by the name that users choose."""


def airframe_name(airframe: Airframe) -> str:
    """Return the name in ``AIRFRAMES`` of the airframe with this response; "custom" without one."""
    names = [name for name, one in AIRFRAMES.items() if one.response == airframe.response]
    return names[0] if names else "custom"


@dataclass(frozen=True)
class FlightParams:
    """Limits of commands, and gains of the flight controller."""

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
        """Gain of the velocity loop; see the module's docstring."""
        return self.attitude_bandwidth_radps / 8.0


@dataclass(frozen=True)
class BodyState:
    """Poses and velocities of all quadcopters in ``map``, and the poses of what moves by itself.

    Attributes:
        rows: float64[n, BODY_VALUES]: position (3) in m, quaternion (x, y, z, w), velocity (3) in
            m/s, angular velocity (3) in rad/s.
        obstacles: float64[m, 3], poses (x_m, y_m, yaw_rad) of ``Scene.moving_shapes``.
    """

    rows: Floats
    obstacles: Floats = field(default_factory=lambda: NO_OBSTACLES)

    @property
    def positions_m(self) -> Floats:
        """Positions float64[n, 3] in ``map``."""
        return self.rows[:, 0:3]

    @property
    def quaternions(self) -> Floats:
        """Quaternions float64[n, 4], (x, y, z, w), from the body's frame to ``map``."""
        return self.rows[:, 3:7]

    @property
    def velocities_mps(self) -> Floats:
        """Velocities float64[n, 3] in ``map``."""
        return self.rows[:, 7:10]

    @cached_property
    def rotations(self) -> Floats:
        """Rotation matrices float64[n, 3, 3] with the bodies' axes in ``map`` as columns."""
        rotations = np.empty((len(self.rows), 3, 3))
        flight_law.rotations_from_quaternions(self.rows[:, 3:7], rotations)
        return rotations


def limit_command(twist: Twist2D, params: FlightParams) -> Tuple[float, float, float]:
    """Limit a command; a velocity that is too fast keeps its direction.

    Returns:
        (vx, vy, vyaw) in m/s and rad/s, in the body's frame.
    """
    speed = math.hypot(twist.vx_mps, twist.vy_mps)
    shorten = min(1.0, params.max_speed_mps / speed) if speed > 0.0 else 1.0
    limit = params.max_yaw_rate_radps
    return (
        shorten * twist.vx_mps,
        shorten * twist.vy_mps,
        min(max(twist.vyaw_radps, -limit), limit),
    )


class FlightLaw:
    """Controller for quadcopters of one airframe; it has no state.

    Attributes:
        constants: Mass properties, limits and gravity, as the kernels take them.
        gains: Gains and limits of the law, as the kernels take them.
    """

    def __init__(self, airframe: Airframe, params: FlightParams) -> None:
        limit_mps2 = min(params.max_acceleration_mps2, GRAVITY_MPS2 * math.tan(params.max_tilt_rad))
        ixx, iyy, izz = airframe.inertia_kgm2
        tx, ty, tz = airframe.max_torques_nm
        self.constants = flight_law.BodyConstants(
            mass_kg=float(airframe.mass_kg),
            gravity_mps2=GRAVITY_MPS2,
            max_thrust_n=float(airframe.max_thrust_n),
            inertia_kgm2=(float(ixx), float(iyy), float(izz)),
            max_torques_nm=(float(tx), float(ty), float(tz)),
        )
        self.gains = flight_law.FlightGains(
            velocity_gain_per_s=float(params.velocity_gain_per_s),
            attitude_bandwidth_radps=float(params.attitude_bandwidth_radps),
            altitude_bandwidth_radps=float(params.altitude_bandwidth_radps),
            yaw_rate_gain_per_s=float(params.yaw_rate_gain_per_s),
            max_acceleration_mps2=float(limit_mps2),
            max_yaw_acceleration_radps2=float(params.max_yaw_acceleration_radps2),
        )

    def thrust_and_torque(
        self, state: BodyState, commands: Floats, altitude_m: float
    ) -> Tuple[Floats, Floats]:
        """Compute forces and torques that track commands.

        Args:
            state: State of the quadcopters.
            commands: float64[n, 3], (vx, vy, vyaw) in m/s and rad/s in the bodies' frames, as
                ``limit_command`` returns them.
            altitude_m: Altitude to hold.

        Returns:
            Forces float64[n, 3] in N and torques float64[n, 3] in Nm, in ``map``.
        """
        forces, torques = np.empty_like(commands), np.empty_like(commands)
        flight_law.fly(
            state.rows, commands, altitude_m, self.constants, self.gains, forces, torques
        )
        return forces, torques
