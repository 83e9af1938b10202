"""Recall of motion: the moment in the past at which an obstacle moved as another does now.

``tracking/motion_memory.py`` has the reasoning. Samples are rows of float64[n, 5]: time in s,
position in m and velocity in m/s in one fixed frame, in the order of their times.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.kernels.jit import njit

NONE = -1


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
        earlier: int64[n], index of the sample of the same track half a second before, or NONE.
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
    """Fill where the obstacle of a sample went afterwards.

    Args:
        samples: float64[n, 5].
        later: int64[n], index of the next sample of the same track, or NONE.
        start: Index of the sample.
        times: float64[t], times after the sample, increasing from 0.
        places: float64[t, 2], filled with positions relative to that of the sample; after the
            end of the track the obstacle keeps its velocity.

    Returns:
        Number of times up to the end of the track.
    """
    at, known = start, 0
    for k in range(times.shape[0]):
        time = samples[start, 0] + times[k]
        while later[at] != NONE and samples[later[at], 0] <= time:
            at = later[at]
        beyond = time - samples[at, 0]
        places[k, 0] = samples[at, 1] + beyond * samples[at, 3] - samples[start, 1]
        places[k, 1] = samples[at, 2] + beyond * samples[at, 4] - samples[start, 2]
        if later[at] != NONE or beyond <= 0.15:
            known = k + 1
    return known
