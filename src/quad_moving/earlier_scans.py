"""Points of a scan against earlier scans, and the clusters that they make.

``moving_points`` has the reasoning.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

UNKNOWN, OCCUPIED, FREED = 0, 1, 2
"""Evidence about a point: unseen or in doubt, occupied earlier, free space earlier."""
ENOUGH = 3
"""Beams of an obstacle, scans or detections that are no coincidence: of M of N detections, the M
(S. Blackman, R. Popoli, 1999, section 6.2)."""
_MAX_SIDE_BEAMS = 64  # to each side of a point: nearer than 0.15 m the margin would be all around
_ASK = 3  # a code beside the three above: until the earlier scans are asked about a point


class ScanView(NamedTuple):
    """A scan and the pose of its sensor in the fixed frame."""

    ranges: NDArray[np.float32]  # [n], metres; +inf without a return
    directions: NDArray[np.float64]  # [n, 2], cosine and sine of each beam
    angle_min: float  # radians
    increment: float  # radians, not 0
    is_full_turn: bool  # beam 0 follows beam n - 1
    origin: NDArray[np.float64]  # [3], metres
    rotation: NDArray[np.float64]  # [3, 3], frame from sensor


class _Beams(NamedTuple):
    """Angles of a scan's beams, as in `ScanView`.

    Without its arrays: handing them to a kernel for each point takes longer than comparing it.
    """

    angle_min: float
    increment: float
    is_full_turn: bool


class EarlierScans(NamedTuple):
    """Scans with the same beams, in slots."""

    ranges: NDArray[np.float32]  # [slots, n], metres
    origins: NDArray[np.float64]  # [slots, 3], metres in the fixed frame
    rotations: NDArray[np.float64]  # [slots, 3, 3], frame from sensor


class Order(NamedTuple):
    """In which order earlier scans are asked: the recent ones first, the oldest of each first."""

    slots: NDArray[np.int64]  # [k]
    recent: int  # number of recent ones


class Doubts(NamedTuple):
    """Limits of what a scan can tell."""

    range_min: float  # metres; shorter ranges are no points
    range_max: float  # metres; farther points are left out
    low_z: float  # metres in the fixed frame; lower points are left out
    high_z: float  # metres; higher points are left out
    level: float  # metres off a sensor's plane; points farther off are in doubt
    upright: float  # metres off the scan's plane; points farther off are left out
    margin: float  # metres by which a point is inside of free space, in depth and to the sides


@njit(cache=True, nogil=True)
def bearing(y: float, x: float) -> float:
    """Return atan2(y, x) to 1e-5 rad, a thousandth of a beam, in a third of its time.

    Source: M. Abramowitz, I. A. Stegun, "Handbook of Mathematical Functions", 1964, 4.4.49.
    """
    along, across = abs(x), abs(y)
    ratio = min(along, across) / max(along, across, 1e-300)
    s = ratio * ratio
    angle = 0.0208351
    angle = angle * s - 0.0851330
    angle = angle * s + 0.1801410
    angle = angle * s - 0.3302995
    angle = (angle * s + 0.9998660) * ratio
    if across > along:
        angle = 0.5 * math.pi - angle
    if x < 0.0:
        angle = math.pi - angle
    return -angle if y < 0.0 else angle


@njit(cache=True, nogil=True, forceinline=True)
def _evidence(
    ranges: NDArray[np.float32],
    origins: NDArray[np.float64],
    turns: NDArray[np.float64],
    slot: int,
    beams: _Beams,
    doubts: Doubts,
    point: Tuple[float, float, float],
) -> int:
    """Return what one earlier scan tells about a point (x, y, z) in the fixed frame."""
    dx = point[0] - origins[slot, 0]
    dy = point[1] - origins[slot, 1]
    dz = point[2] - origins[slot, 2]
    z = turns[slot, 0, 2] * dx + turns[slot, 1, 2] * dy + turns[slot, 2, 2] * dz
    if abs(z) > doubts.level:
        return UNKNOWN
    x = turns[slot, 0, 0] * dx + turns[slot, 1, 0] * dy + turns[slot, 2, 0] * dz
    y = turns[slot, 0, 1] * dx + turns[slot, 1, 1] * dy + turns[slot, 2, 1] * dz
    n = ranges.shape[1]
    distance = math.sqrt(x * x + y * y)
    turn = (bearing(y, x) - beams.angle_min) / beams.increment
    if beams.is_full_turn:
        turn -= n * math.floor(turn / n)
    beam = int(math.floor(turn + 0.5))
    if beams.is_full_turn and beam >= n:
        beam -= n
    if beam < 1 or beam >= n - 1:
        if not beams.is_full_turn:
            return UNKNOWN
    nearest, farthest = np.inf, 0.0
    for step in range(-1, 2):
        k = beam + step
        k = k + n if k < 0 else k - n if k >= n else k
        one = float(ranges[slot, k])
        if one >= doubts.range_min:  # beams without a valid range tell nothing
            nearest, farthest = min(nearest, one), max(farthest, one)
    if farthest == 0.0:
        return UNKNOWN
    if nearest <= distance + doubts.margin:
        return OCCUPIED if farthest >= distance - doubts.margin else UNKNOWN
    wide = math.ceil(doubts.margin / max(distance * abs(beams.increment), 1e-9))
    side = min(int(wide), _MAX_SIDE_BEAMS)
    for step in range(-side, side + 1):
        k = beam + step
        if k < 0 or k >= n:
            if not beams.is_full_turn:
                return UNKNOWN
            k = k + n if k < 0 else k - n
        if doubts.range_min <= float(ranges[slot, k]) <= distance + doubts.margin:
            return UNKNOWN
    return FREED


@njit(cache=True, nogil=True)
def _place_points(
    scan: ScanView,
    step: int,
    doubts: Doubts,
    points: NDArray[np.float64],
    evidence: NDArray[np.uint8],
) -> None:
    """Write the points of a scan, and in ``evidence`` _ASK or else UNKNOWN."""
    ranges, directions, origin, rotation = scan.ranges, scan.directions, scan.origin, scan.rotation
    for k in range(0, ranges.shape[0], step):
        one = float(ranges[k])
        evidence[k] = UNKNOWN
        points[k, 0] = points[k, 1] = points[k, 2] = np.nan
        if not doubts.range_min <= one < doubts.range_max:
            continue
        sx, sy = one * directions[k, 0], one * directions[k, 1]
        up = rotation[2, 0] * sx + rotation[2, 1] * sy
        z = origin[2] + up
        if abs(up) > doubts.upright or z < doubts.low_z or z > doubts.high_z:
            continue
        points[k, 0] = origin[0] + rotation[0, 0] * sx + rotation[0, 1] * sy
        points[k, 1] = origin[1] + rotation[1, 0] * sx + rotation[1, 1] * sy
        points[k, 2] = z
        if abs(up) <= doubts.level:
            evidence[k] = _ASK


@njit(cache=True, nogil=True)
def compare_scan(
    scan: ScanView,
    earlier: EarlierScans,
    order: Order,
    is_thorough: bool,
    step: int,
    doubts: Doubts,
    points: NDArray[np.float64],
    evidence: NDArray[np.uint8],
) -> int:
    """Place the points of a scan and tell which of them lie in space that was free earlier.

    Args:
        scan: The scan.
        earlier: Earlier scans.
        order: Slots to compare with.
        is_thorough: Ask every slot until one finds the point freed. The older ones are not asked
            about a point that three recent ones see occupied: what is there stands. Otherwise the
            first slot that knows about a point decides.
        step: 1 for all beams, 2 for every other one.
        doubts: Limits.
        points: float64[n, 3], written: the points in the fixed frame; NaN where there is none.
        evidence: uint8[n], written: FREED, UNKNOWN or OCCUPIED.

    Returns:
        Number of points that are FREED.
    """
    _place_points(scan, step, doubts, points, evidence)
    beams = _Beams(scan.angle_min, scan.increment, scan.is_full_turn)
    ranges, origins, turns = earlier
    slots, recent = order
    freed = 0
    for k in range(0, evidence.shape[0], step):
        if evidence[k] != _ASK:
            continue
        point = (points[k, 0], points[k, 1], points[k, 2])
        occupied, found = 0, UNKNOWN
        for i in range(slots.shape[0]):
            if i == recent and occupied >= ENOUGH:
                break
            found = _evidence(ranges, origins, turns, slots[i], beams, doubts, point)
            occupied += found == OCCUPIED
            if found == FREED or (occupied and not is_thorough):
                break
        evidence[k] = FREED if found == FREED else OCCUPIED if occupied else UNKNOWN
        freed += found == FREED
    return freed


@njit(cache=True, nogil=True)
def find_clusters(
    scan: ScanView,
    points: NDArray[np.float64],
    evidence: NDArray[np.uint8],
    incidence: float,
    noise: float,
    labels: NDArray[np.int32],
    clusters: NDArray[np.int64],
) -> int:
    """Cut a scan into clusters: at jumps in depth, and where standing things begin.

    Args:
        scan: The scan.
        points: float64[n, 3], as ``compare_scan`` writes them.
        evidence: uint8[n], the same.
        incidence: Smallest angle between a beam and a surface that stays in one piece, radians.
        noise: Standard deviation of ranges, metres.
        labels: int32[n], written: row of each point's cluster, -1 for none.
        clusters: int64[m, 4], written: first beam, number of beams (on from there, beyond
            beam n - 1 with beam 0), number of FREED points, 1 if the cluster stands.

    Returns:
        Number of clusters.
    """
    n = scan.ranges.shape[0]
    step = abs(scan.increment)
    spread = math.sin(step) / math.sin(max(incidence - step, 1e-3))
    starts = np.zeros(n, np.bool_)
    first = -1
    for k in range(n):
        before = k - 1 if k > 0 else n - 1
        joined = k > 0 or scan.is_full_turn
        if joined:
            dx, dy = points[k, 0] - points[before, 0], points[k, 1] - points[before, 1]
            gap = float(scan.ranges[before]) * spread + 3.0 * noise
            joined = dx * dx + dy * dy <= gap * gap  # False for NaN
        starts[k] = not joined
        if not joined and first < 0:
            first = k
    first = max(first, 0)
    stands = np.empty(n, np.bool_)
    for k in range(n):
        stands[k] = evidence[k] == OCCUPIED
    count, was_standing = 0, False
    for i in range(n):
        k = first + i if first + i < n else first + i - n
        if math.isnan(points[k, 0]):
            labels[k] = -1
            continue
        here = _majority(stands, starts, k)
        if i == 0 or starts[k] or here != was_standing:
            clusters[count, 0], clusters[count, 1], clusters[count, 2] = k, 0, 0
            clusters[count, 3] = 1 if here else 0
            count += 1
        was_standing = here
        labels[k] = count - 1
        clusters[count - 1, 1] += 1
        clusters[count - 1, 2] += evidence[k] == FREED
    return count


@njit(cache=True, nogil=True)
def _majority(stands: NDArray[np.bool_], starts: NDArray[np.bool_], k: int) -> bool:
    """Return what most of a point and its two neighbours in the same piece do."""
    n = stands.shape[0]
    after = k + 1 if k + 1 < n else 0
    before = k - 1 if k > 0 else n - 1
    left = stands[k] if starts[k] else stands[before]
    right = stands[k] if starts[after] else stands[after]
    return int(left) + int(stands[k]) + int(right) >= 2


@njit(cache=True, nogil=True)
def find_arrived(
    scan: ScanView,
    earlier: EarlierScans,
    order: Order,
    doubts: Doubts,
    widest: float,
    points: NDArray[np.float64],
    clusters: NDArray[np.int64],
    arrived: NDArray[np.bool_],
) -> None:
    """Find clusters that stand and that some earlier scan saw free: they have come and stopped.

    Args:
        scan: The scan.
        earlier: Earlier scans.
        order: Slots to compare with.
        doubts: Limits.
        widest: Wider clusters have not come, metres.
        points: float64[n, 3], as ``compare_scan`` writes them.
        clusters: int64[m, 4], as ``find_clusters`` writes them.
        arrived: bool[m], written.
    """
    n = scan.ranges.shape[0]
    beams = _Beams(scan.angle_min, scan.increment, scan.is_full_turn)
    ranges, origins, turns = earlier
    for row in range(clusters.shape[0]):
        first, count = clusters[row, 0], clusters[row, 1]
        middle = (first + count // 2) % n
        width = count * abs(scan.increment) * float(scan.ranges[middle])
        arrived[row] = False
        if clusters[row, 3] == 0 or count < ENOUGH or width > widest:
            continue
        for i in range(order.slots.shape[0]):
            freed = 0
            for probe in range(ENOUGH):
                k = (first + (2 * probe + 1) * count // (2 * ENOUGH)) % n
                point = (points[k, 0], points[k, 1], points[k, 2])
                found = _evidence(ranges, origins, turns, order.slots[i], beams, doubts, point)
                freed += found == FREED
            if freed == ENOUGH:
                arrived[row] = True
                break
