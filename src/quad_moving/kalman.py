"""Kalman filters with constant velocity, one for each track.

State: x and y, m, and their velocities, m/s. Accelerations are white and constant between two
steps; while the innovations of a track are larger than expected, its accelerations are taken to be
larger. Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking
and Navigation", 2001, sections 6.3.2 (discrete white noise acceleration), 5.4 (consistency) and
11.2.2 (adjustment of the level of the process noise).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from quad_moving.kalman_kernel import predict_states, update_state

Floats = NDArray[np.float64]

FIRST_SPEED_MPS = 1.0
"""Standard deviation of each component of a velocity before it is known: a walk."""
_MEMORY = 0.7  # weight of the innovations before, in the mean: of the last three scans
_LARGE, _EXPECTED = 4.6, 2.0  # of a chi-square with 2 degrees of freedom: 10 %, mean
_UP, _DOWN, _HIGHEST = 1.5, 0.85, 5.0  # who turns back in 0.3 s needs 5 times 1.5 m/s^2


class Filters:
    """Filters of several tracks.

    Attributes:
        time_s: Time of the states.
        states: float64[m, 4].
        covariances: float64[m, 4, 4].
    """

    def __init__(self) -> None:
        """Start without tracks."""
        self.time_s = self._newest_s = -math.inf
        self.states, self.covariances = np.empty((0, 4)), np.empty((0, 4, 4))
        self._levels, self._innovations = np.empty(0), np.empty(0)

    def __len__(self) -> int:
        return len(self.states)

    def add(self, position: Floats, noise: Floats, speed_mps: float = FIRST_SPEED_MPS) -> None:
        """Begin a filter with one measurement.

        Args:
            position: float64[2], metres.
            noise: float64[2, 2], covariance of the position.
            speed_mps: Standard deviation of each component of the velocity.
        """
        covariance = np.zeros((1, 4, 4))
        covariance[0, :2, :2] = noise
        covariance[0, 2, 2] = covariance[0, 3, 3] = speed_mps**2
        self.states = np.concatenate([self.states, [[position[0], position[1], 0.0, 0.0]]])
        self.covariances = np.concatenate([self.covariances, covariance])
        self._levels = np.append(self._levels, 1.0)
        self._innovations = np.append(self._innovations, _EXPECTED)

    def keep(self, kept: NDArray[np.bool_]) -> None:
        """Keep some of the filters, bool[m]."""
        self.states, self.covariances = self.states[kept], self.covariances[kept]
        self._levels, self._innovations = self._levels[kept], self._innovations[kept]

    def predict(self, time_s: float, acceleration_mps2: float) -> None:
        """Predict all states to a time.

        A time before the newest one is that of a measurement which comes late: the states go back
        with their velocities. Accelerations count once, from the newest time on.

        Args:
            time_s: The time.
            acceleration_mps2: Standard deviation of each component of the usual acceleration.
        """
        before_s, newest_s = self.time_s, self._newest_s
        self.time_s, self._newest_s = time_s, max(time_s, newest_s)
        if not len(self):
            return
        known_s = min(time_s, newest_s)
        if known_s != before_s:
            predict_states(self.states, self.covariances, known_s - before_s, 0.0 * self._levels)
        if time_s > newest_s:
            accelerations = acceleration_mps2 * self._levels
            predict_states(self.states, self.covariances, time_s - newest_s, accelerations)

    def update(self, track: int, position: Floats, noise: Floats) -> float:
        """Take a measurement into one state.

        Args:
            track: Row of the state.
            position: float64[2], metres.
            noise: float64[2, 2], covariance of the position.

        Returns:
            The normalised innovation squared: chi-square with two degrees of freedom if the filter
            is consistent.
        """
        nis = float(update_state(self.states[track], self.covariances[track], position, noise))
        mean = self._innovations[track] = _MEMORY * self._innovations[track] + (
            1.0 - _MEMORY
        ) * min(nis, 4.0 * _LARGE)
        factor = _UP if mean > _LARGE else _DOWN
        self._levels[track] = min(max(factor * self._levels[track], 1.0), _HIGHEST)
        return nis
