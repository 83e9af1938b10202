"""Tell the points that move from those that stand, and cut a scan into clusters.

A point moves if it lies where an earlier scan saw free space. So walls that come into view, the
edges of standing things seen from elsewhere, and what was hidden before do not move: no earlier
beam passed there. A point that earlier scans saw occupied stands. Everything else is in doubt.
What has stood for two seconds counts as standing; otherwise one scan of the last 16 s that saw free
space is enough, so that who comes out of another one's shadow moves where it was free before.

Sources: free space that is violated: C.-C. Wang, C. Thorpe, S. Thrun, "Online simultaneous
localization and mapping with detection and tracking of moving objects", ICRA 2003, section IV; by
queries to earlier scans instead of a grid: D. J. Yoon, T. Y. Tang, T. D. Barfoot, "Mapless online
detection of dynamic objects in 3D lidar", CRV 2019, section III. Cutting at jumps in depth: G. A.
Borges, M.-J. Aldon, "Line extraction in 2D range images for mobile robotics", J. of Intelligent
and Robotic Systems 40, 2004, section 3.2, the adaptive breakpoint detector.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_moving.earlier_scans import (
    ENOUGH,
    Doubts,
    EarlierScans,
    Order,
    ScanView,
    compare_scan,
    find_arrived,
    find_clusters,
)
from quad_nav.costmap.scan_validator import CORRECTION_M, CORRECTION_RAD
from quad_nav.geometry import Pose3D, Scan, angle_difference
from quad_nav.parameter import number

Floats = NDArray[np.float64]
Heights = Tuple[float, float]

SPACING_S, SLOTS, RECENT = 0.4, 40, 5
"""Earlier scans: the time from one to the next, their number, and how many of them are recent.

