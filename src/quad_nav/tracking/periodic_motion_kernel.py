"""Replays of motions whose period is known, and which tracks they stand for.

``tracking/periodic_motion.py`` has the reasoning. Samples are rows of float64[n, 5]: time in s,
position in m and velocity in m/s in one fixed frame, in the order of their times. Each belongs to a
trail, an uninterrupted piece of a track.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

NONE = -1
_MAX_GAP_S = 1.0  # between two samples of a trail


class Trails(NamedTuple):
    """Trails of samples.

    Attributes:
        samples: float64[n, 5].
        later: int64[n], index of the next sample of the same trail, or NONE.
        owners: int64[n], trail of each sample.
        spans: int64[m, 2], first and last sample of each trail; NONE for a forgotten trail.
        periods: float64[m], period of each trail in s, 0 if it is not known.
        nexts: int64[m], trail that the obstacle of each trail was seen on next, after a gap, or
            NONE.
        gaps: float64[m], time from the end of a trail to the begin of its next one, s.
    """

    samples: NDArray[np.float64]
    later: NDArray[np.int64]
    owners: NDArray[np.int64]
    spans: NDArray[np.int64]
    periods: NDArray[np.float64]
    nexts: NDArray[np.int64]
    gaps: NDArray[np.float64]


@njit(cache=True, nogil=True)
def replay_all(
    trails: Trails,
    times: NDArray[np.float64],
    beyond_s: float,
    places: NDArray[np.float64],
    velocities: NDArray[np.float64],
    owners: NDArray[np.int64],
) -> int:
    """Fill where the trails whose period is known are at some times, the latest trail first.

    Args:
        trails: The trails.
        times: float64[t], increasing.
        beyond_s: Time before the first and after the last sample of a trail for which it is known:
            the velocity stays.
        places: float64[t, c, 2], filled; NaN where a trail is not known.
        velocities: float64[t, c, 2], filled likewise.
        owners: int64[c], filled with the trail of each column.

    Returns:
        Number of columns, at most c.
    """
    count, first, last = 0, times[0], times[-1]
    for trail in range(trails.spans.shape[0] - 1, -1, -1):
        period, begin, end = trails.periods[trail], trails.spans[trail, 0], trails.spans[trail, 1]
        if period <= 0.0 or begin == NONE:
            continue
        start = trails.samples[begin, 0] - beyond_s
        stop = trails.samples[end, 0] + max(beyond_s, trails.gaps[trail])
        turn = max(1, math.ceil((first - stop) / period))
        while start + turn * period <= last and count < owners.shape[0]:
            places[:, count], velocities[:, count] = math.nan, math.nan
            _replay(trails, trail, times, turn * period, beyond_s, places, velocities, count)
            owners[count] = trail
            count += 1
            turn += 1
    return count


@njit(cache=True, nogil=True)
def _replay(
    trails: Trails,
    trail: int,
    times: NDArray[np.float64],
    shift: float,
    beyond_s: float,
    places: NDArray[np.float64],
    velocities: NDArray[np.float64],
    column: int,
) -> None:
    """Fill one column: a trail, later by ``shift``, and the gap to its next one."""
    samples, later, gap = trails.samples, trails.later, trails.gaps[trail]
    at, end = trails.spans[trail, 0], trails.spans[trail, 1]
    for k in range(times.shape[0]):
        time = times[k] - shift
        while at != end and samples[later[at], 0] <= time:
            at = later[at]
        ahead = time - samples[at, 0]
        if at == end and 0.0 <= ahead < gap:
            following = samples[trails.spans[trails.nexts[trail], 0]]
            _between(samples[at], following, ahead / gap, gap, places, velocities, k, column)
        elif at == end or ahead < 0.0:
            if abs(ahead) <= beyond_s:
                velocities[k, column] = samples[at, 3:]
                places[k, column] = samples[at, 1:3] + ahead * samples[at, 3:]
        else:
            step = samples[later[at], 0] - samples[at, 0]
            if step <= _MAX_GAP_S:
                following = samples[later[at]]
                _between(samples[at], following, ahead / step, step, places, velocities, k, column)


@njit(cache=True, nogil=True)
def _between(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    u: float,
    step: float,
    places: NDArray[np.float64],
    velocities: NDArray[np.float64],
    k: int,
    column: int,
) -> None:
    """Fill in the cubic from sample a (u = 0) to sample b (u = 1), ``step`` seconds later."""
    ahead = u * u * (3.0 - 2.0 * u)
    for axis in range(2):
        place = (1.0 - ahead) * a[1 + axis] + ahead * b[1 + axis]
        place += u * (1.0 - u) * step * ((1.0 - u) * a[3 + axis] - u * b[3 + axis])
        places[k, column, axis] = place
        velocities[k, column, axis] = (1.0 - u) * a[3 + axis] + u * b[3 + axis]


@njit(cache=True, nogil=True)
def drop_repeats(places: NDArray[np.float64], radii: NDArray[np.float64], apart_m: float) -> None:
    """Set places to NaN that repeat those of an earlier column at the same time.

    Obstacles that pass each other look like one that is larger: of the radii of the columns, the
    least counts.

    Args:
        places: float64[t, c, 2], changed in place.
        radii: float64[c], changed in place.
        apart_m: Places that are nearer than this are the same obstacle.
    """
    for k in range(places.shape[0]):
        for column in range(places.shape[1]):
            if math.isnan(places[k, column, 0]):
                continue
            for other in range(column):
                dx = places[k, column, 0] - places[k, other, 0]
                dy = places[k, column, 1] - places[k, other, 1]
                if dx * dx + dy * dy < apart_m * apart_m:
                    places[k, column] = math.nan
                    radii[other] = min(radii[other], radii[column])
                    break


@njit(cache=True, nogil=True)
def follow_replays(
    discs: NDArray[np.float64],
    motions: NDArray[np.float64],
    places: NDArray[np.float64],
    velocities: NDArray[np.float64],
    times: NDArray[np.float64],
    same: Tuple[float, float, float],
    nowhere: float,
) -> None:
    """Leave the discs of tracks that have a replay to it; after its end they keep its velocity.

    Where the replay ends and another is alike, the other continues it. A disc is nowhere while a
    replay is known, and where another replay has its place.

    Args:
        discs: float64[t, n, 4], changed in place: x, y, radius, standard deviation.
        motions: float64[n, 2], velocities of the tracks.
        places: float64[t, m, 2] of the replays, NaN where one is not known.
        velocities: float64[t, m, 2].
        times: float64[t].
        same: Differences of place and velocity between a track and its replay that count as 1, and
            the distance to a replay within which a disc is of the same obstacle.
        nowhere: Coordinates of a disc that is nowhere.
    """
    state = np.empty(4)
    for n in range(discs.shape[1]):
        state[:2], state[2:] = discs[0, n, :2], motions[n]
        column, since, follows = NONE, 0.0, False
        for k in range(times.shape[0]):
            if column == NONE or math.isnan(places[k, column, 0]):
                column = _replay_of(state, times[k] - since, places[k], velocities[k], same)
                if column == NONE and follows:
                    column = _begun(state, times[k] - since, places[k - 1], places[k], same[2])
            if column != NONE:
                state[:2], state[2:] = places[k, column], velocities[k, column]
                since, follows = times[k], True
                discs[k, n, :2] = nowhere
            elif not follows:
                break
            else:
                discs[k, n, :2] = state[:2] + (times[k] - since) * state[2:]
                if _is_near(discs[k, n, 0], discs[k, n, 1], places[k], same[2]):
                    discs[k, n, :2] = nowhere


@njit(cache=True, nogil=True)
def forget_after(
    discs: NDArray[np.float64], times: NDArray[np.float64], longest: float, nowhere: float
) -> None:
    """Let discs be nowhere that have no replay for a time.

    Args:
        discs: float64[t, n, 4], as ``follow_replays`` leaves them, changed in place.
        times: float64[t], from 0 on.
        longest: The time, from now on or since a disc was nowhere.
        nowhere: Coordinates of a disc that is nowhere.
    """
    for n in range(discs.shape[1]):
        since = 0.0
        for k in range(times.shape[0]):
            if discs[k, n, 0] == nowhere:
                since = times[k]
            elif times[k] - since > longest:
                discs[k:, n, :2] = nowhere
                break


@njit(cache=True, nogil=True)
def _replay_of(
    state: NDArray[np.float64],
    ahead: float,
    places: NDArray[np.float64],
    velocities: NDArray[np.float64],
    same: Tuple[float, float, float],
) -> int:
    """Return the replay that is most alike after a time, NONE if none is.

    Args:
        state: float64[4], position and velocity of an obstacle.
        ahead: Time for which it goes on.
        places: float64[m, 2].
        velocities: float64[m, 2].
        same: As for ``follow_replays``.
    """
    best, least = NONE, 1.0
    for column in range(places.shape[0]):
        dx = places[column, 0] - state[0] - ahead * state[2]
        dy = places[column, 1] - state[1] - ahead * state[3]
        du, dv = velocities[column, 0] - state[2], velocities[column, 1] - state[3]
        apart = (dx * dx + dy * dy) / same[0] ** 2 + (du * du + dv * dv) / same[1] ** 2
        if apart < least:
            best, least = column, apart
    return best


@njit(cache=True, nogil=True)
def _begun(
    state: NDArray[np.float64],
    ahead: float,
    before: NDArray[np.float64],
    places: NDArray[np.float64],
    apart: float,
) -> int:
    """Return a replay that begins near an obstacle, whatever its velocity, NONE if none does.

    Args:
        state: float64[4], position and velocity of the obstacle.
        ahead: Time for which it goes on.
        before: float64[m, 2], places at the time before.
        places: float64[m, 2], places now.
        apart: Greatest distance.
    """
    x, y = state[0] + ahead * state[2], state[1] + ahead * state[3]
    best, least = NONE, apart
    for column in range(places.shape[0]):
        distance = math.hypot(places[column, 0] - x, places[column, 1] - y)
        if distance < least and math.isnan(before[column, 0]):
            best, least = column, distance
    return best


@njit(cache=True, nogil=True)
def _is_near(x: float, y: float, places: NDArray[np.float64], apart: float) -> bool:
    """Return whether one of float64[m, 2] is near a point."""
    for column in range(places.shape[0]):
        dx, dy = places[column, 0] - x, places[column, 1] - y
        if dx * dx + dy * dy < apart * apart:
            return True
    return False
