"""Links between trails of the same obstacle, where something hid it or its track broke.

``tracking/periodic_motion.py`` has the reasoning, ``periodic_motion.py`` the trails.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.tracking.periodic_motion_kernel import NONE, Trails


@njit(cache=True, nogil=True)
def link(trails: Trails, same_s: float, longest_s: float, limits: Tuple[float, float]) -> None:
    """Fill ``nexts`` and ``gaps`` of trails with a period.

    The next trail has the same period and begins, some periods earlier or later, soon after the
    end. Where another trail of the same period goes on at the end there is no gap.

    Args:
        trails: The trails; ``nexts`` and ``gaps`` are changed in place.
        same_s: Difference of periods that are the same.
        longest_s: Longest gap.
        limits: Distance in m by which another trail may be off at the end, and part of the faster
            end's speed that is the greatest mean speed in the gap.
    """
    samples, spans, periods = trails.samples, trails.spans, trails.periods
    for a in range(spans.shape[0]):
        trails.nexts[a], trails.gaps[a] = NONE, 0.0
        if periods[a] <= 0.0 or spans[a, 0] == NONE:
            continue
        least, end = longest_s, samples[spans[a, 1]]
        for b in range(spans.shape[0]):
            if b == a or abs(periods[b] - periods[a]) > same_s or spans[b, 0] == NONE:
                continue
            begin, last = samples[spans[b, 0]], samples[spans[b, 1]]
            gap = (begin[0] - end[0]) % periods[a]
            before = periods[a] - gap  # by which b begins before the end of a
            if before < last[0] - begin[0] and _goes_on(trails, b, begin[0] + before, end, limits):
                trails.nexts[a], trails.gaps[a] = NONE, 0.0
                break
            if gap < least and _leads_to(end, begin, gap, limits):
                least = gap
                trails.nexts[a], trails.gaps[a] = b, gap


@njit(cache=True, nogil=True)
def _goes_on(
    trails: Trails,
    trail: int,
    time: float,
    end: NDArray[np.float64],
    limits: Tuple[float, float],
) -> bool:
    """Return whether a trail is at a time where another ends."""
    at = trails.spans[trail, 0]
    while trails.later[at] != NONE and trails.samples[at, 0] < time:
        at = trails.later[at]
    ahead = time - trails.samples[at, 0]
    dx = trails.samples[at, 1] + ahead * trails.samples[at, 3] - end[1]
    dy = trails.samples[at, 2] + ahead * trails.samples[at, 4] - end[2]
    return math.hypot(dx, dy) < limits[0]


@njit(cache=True, nogil=True)
def _leads_to(
    end: NDArray[np.float64], begin: NDArray[np.float64], gap: float, limits: Tuple[float, float]
) -> bool:
    """Return whether an obstacle can get from one sample to another in a time."""
    fast = max(math.hypot(end[3], end[4]), math.hypot(begin[3], begin[4]))
    way = math.hypot(begin[1] - end[1], begin[2] - end[2])
    return way < limits[0] + limits[1] * fast * gap


@njit(cache=True, nogil=True)
def continued_trails(
    trails: Trails,
    chosen: NDArray[np.int64],
    others: NDArray[np.int64],
    longest_s: float,
    limits: Tuple[float, float],
) -> NDArray[np.int64]:
    """Return the other trail that each chosen one continues, or that continues it; NONE for none.

    Args:
        trails: The trails.
        chosen: int64[n], trails.
        others: int64[k], trails.
        longest_s: Longest gap.
        limits: By how much the later trail may be off the motion of the earlier one, in m, and the
            growth of that with the gap, in m/s.

    Returns:
        int64[n], the nearest one in parts of what it may be off.
    """
    samples, found = trails.samples, np.full(len(chosen), NONE)
    begins, ends = trails.spans[others, 0], trails.spans[others, 1]
    begins_s, ends_s = samples[begins, 0], samples[ends, 0]
    for n in range(len(chosen)):
        begin, end = trails.spans[chosen[n], 0], trails.spans[chosen[n], 1]
        begin_s, end_s, least = samples[begin, 0], samples[end, 0], 1.0
        for k in range(len(others)):
            off = math.inf
            if 0.0 < begin_s - ends_s[k] < longest_s:
                off = _off_motion(samples[ends[k]], samples[begin], limits)
            elif 0.0 < begins_s[k] - end_s < longest_s:
                off = _off_motion(samples[end], samples[begins[k]], limits)
            if off < least:
                found[n], least = others[k], off
    return found


@njit(cache=True, nogil=True)
def _off_motion(
    a: NDArray[np.float64], b: NDArray[np.float64], limits: Tuple[float, float]
) -> float:
    """Return by how much sample b is off the motion of sample a, in parts of what it may be.

    The velocity is expected to change evenly.
    """
    gap_s = b[0] - a[0]
    off_x = b[1] - a[1] - gap_s * (0.5 * (a[3] + b[3]))
    off_y = b[2] - a[2] - gap_s * (0.5 * (a[4] + b[4]))
    return math.hypot(off_x, off_y) / (limits[0] + limits[1] * gap_s)
