"""Kalman filters with constant velocity: states x, y, and their velocities.

``kalman`` has the reasoning. Written out, because numpy's solvers start threads for four numbers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit


@njit(cache=True, nogil=True)
def predict_states(
    states: NDArray[np.float64],
    covariances: NDArray[np.float64],
    step: float,
    accelerations: NDArray[np.float64],
) -> None:
    """Predict states in place.

    Args:
        states: float64[m, 4], metres and metres per second.
        covariances: float64[m, 4, 4] of the states.
        step: Step of time, seconds.
        accelerations: float64[m], standard deviation of each component, m/s^2.
    """
    half = 0.5 * step * step
    for m in range(states.shape[0]):
        state, spread = states[m], covariances[m]
        for axis in range(2):
            state[axis] += step * state[axis + 2]
        for row in range(2):  # F P
            for column in range(4):
                spread[row, column] += step * spread[row + 2, column]
        for column in range(2):  # (F P) F^T
            for row in range(4):
                spread[row, column] += step * spread[row, column + 2]
        power = accelerations[m] * accelerations[m]
        for axis in range(2):
            spread[axis, axis] += power * half * half
            spread[axis, axis + 2] += power * half * step
            spread[axis + 2, axis] += power * half * step
            spread[axis + 2, axis + 2] += power * step * step


@njit(cache=True, nogil=True)
def update_state(
    state: NDArray[np.float64],
    covariance: NDArray[np.float64],
    position: NDArray[np.float64],
    noise: NDArray[np.float64],
) -> float:
    """Take a measured position into a state, in place and in Joseph's form.

    Args:
        state: float64[4], metres and metres per second.
        covariance: float64[4, 4] of the state.
        position: float64[2], metres.
        noise: float64[2, 2], covariance of the position.

    Returns:
        The normalised innovation squared.
    """
    xx, yy = covariance[0, 0] + noise[0, 0], covariance[1, 1] + noise[1, 1]
    xy = covariance[0, 1] + noise[0, 1]
    det = xx * yy - xy * xy
    dx, dy = position[0] - state[0], position[1] - state[1]
    gain, keep = np.empty((4, 2)), np.eye(4)
    for row in range(4):
        px, py = covariance[row, 0], covariance[row, 1]
        gain[row, 0] = (yy * px - xy * py) / det
        gain[row, 1] = (xx * py - xy * px) / det
        keep[row, 0] -= gain[row, 0]
        keep[row, 1] -= gain[row, 1]
    kept, after = np.zeros((4, 4)), np.zeros((4, 4))
    for row in range(4):
        for column in range(4):
            for k in range(4):
                kept[row, column] += keep[row, k] * covariance[k, column]
    for row in range(4):
        for column in range(4):
            for k in range(4):
                after[row, column] += kept[row, k] * keep[column, k]
            for k in range(2):
                for other in range(2):
                    after[row, column] += gain[row, k] * noise[k, other] * gain[column, other]
    for row in range(4):
        state[row] += gain[row, 0] * dx + gain[row, 1] * dy
        for column in range(4):
            covariance[row, column] = 0.5 * (after[row, column] + after[column, row])
    return (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / det
