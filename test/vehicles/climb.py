"""Vertical flight of the stand-in for ArduCopter, as recorded."""

from __future__ import annotations

import math
from collections import deque

from quad_nav.sim.simulation_params import STEP_S

DELAY_S, FREQUENCY_RADPS, DAMPING = 0.087, 4.8, 0.62
_TAKE_OFF_MPS2, _PEAK_M, _SETTLE_M, _SETTLE_S = 0.7, 0.034, 0.043, 0.45
_SLOW_S, _SLOW_MPS2, _FAST_MPS2, _MOST_MPS = 0.6, 0.6, 3.0, 1.25
_MOST_MPS2, _STOP_S = 1.15, 0.15
_POSITION_GAIN, _VELOCITY_GAIN = 36.0, 12.0


class ClimbLaw:
    """Vertical velocity and acceleration, up.

    ``set_velocity`` responds with a delay and a second-order lag. A take-off lifts slowly, then
    fast, and slows down as ``sqrt(2 a rest)``. It passes the altitude by a little, and settles
    below it. ``ramp`` changes the velocity at a constant rate.

    Attributes:
        target_m: Altitude of the take-off.
        velocity_mps: Wanted vertical velocity.
        has_arrived: Whether the take-off has ended.
    """

    def __init__(self, estimator):
        self._estimator = estimator
        self.target_m, self.velocity_mps, self.has_arrived = 0.0, 0.0, False
        self._slope = 0.0
        self._goal, self._wanted = 0.0, deque()  # (due in, velocity)
        self._ramp = None
        self._height_m, self._since_s, self._is_taking_off = 0.0, 0.0, False

    def take_off(self):
        """Begin to lift."""
        self._begin()
        self.velocity_mps = self._slope = 0.0
        self._is_taking_off, self._since_s, self.has_arrived = True, 0.0, False
        self._height_m = self._estimator.height_m

    def stop(self):
        """Come to a stop."""
        self._begin()
        if self.velocity_mps:
            self._goal = self.velocity_mps
            self._wanted.append([_STOP_S, 0.0])

    def _begin(self):
        self._is_taking_off, self._ramp, self._goal = False, None, 0.0
        self._wanted.clear()

    def set_velocity(self, up_mps, delay_s=DELAY_S):
        """Respond to a set-point."""
        if up_mps != 0.0:
            self._is_taking_off = False
        self._ramp = None
        last = self._wanted[-1][1] if self._wanted else self._goal
        if up_mps != last:
            self._wanted.append([delay_s, up_mps])

    def ramp(self, up_mps, rate_mps2):
        """Change the velocity to a value at a constant rate."""
        self._ramp = (up_mps, rate_mps2)

    def acceleration_mps2(self, rate_mps):
        """Return the vertical acceleration for a step, at the present vertical velocity."""
        if self._is_taking_off:
            self._rise()
        elif self._ramp is not None:
            goal, rate = self._ramp
            step = rate * STEP_S
            change = min(max(goal - self.velocity_mps, -step), step)
            self.velocity_mps, self._slope = self.velocity_mps + change, change / STEP_S
        else:
            self._respond()
        self._height_m += self.velocity_mps * STEP_S
        error_m = self._height_m - self._estimator.height_m
        error_m = min(max(error_m, -0.3), 0.3)
        self._height_m = self._estimator.height_m + error_m
        return (
            self._slope + _VELOCITY_GAIN * (self.velocity_mps - rate_mps) + _POSITION_GAIN * error_m
        )

    def _respond(self):
        for one in self._wanted:
            one[0] -= STEP_S
        while self._wanted and self._wanted[0][0] <= 0.0:
            self._goal = self._wanted.popleft()[1]
        error = self._goal - self.velocity_mps
        pull = FREQUENCY_RADPS**2 * error - 2.0 * DAMPING * FREQUENCY_RADPS * self._slope
        self._slope += pull * STEP_S
        self._slope = min(max(self._slope, -_MOST_MPS2), _MOST_MPS2)
        self.velocity_mps += self._slope * STEP_S

    def _rise(self):
        self._since_s += STEP_S
        before = self.velocity_mps
        if not self.has_arrived:
            rest_m = max(self.target_m + _PEAK_M - self._height_m, 0.0)
            if self._since_s < _SLOW_S:
                up = _SLOW_MPS2 * self._since_s
            else:
                up = _SLOW_MPS2 * _SLOW_S + _FAST_MPS2 * (self._since_s - _SLOW_S)
            self.velocity_mps = min(up, _MOST_MPS, math.sqrt(2.0 * _TAKE_OFF_MPS2 * rest_m))
            self.has_arrived = self.velocity_mps < 0.1 and self._since_s > _SLOW_S
        else:
            rest_m = self.target_m - _SETTLE_M - self._height_m
            wanted = rest_m / _SETTLE_S
            self.velocity_mps += (wanted - self.velocity_mps) * min(1.0, STEP_S / 0.2)
        self._slope = (self.velocity_mps - before) / STEP_S
