"""Kalman filters with constant velocity, one for each track, as arrays.

State: x and y, m, and their velocities, m/s. Accelerations are white and constant between two
steps. Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking
and Navigation", 2001, section 6.3.2 (discrete white noise acceleration) and 5.4 (consistency).
"""

from __future__ import annotations

from typing import Tuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def first_state(position: Floats, noise: Floats, speed_mps: float) -> Tuple[Floats, Floats]:
    """Return state float64[4] and covariance float64[4, 4] after one measurement.

    Args:
        position: float64[2], metres.
        noise: float64[2, 2], covariance of the position.
        speed_mps: Standard deviation of each component of the velocity.
    """
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = noise
    covariance[2, 2] = covariance[3, 3] = speed_mps**2
    return np.array([position[0], position[1], 0.0, 0.0]), covariance


def predict(
    states: Floats, covariances: Floats, step_s: float, acceleration_mps2: float
) -> Tuple[Floats, Floats]:
    """Return states float64[m, 4] and covariances float64[m, 4, 4] after a step of time.

    Args:
        states: float64[m, 4].
        covariances: float64[m, 4, 4].
        step_s: The step.
        acceleration_mps2: Standard deviation of each component of the acceleration.
    """
    step = np.eye(4)
    step[0, 2] = step[1, 3] = step_s
    half = 0.5 * step_s * step_s
    noise = np.zeros((4, 4))
    noise[0, 0] = noise[1, 1] = half * half
    noise[0, 2] = noise[2, 0] = noise[1, 3] = noise[3, 1] = half * step_s
    noise[2, 2] = noise[3, 3] = step_s * step_s
    return states @ step.T, step @ covariances @ step.T + acceleration_mps2**2 * noise


def update(
    state: Floats, covariance: Floats, position: Floats, noise: Floats
) -> Tuple[Floats, Floats, float]:
    """Take a measurement of a position into one state, in Joseph's form.

    Args:
        state: float64[4].
        covariance: float64[4, 4].
        position: float64[2], metres.
        noise: float64[2, 2], covariance of the position.

    Returns:
        State, covariance, and the normalised innovation squared: chi-square with two degrees of
        freedom if the filter is consistent.
    """
    spread = covariance[:2, :2] + noise
    off = position - state[:2]
    gain = np.linalg.solve(spread, covariance[:2]).T
    nis = float(off @ np.linalg.solve(spread, off))
    keep = np.eye(4)
    keep[:, :2] -= gain
    after = keep @ covariance @ keep.T + gain @ noise @ gain.T
    return state + gain @ off, 0.5 * (after + after.T), nis
