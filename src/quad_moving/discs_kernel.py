"""Discs fitted to the near side of obstacles.

``discs`` has the reasoning.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from quad_moving.earlier_scans import ScanView
from quad_nav.files.kernel_cache import njit

_ITERATIONS = 6  # of Gauss-Newton, which has converged to a millimetre by then
_FAR = 1.0  # 1/m^2, of a centre that the points do not tell


@njit(cache=True, nogil=True)
def outline_clusters(
    scan: ScanView,
    points: NDArray[np.float64],
    clusters: NDArray[np.int64],
    count: int,
    jump: float,
    outlines: NDArray[np.float64],
) -> None:
    """Find radius and centre of a disc for each cluster from the angle that it covers.

    A disc of radius r whose nearest point is at distance d covers the half angle a with
    sin a = r / (d + r).

    Args:
        scan: The scan.
        points: float64[n, 3], as ``compare_scan`` writes them.
        clusters: int64[m, 4], as ``find_clusters`` writes them.
        count: Number of clusters.
        jump: Depth by which the background is farther than an edge that is in sight, metres.
        outlines: float64[m, 5], written: x, y and radius of the disc, number of edges in sight,
            distance of the nearest point from the sensor, metres.
    """
    n = scan.ranges.shape[0]
    for row in range(count):
        first, beams = clusters[row, 0], clusters[row, 1]
        nearest = np.inf
        for i in range(beams):
            k = first + i if first + i < n else first + i - n
            nearest = min(nearest, float(scan.ranges[k]))
        last = (first + beams - 1) % n
        edges = 0.0
        if scan.is_full_turn or first > 0:
            edges += scan.ranges[first - 1] > scan.ranges[first] + jump
        if scan.is_full_turn or last < n - 1:
            edges += scan.ranges[(last + 1) % n] > scan.ranges[last] + jump
        half = min(0.5 * beams * abs(scan.increment), 1.3)
        radius = nearest * math.sin(half) / (1.0 - math.sin(half))
        angle = scan.angle_min + (first + 0.5 * (beams - 1)) * scan.increment
        away = nearest + radius
        sx, sy = away * math.cos(angle), away * math.sin(angle)
        outlines[row, 0] = scan.origin[0] + scan.rotation[0, 0] * sx + scan.rotation[0, 1] * sy
        outlines[row, 1] = scan.origin[1] + scan.rotation[1, 0] * sx + scan.rotation[1, 1] * sy
        outlines[row, 2], outlines[row, 3], outlines[row, 4] = radius, edges, nearest


@njit(cache=True, nogil=True)
def fit_disc(
    points: NDArray[np.float64],
    first: int,
    beams: int,
    guess: NDArray[np.float64],
    radius: float,
    noise: float,
    prior: float,
    fitted: NDArray[np.float64],
) -> None:
    """Fit the centre of a disc of known radius to the points of a cluster, by Gauss-Newton.

    Args:
        points: float64[n, 3], as ``compare_scan`` writes them.
        first: First beam of the cluster.
        beams: Number of its beams.
        guess: float64[2], where the centre may be.
        radius: Radius of the disc, metres.
        noise: Standard deviation of the distances of points from the circle, metres.
        prior: Standard deviation of the guess, metres.
        fitted: float64[6], written: x, y, variances of x and y and their covariance, by the points
            alone, and the distance of the farthest point from the centre.
    """
    n = points.shape[0]
    x, y = guess[0], guess[1]
    weight, own = 1.0 / (noise * noise), 1.0 / (prior * prior)
    xx = yy = own
    xy = 0.0
    for _ in range(_ITERATIONS):
        xx = yy = own
        xy, gx, gy = 0.0, own * (guess[0] - x), own * (guess[1] - y)
        for i in range(beams):
            k = first + i if first + i < n else first + i - n
            dx, dy = points[k, 0] - x, points[k, 1] - y
            away = max(math.sqrt(dx * dx + dy * dy), 1e-6)
            ux, uy = dx / away, dy / away
            off = away - radius
            xx += weight * ux * ux
            yy += weight * uy * uy
            xy += weight * ux * uy
            gx += weight * ux * off
            gy += weight * uy * off
        det = xx * yy - xy * xy
        x += (yy * gx - xy * gy) / det
        y += (xx * gy - xy * gx) / det
    # The guess is no measurement: it keeps the fit of a few points from running away.
    xx, yy = xx - own + _FAR, yy - own + _FAR
    det = xx * yy - xy * xy
    fitted[0], fitted[1] = x, y
    fitted[2], fitted[3], fitted[4] = yy / det, xx / det, -xy / det
    farthest = 0.0
    for i in range(beams):
        k = first + i if first + i < n else first + i - n
        dx, dy = points[k, 0] - x, points[k, 1] - y
        farthest = max(farthest, dx * dx + dy * dy)
    fitted[5] = math.sqrt(farthest)