In 0.4 s a person who walks leaves its place. 16 s are as long as people hide each other in a crowd;
what has stood for 2 s stands.
"""
NOISE_M = 0.02
"""Standard deviation of ranges of common LIDARs, and of the pose of one that flies."""
LEVEL_M, UPRIGHT_M = 0.3, 0.8
"""Heights above or below a LIDAR's plane, which tilts in flight: in the first its beams speak for
upright things, in the second they still show where one is that is tracked. A quadcopter that
accelerates with 2 m/s^2 tilts by 11 degrees: 0.3 m at 1.5 m, 0.8 m at 4 m."""
_INCIDENCE_RAD = math.radians(10.0)  # the least that Borges and Aldon take for a surface
_IDLE_PERIOD_S = 0.1  # where nothing moved, scans that come earlier are left out: half the time
_FULL_TURN_BEAMS = 1.5  # drivers count one beam more or less: a gap of fewer beams is none


@dataclass(frozen=True)
class TrackerParams:
    """Parameters of ``quad_moving/Tracker``."""

    range_m: float = number(
        "range", 20.0, "m", 0, 100, "Farthest range at which obstacles are tracked."
    )
    min_speed_mps: float = number(
        "min_speed", 0.2, "m/s", 0, 5, "Slower obstacles count as standing."
    )
    max_radius_m: float = number(
        "max_radius", 1.0, "m", 0, 10, "Larger obstacles count as standing."
    )
    acceleration_mps2: float = number(
        "acceleration", 1.5, "m/s^2", 0, 20, "Standard deviation of the obstacles' accelerations."
    )
    lost_after_s: float = number(
        "timeout", 4.0, "s", 0, 60, "Time for which an obstacle that is hidden is predicted."
    )
    margin_m: float = number(
        "margin", 0.12, "m", 0, 1, "A point moves if it is inside space that was free, by so much."
    )


@dataclass(frozen=True)
class ScanClusters:
    """Clusters of one scan.

    Attributes:
        view: The scan.
        points: float64[n, 3] in the fixed frame, for each beam; NaN where there is none.
        labels: int32[n], row of each point's cluster, -1 for none.
        rows: int64[m, 4]: first beam, number of beams, number of points in space that was free,
            and 1 if the cluster stands.
        arrived: bool[m], clusters that stand where an earlier scan saw free space.
    """

    view: ScanView
    points: Floats
    labels: NDArray[np.int32]
    rows: NDArray[np.int64]
    arrived: NDArray[np.bool_]

    def beams(self, row: int) -> NDArray[np.bool_]:
        """Return which beams hit a cluster, bool[n]."""
        mask: NDArray[np.bool_] = self.labels == row
        return mask

    def sees_through(self, place: Floats, radius_m: float, behind_m: float) -> bool:
        """Return whether the LIDAR sees what is behind the middle half of a disc.

        Args:
            place: float64[2], the middle of the disc in the fixed frame, metres.
            radius_m: Its radius.
            behind_m: Distance from its middle beyond which is behind it.
        """
        view = self.view
        away = np.array([place[0] - view.origin[0], place[1] - view.origin[1], 0.0])
        x_m, y_m, z_m = (view.rotation.T @ away).tolist()
        distance_m = math.hypot(x_m, y_m)
        if distance_m <= radius_m or abs(z_m) > LEVEL_M:
            return False
        n = len(view.ranges)
        middle = (math.atan2(y_m, x_m) - view.angle_min) / view.increment
        half = int(0.5 * math.asin(radius_m / distance_m) / abs(view.increment))
        beams = round(middle) + np.arange(-half, half + 1)
        if view.is_full_turn:
            beams %= n
        elif beams[0] < 0 or beams[-1] >= n:
            return False
        return bool((view.ranges[beams] > distance_m + behind_m).all())


@dataclass(frozen=True)
class TrackedScan:
    """What a scan shows of moving obstacles.

    Attributes:
        moving_beams: bool[n], beams that hit confirmed tracks.
        vacated: float64[k, 3], points in the fixed frame, seen before, of obstacles whose tracks
            this scan confirms: they have moved on.
    """

    moving_beams: NDArray[np.bool_]
    vacated: Floats

    @property
    def any_moving(self) -> bool:
        """True if the scan shows a confirmed track."""
        return bool(self.moving_beams.any())


class MovingPoints:
    """Compare the scans of one LIDAR with its earlier ones."""

    def __init__(self) -> None:
        """Start without earlier scans."""
        self.reset()

    def reset(self) -> None:
        """Forget earlier scans, after a jump of clock or pose, or with other beams."""
        self._earlier: Optional[EarlierScans] = None
        self._stamps_s = np.full(SLOTS, -math.inf)
        self._order = Order(np.empty(0, np.int64), RECENT)
        self._compared_s = self._newest_s = -math.inf
        self._previous: Optional[Pose3D] = None
        self._beams = (0.0, 0.0, 0)

    def compare(
        self,
        scan: Scan,
        frame_from_sensor: Pose3D,
        heights_m: Heights,
        params: TrackerParams,
        is_thorough: bool,
    ) -> Optional[ScanClusters]:
        """Cut a scan into clusters and keep it for later ones.

        Args:
            scan: The scan, newer than all before.
            frame_from_sensor: Pose of the LIDAR in the fixed frame.
            heights_m: Lowest and greatest height of points that count.
            params: The parameters.
            is_thorough: Ask all earlier scans about each point. Otherwise the oldest one that
                knows decides, and the clusters are None if nothing moves.
        """
        self._check_continuity(scan, frame_from_sensor)
        if not is_thorough and scan.stamp_s - self._compared_s < _IDLE_PERIOD_S - 1e-6:
            return None
        self._compared_s = scan.stamp_s
        view = _view(scan, frame_from_sensor)
        count = len(view.ranges)
        points, evidence = np.empty((count, 3)), np.empty(count, np.uint8)
        earlier, order = self._slots(count), self._order
        doubts = _doubts(scan, heights_m, params)
        is_idle = not is_thorough and not compare_scan(
            view, earlier, order, False, ENOUGH, doubts, points, evidence
        )
        if not is_idle:
            compare_scan(view, earlier, order, is_thorough, 1, doubts, points, evidence)
        clusters = None if is_idle else self._cut(view, points, evidence, doubts, params)
        self._keep(view, scan.stamp_s, earlier)
        return clusters

    def _cut(
        self,
        view: ScanView,
        points: Floats,
        evidence: NDArray[np.uint8],
        doubts: Doubts,
        params: TrackerParams,
    ) -> ScanClusters:
        count = len(points)
        labels, rows = np.empty(count, np.int32), np.empty((count, 4), np.int64)
        found = find_clusters(view, points, evidence, _INCIDENCE_RAD, NOISE_M, labels, rows)
        rows, arrived = rows[:found], np.zeros(found, np.bool_)
        earlier, widest_m = self._slots(count), 2.0 * params.max_radius_m
        find_arrived(view, earlier, self._order, doubts, widest_m, points, rows, arrived)
        return ScanClusters(view, points, labels, rows, arrived)

    def _slots(self, beams: int) -> EarlierScans:
        """Return the earlier scans."""
        if self._earlier is None:
            self._earlier = EarlierScans(
                np.full((SLOTS, beams), np.nan, np.float32),
                np.zeros((SLOTS, 3)),
                np.zeros((SLOTS, 3, 3)),
            )
        return self._earlier

    def _check_continuity(self, scan: Scan, pose: Pose3D) -> None:
        beams = (scan.angle_min_rad, scan.angle_increment_rad, len(scan.ranges_m))
        before, now = self._previous, pose
        if before is not None and (
            beams != self._beams
            or scan.stamp_s < self._newest_s
            or math.hypot(now.x_m - before.x_m, now.y_m - before.y_m) > CORRECTION_M
            or abs(angle_difference(now.yaw_rad, before.yaw_rad)) > CORRECTION_RAD
        ):
            self.reset()
        self._previous, self._beams = now, beams

    def _keep(self, view: ScanView, stamp_s: float, earlier: EarlierScans) -> None:
        if stamp_s - self._newest_s < SPACING_S:
            return
        self._newest_s = stamp_s
        slot = int(np.argmin(self._stamps_s))
        self._stamps_s[slot] = stamp_s
        order = np.argsort(self._stamps_s)
        order = order[np.isfinite(self._stamps_s[order])]
        self._order = Order(np.concatenate([order[-RECENT:], order[:-RECENT]]), RECENT)
        earlier.ranges[slot] = view.ranges
        earlier.origins[slot], earlier.rotations[slot] = view.origin, view.rotation


def _doubts(scan: Scan, heights_m: Heights, params: TrackerParams) -> Doubts:
    nearest_m, farthest_m = max(scan.range_min_m, 1e-3), min(scan.range_max_m, params.range_m)
    return Doubts(nearest_m, farthest_m, *heights_m, LEVEL_M, UPRIGHT_M, params.margin_m)


def _view(scan: Scan, pose: Pose3D) -> ScanView:
    count = len(scan.ranges_m)
    turn_rad = count * abs(scan.angle_increment_rad)
    return ScanView(
        np.ascontiguousarray(scan.ranges_m, dtype=np.float32),
        _directions(scan.angle_min_rad, scan.angle_increment_rad, count),
        scan.angle_min_rad,
        scan.angle_increment_rad,
        abs(turn_rad - 2.0 * math.pi) < _FULL_TURN_BEAMS * abs(scan.angle_increment_rad),
        pose.translation,
        pose.rotation,
    )


@lru_cache(maxsize=64)
def _directions(angle_min_rad: float, angle_increment_rad: float, n: int) -> Floats:
    """Return cosine and sine of each beam, float64[n, 2]; Python's are the C library's."""
    angles = [angle_min_rad + k * angle_increment_rad for k in range(n)]
    return np.array([(math.cos(a), math.sin(a)) for a in angles]).reshape(n, 2)
