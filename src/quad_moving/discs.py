"""Discs of obstacles of which a LIDAR sees the near side.

The angle that an obstacle covers gives the radius of a disc, if both of its edges are in sight. The
radius is kept, so that a disc of which a part is hidden is fitted with the radius of earlier views:
its centre is the front plus the radius. Source of the idea: M. Przybyla, "Detection and tracking of
2D geometric obstacles from LRF data", RoMoCo 2017, section II, which fits circles to segments.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_moving.discs_kernel import fit_disc, outline_clusters
from quad_moving.earlier_scans import ScanView
from quad_moving.moving_points import NOISE_M, ScanClusters

Floats = NDArray[np.float64]

FIRST_RADIUS_M = 0.3
"""Radius of an obstacle that was never in full view: a person."""
MIN_RADIUS_M = 0.05
"""Thinner things are hit by fewer than three beams from some metres on."""
EDGE_M = 0.1
"""What is farther by so much is behind an edge; the centre of a part in view is as uncertain."""
_EDGE_BEAMS = 0.4  # an edge is between two beams: 1 / sqrt(12) for each of two edges
_SLOWEST = 0.05  # weight of a new view of an obstacle that is known for long: the last 20 count


@dataclass(frozen=True)
class Outlines:
    """First guesses of the discs of all clusters of a scan.

    Attributes:
        centres: float64[m, 2] in the fixed frame, metres.
        radii_m: float64[m].
        is_whole: bool[m], both edges are in sight.
        nearest_m: float64[m], distances of the nearest points from the LIDAR.
    """

    centres: Floats
    radii_m: Floats
    is_whole: NDArray[np.bool_]
    nearest_m: Floats


@dataclass
class Radius:
    """What is known of an obstacle's size.

    Attributes:
        circle_m: Radius of the circle that is fitted.
        reach_m: Radius of the disc that holds all points lately seen.
        views: Number of full views.
    """

    circle_m: float = FIRST_RADIUS_M
    reach_m: float = 0.0
    views: int = 0

    @property
    def outer_m(self) -> float:
        """Radius of a disc that holds the obstacle."""
        return max(self.circle_m, self.reach_m)

    def see(self, radius_m: float, is_whole: bool) -> None:
        """Take the radius of one view; of one that is not whole it is a lower limit."""
        if is_whole:
            self.views += 1
            weight = max(1.0 / self.views, _SLOWEST)
            self.circle_m += weight * (max(radius_m, MIN_RADIUS_M) - self.circle_m)
        elif radius_m > self.circle_m:
            self.circle_m = radius_m

    def hold(self, farthest_m: float) -> None:
        """Take the distance of the farthest point of a view from the fitted centre."""
        beyond_m = max(self.reach_m - self.circle_m, 0.0) * (1.0 - _SLOWEST)
        self.reach_m = max(self.circle_m + beyond_m, farthest_m)


@dataclass(frozen=True)
class DiscFit:
    """Position of one disc.

    Attributes:
        position: float64[2] in the fixed frame, metres.
        noise: float64[2, 2], covariance of the position.
        farthest_m: Distance of the farthest point of the cluster.
        bias_m: Standard deviation of the error that stays the same from scan to scan.
    """

    position: Floats
    noise: Floats
    farthest_m: float
    bias_m: float


def outlines(clusters: ScanClusters) -> Outlines:
    """Return the first guesses of the discs of a scan's clusters."""
    rows = np.empty((len(clusters.rows), 5))
    outline_clusters(clusters.view, clusters.points, clusters.rows, len(rows), EDGE_M, rows)
    return Outlines(rows[:, :2].copy(), rows[:, 2].copy(), rows[:, 3] > 1.5, rows[:, 4].copy())


def fit(clusters: ScanClusters, row: int, guess: Floats, radius: Radius, is_whole: bool) -> DiscFit:
    """Fit the disc of a known radius to a cluster.

    Args:
        clusters: Clusters of a scan.
        row: Row of the cluster.
        guess: float64[2], where the centre may be.
        radius: What is known of the size.
        is_whole: Both edges of the cluster are in sight.
    """
    first, beams = int(clusters.rows[row, 0]), int(clusters.rows[row, 1])
    return _fit(clusters.view, clusters.points, (first, beams), guess, radius, is_whole)


def fit_points(
    clusters: ScanClusters, beams: NDArray[np.bool_], guess: Floats, radius: Radius
) -> DiscFit:
    """Fit the disc of a known radius to the points of some beams, as ``fit`` does.

    Args:
        clusters: Clusters of a scan.
        beams: bool[n], beams that hit the obstacle.
        guess: float64[2], where the centre may be.
        radius: What is known of the size.
    """
    points = clusters.points[beams]
    return _fit(clusters.view, points, (0, len(points)), guess, radius, False)


def _fit(
    view: ScanView,
    points: Floats,
    part: Tuple[int, int],
    guess: Floats,
    radius: Radius,
    is_whole: bool,
) -> DiscFit:
    """Fit a disc to a part of the points: the first one, and their number."""
    fitted = np.empty(6)
    fit_disc(points, *part, guess, radius.circle_m, NOISE_M, FIRST_RADIUS_M, fitted)
    x, y, xx, yy, xy, farthest_m = fitted.tolist()
    away_x, away_y = x - float(view.origin[0]), y - float(view.origin[1])
    distance_m = max(float(np.hypot(away_x, away_y)), 1e-6)
    away_x, away_y = away_x / distance_m, away_y / distance_m
    spacing_m = distance_m * abs(view.increment)
    depth_m = (
        0.5 * FIRST_RADIUS_M if not radius.views else 0.5 * spacing_m / math.sqrt(radius.views)
    )
    depth, pose = depth_m**2, NOISE_M**2
    xx, yy = xx + depth * (away_x * away_x) + pose, yy + depth * (away_y * away_y) + pose
    xy += depth * (away_x * away_y)
    noise = np.array([[xx, xy], [xy, yy]])
    return DiscFit(np.array([x, y]), noise, farthest_m, _bias(spacing_m, radius, is_whole))


def _bias(spacing_m: float, radius: Radius, is_whole: bool) -> float:
    """Return the standard deviation of what no averaging over scans makes smaller.

    Edges are known to a part of the beams' spacing; of a part in view, neither the centre across
    the line of sight nor, before the first full view, the radius is known.
    """
    part_m = 0.0 if is_whole else EDGE_M if radius.views else FIRST_RADIUS_M
    return math.sqrt(NOISE_M**2 + (_EDGE_BEAMS * spacing_m) ** 2 + part_m**2)
