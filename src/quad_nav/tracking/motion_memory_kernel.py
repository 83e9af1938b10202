"""Recall of motion: the moment in the past at which an obstacle moved as another does now.

``tracking/motion_memory.py`` has the reasoning. Samples are rows of float64[n, 5]: time in s,
position in m and velocity in m/s in one fixed frame, in the order of their times.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

NONE = -1
_STILL_S = 0.15  # after the last sample of a track, for which it still counts as known


@njit(cache=True, nogil=True)
def recall(
    samples: NDArray[np.float64],
    earlier: NDArray[np.int64],
    now: int,
    scales: Tuple[float, float],
    before_s: float,
) -> int:
    """Return the sample in the past that is most alike in place and velocity, now and before.

    Args:
        samples: float64[n, 5].
        earlier: int64[n], index of the sample of the same track a moment before, or NONE.
        now: Index of the sample to compare with.
        scales: Differences in place and in velocity that count as 1.
        before_s: Samples of less than this before are no candidates.

    Returns:
        Index of the sample, NONE if none is alike.
    """
    best, least = NONE, 2.0
    if earlier[now] == NONE:
        return NONE
    for k in range(samples.shape[0]):
        if samples[k, 0] > samples[now, 0] - before_s:
            break
        if earlier[k] == NONE:
            continue
        apart = _difference(samples, k, now, scales)
        if apart < least:
            apart += _difference(samples, earlier[k], earlier[now], scales)
            if apart < least:
                best, least = k, apart
    return best


@njit(cache=True, nogil=True)
def _difference(samples: NDArray[np.float64], a: int, b: int, scales: Tuple[float, float]) -> float:
    """Return the squared difference of two samples, in scales."""
    dx, dy = samples[a, 1] - samples[b, 1], samples[a, 2] - samples[b, 2]
    du, dv = samples[a, 3] - samples[b, 3], samples[a, 4] - samples[b, 4]
    return (dx * dx + dy * dy) / scales[0] ** 2 + (du * du + dv * dv) / scales[1] ** 2


@njit(cache=True, nogil=True)
def replay(
    samples: NDArray[np.float64],
    later: NDArray[np.int64],
    start: int,
    times: NDArray[np.float64],
    places: NDArray[np.float64],
) -> int:
    """Fill where the obstacle of a sample was at some times.

    Between two samples it is on the cubic with their places and velocities (Hermite).

    Args:
        samples: float64[n, 5].
        later: int64[n], index of the next sample of the same track, or NONE.
        start: Index of the sample.
        times: float64[t], times from that of the sample on, increasing.
        places: float64[t, 2], filled with the places; after the end of the track the obstacle keeps
            its velocity.

    Returns:
        Number of times up to the end of the track.
    """
    at, known = start, 0
    for k in range(times.shape[0]):
        while later[at] != NONE and samples[later[at], 0] <= times[k]:
            at = later[at]
        beyond = times[k] - samples[at, 0]
        if later[at] == NONE:
            for axis in range(2):
                places[k, axis] = samples[at, 1 + axis] + beyond * samples[at, 3 + axis]
            if beyond <= _STILL_S:
                known = k + 1
            continue
        known = k + 1
        _between(samples[at], samples[later[at]], beyond, places[k])
    return known


@njit(cache=True, nogil=True)
def _between(
    a: NDArray[np.float64], b: NDArray[np.float64], beyond: float, place: NDArray[np.float64]
) -> None:
    """Fill float64[2], the place some time after sample a on the way to sample b."""
    step = b[0] - a[0]
    u = beyond / step
    ahead = u * u * (3.0 - 2.0 * u)
    for axis in range(2):
        place[axis] = (1.0 - ahead) * a[1 + axis] + ahead * b[1 + axis]
        place[axis] += u * (1.0 - u) * step * ((1.0 - u) * a[3 + axis] - u * b[3 + axis])
