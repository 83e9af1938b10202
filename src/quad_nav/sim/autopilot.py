"""Autopilot between commands and flight controller, with the response of a real one.

A velocity set-point is turned into ``map`` when it arrives and then kept: between two set-points
its direction does not turn with the quadcopter. Velocity follows it with a delay and a first-order
lag, yaw rate with a delay and a second-order lag, see ``flight.AutopilotResponse``.

In front of it is the bridge of vehicles: it sends the command in force again and again, so that the
direction follows the heading of that time, and turns velocities ahead of the heading.

The body stays a body that thrust and torque move. The attitude loop has a lag
``L = 2 / attitude_bandwidth`` of its own. A loop ``a = (u - v) / (T + L)`` around a lag L responds
like a delay L and a time constant T, to first order in ``L / T``. So the autopilot delays the
set-point by what is left of the delay.

The yaw rate r follows ``r' = w^2 e - 2 d w r``, where e is the integral of ``r_commanded - r``: the
heading error, which is why r overshoots.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Deque, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import leading_velocity
from quad_nav.sim.flight import Airframe, AutopilotResponse, BodyState, FlightLaw, FlightParams
from quad_nav.sim.flight_law import rotation_from_quaternion

Floats = NDArray[np.float64]


def flight_params(airframe: Airframe, params: FlightParams) -> FlightParams:
    """Return the flight controller's parameters, with the limits of the airframe's autopilot."""
    response = airframe.response
    if response is None:
        return params
    return replace(params, max_acceleration_mps2=response.max_acceleration_mps2)


class Autopilot:
    """Autopilots of ``n_robots`` quadcopters, whose bodies ``law`` flies in steps of ``step_s``."""

    def __init__(
        self, response: AutopilotResponse, law: FlightLaw, n_robots: int, step_s: float
    ) -> None:
        self._response = response
        self._gains = law.gains
        self._step_s = step_s
        lag_s = 2.0 / law.gains.attitude_bandwidth_radps
        self._time_s = response.velocity_time_s + lag_s
        self._velocity_steps = round(max(0.0, response.velocity_delay_s - lag_s) / step_s)
        self._yaw_steps = round(response.yaw_delay_s / step_s)
        self._repeat_steps = response.repeat_s / step_s
        self._in_force = [(0, np.zeros(3)) for _ in range(n_robots)]  # step of arrival and command
        self._step = -1  # that the tracked commands are for
        self._velocities = [_Delayed((0.0, 0.0)) for _ in range(n_robots)]
        self._yaw_rates = [_Delayed((0.0,)) for _ in range(n_robots)]
        self._heading_errors_rad = [0.0] * n_robots
        self._tracked = np.zeros((n_robots, 3))
        self._rotation = np.empty((3, 3))

    def receive(self, robot: int, command: Floats, state: BodyState, step: int) -> None:
        """Take a set-point float64[3], (vx, vy, vyaw) in the body's frame, before a step."""
        self._in_force[robot] = step, command.copy()
        limit = self._response.max_yaw_rate_radps
        vx, vy, vyaw = command.tolist()
        vyaw = min(max(vyaw, -limit), limit)
        vx, vy = leading_velocity(vx, vy, vyaw, self._response.turn_lead_s)
        rotation_from_quaternion(state.rows[robot, 3:7], self._rotation)
        cos, sin = _heading(self._rotation)
        velocity = (cos * vx - sin * vy, sin * vx + cos * vy)
        self._velocities[robot].append(step + self._velocity_steps, velocity)
        self._yaw_rates[robot].append(step + self._yaw_steps, (vyaw,))

    def commands(self, state: BodyState, step: int) -> Floats:
        """Return the flight controller's commands for a step from the state before it.

        Returns:
            float64[n, 3], (vx, vy, vyaw) in the bodies' frames; valid until the next step. The same
            step again returns the same commands.
        """
        if step != self._step:
            self._step = step
            for robot, row in enumerate(state.rows):
                arrived, command = self._in_force[robot]
                if step - arrived >= self._repeat_steps:
                    self.receive(robot, command, state, step)
                self._track(robot, row)
        return self._tracked

    def _track(self, robot: int, row: Floats) -> None:
        """Fill the command for which the flight law accelerates as this autopilot does.

        The law's acceleration is ``k (w - v) + r z x w`` for a command w, so that w solves a
        linear equation in the plane.
        """
        rotation_from_quaternion(row[3:7], self._rotation)
        (ux, uy), (wanted_radps,) = (
            self._velocities[robot].at(self._step),
            self._yaw_rates[robot].at(self._step),
        )
        vx, vy, turn_x, turn_y, turn_z = row[[7, 8, 10, 11, 12]].tolist()
        gain = self._gains.velocity_gain_per_s
        bx, by = (ux - vx) / self._time_s + gain * vx, (uy - vy) / self._time_s + gain * vy
        square = gain * gain + turn_z * turn_z
        wx, wy = (gain * bx + turn_z * by) / square, (gain * by - turn_z * bx) / square
        cos, sin = _heading(self._rotation)
        up_x, up_y, up_z = self._rotation[:, 2].tolist()
        rate = up_x * turn_x + up_y * turn_y + up_z * turn_z
        response = self._response
        frequency, error = response.yaw_frequency_radps, self._heading_errors_rad[robot]
        yaw_acceleration = frequency * (frequency * error - 2.0 * response.yaw_damping * rate)
        self._heading_errors_rad[robot] = error + self._step_s * (wanted_radps - rate)
        self._tracked[robot] = (
            cos * wx + sin * wy,
            cos * wy - sin * wx,
            rate + yaw_acceleration / self._gains.yaw_rate_gain_per_s,
        )


class _Delayed:
    """A value that takes effect at a later step."""

    def __init__(self, value: Tuple[float, ...]) -> None:
        self._value = value
        self._pending: Deque[Tuple[int, Tuple[float, ...]]] = deque()

    def append(self, step: int, value: Tuple[float, ...]) -> None:
        self._pending.append((step, value))

    def at(self, step: int) -> Tuple[float, ...]:
        while self._pending and self._pending[0][0] <= step:
            self._value = self._pending.popleft()[1]
        return self._value


def _heading(rotation: Floats) -> Tuple[float, float]:
    """Return cosine and sine of the heading of a body with this rotation matrix."""
    x, y = float(rotation[0, 0]), float(rotation[1, 0])
    length = math.hypot(x, y)
    return x / length, y / length
