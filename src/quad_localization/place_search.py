"""Search for the place of a lost robot in the whole map, a share of it with each scan.

Random poses compete with the best ones of the scans before. The robot hovers, so that these stay
near the truth, and each scan refines them. A place is found when no other one fits as well.

Source of the idea, to draw poses by the sensor rather than by the motion: S. Lenser, M. Veloso,
"Sensor Resetting Localization for Poorly Modelled Mobile Robots", ICRA 2000.
"""

from __future__ import annotations

import math
from typing import List, Optional

import numpy as np
from numpy.typing import NDArray

from quad_localization.occupancy_map import (
    MapFrame,
    OccupancyMap,
    cell_of,
    is_inside,
    obstacle_distances,
)
from quad_localization.particle_filter import draw_poses
from quad_localization.random_numbers import State, normals
from quad_nav.files.kernel_cache import njit
from quad_nav.geometry import Pose2D

Floats = NDArray[np.float64]

_DRAWN = 4000
"""Random poses for each scan: with the steps that refine the best of them, 5 ms."""
_KEPT = 30
_NEAR_M = 0.2
"""Beams that end nearer to an obstacle fit."""
_FAR_M = 2.0
"""Largest distance to an obstacle that is measured."""
_COARSE_M, _FINE_M = 0.3, 0.1
"""Deviations of the ends of beams from obstacles, for random poses and for refined ones."""
_REACHES = np.array([(0.15, 0.15, 0.08), (0.07, 0.07, 0.03), (0.03, 0.03, 0.015)])
"""Deviations of the steps that refine poses, m and rad."""
_TRIES = 16
_APART_M, _APART_RAD = 0.5, 0.35
"""Poses that are nearer are one place."""
_BASIN = 0.3 * 0.3 * 0.15
"""m^2 rad about a place from which a random pose is led to it; often it is ten times as large."""
_COVERAGE = 5.0
"""Random poses for each basin until all places but exp(-5) have had one."""
_MARGIN = 0.05
"""By how much a place has to fit better than all others to be found: 3 of 60 beams."""


class PlaceSearch:
    """Places where a lost robot may be, and how well a pose fits.

    Attributes:
        is_on: Whether a search goes on.
        poses: float64[k, 3], the best pose of each place, the best place first.
    """

    def __init__(self, grid: OccupancyMap, state: State) -> None:
        """Take a map, and the state of the random numbers."""
        self._grid, self._state = grid, state
        # The last value is that outside the map.
        away_m = np.append(obstacle_distances(grid, _FAR_M), math.inf)
        self._near = (away_m < _NEAR_M).astype(np.float64)
        self._coarse, self._fine = (
            np.exp(-0.5 * np.square(away_m / one)) for one in (_COARSE_M, _FINE_M)
        )
        self.is_on, self._drawn = False, 0
        self.poses, self._fits, self._odometry = np.empty((0, 3)), np.empty(0), Pose2D(0.0, 0.0)

    def begin(self) -> None:
        """Begin a search, unless the map has no free cell."""
        self.is_on, self._drawn = len(self._grid.free_places) > 0, 0
        self.poses, self._fits = np.empty((0, 3)), np.empty(0)

    def fit(self, pose: Pose2D, points: Floats) -> float:
        """Return the share of the ends of beams that are near an obstacle of the map.

        Args:
            pose: Pose of the base in the map.
            points: float64[n, 2], ends of beams in the base frame.
        """
        row = np.array([(pose.x_m, pose.y_m, pose.yaw_rad)])
        return float(mean_at_ends(row, points, self._near, self._grid.frame)[0])

    def add_scan(self, points: Floats, odometry: Pose2D) -> Optional[Pose2D]:
        """Search on; return the pose at the only place that fits best, None if that is not known.

        Args:
            points: float64[n, 2], ends of beams in the base frame.
            odometry: Pose by odometry.
        """
        frame, drawn = self._grid.frame, np.empty((_DRAWN, 3))
        draw_poses(drawn, self._grid.free_places, self._state)
        self._drawn += _DRAWN
        rough = mean_at_ends(drawn, points, self._coarse, frame)
        poses = np.concatenate((self._moved(odometry), drawn[_distinct(drawn, rough)]))
        for reach in _REACHES:
            steps = normals(self._state, 3 * _TRIES * len(poses)).reshape(-1, _TRIES, 3) * reach
            steps[:, 0] = 0.0
            tried = (poses[:, None] + steps).reshape(-1, 3)
            fits = mean_at_ends(tried, points, self._fine, frame).reshape(-1, _TRIES)
            poses = tried[np.arange(0, len(tried), _TRIES) + fits.argmax(axis=1)]
        chosen = _distinct(poses, fits.max(axis=1))
        self.poses, self._fits = poses[chosen], fits.max(axis=1)[chosen]
        if not self.is_complete or self.is_ambiguous:
            return None
        return Pose2D(*self.poses[0].tolist())

    @property
    def is_complete(self) -> bool:
        """Whether enough random poses were tried for the area of the map."""
        area_m2 = len(self._grid.free_places) * self._grid.frame.resolution**2
        return self._drawn * _BASIN >= _COVERAGE * area_m2 * math.tau

    @property
    def is_ambiguous(self) -> bool:
        """Whether another place fits about as well as the best one."""
        return bool(np.any(self._fits[1:] > self._fits[0] - _MARGIN))

    def _moved(self, odometry: Pose2D) -> Floats:
        """Return the poses after the motion since the last scan."""
        motion, self._odometry = odometry.relative_to(self._odometry), odometry
        moved = [Pose2D(*row).compose(motion) for row in self.poses.tolist()]
        return np.array([(one.x_m, one.y_m, one.yaw_rad) for one in moved]).reshape(-1, 3)


def _distinct(poses: Floats, fits: Floats) -> List[int]:
    """Return the rows of the best poses at different places, the best first."""
    chosen: List[int] = []
    for row in np.argsort(-fits)[: 10 * _KEPT].tolist():
        apart = np.abs(poses[chosen] - poses[row])
        apart[:, 2] = math.pi - np.abs(np.remainder(apart[:, 2], math.tau) - math.pi)
        if not np.any(np.all(apart < (_APART_M, _APART_M, _APART_RAD), axis=1)):
            chosen.append(row)
        if len(chosen) == _KEPT:
            break
    return chosen


@njit(cache=True, nogil=True)
def mean_at_ends(poses: Floats, points: Floats, values: Floats, frame: MapFrame) -> Floats:
    """Return the means float64[m] of a map's values where beams end.

    Args:
        poses: float64[m, 3].
        points: float64[n, 2], ends of beams in the base frame.
        values: float64[H * W + 1], of the cells, row by row, and outside.
        frame: Place of the map.
    """
    means = np.zeros(len(poses))
    for m in range(len(poses)):
        cos, sin = math.cos(poses[m, 2]), math.sin(poses[m, 2])
        for k in range(len(points)):
            x = poses[m, 0] + cos * points[k, 0] - sin * points[k, 1]
            y = poses[m, 1] + sin * points[k, 0] + cos * points[k, 1]
            column, row = cell_of(frame, x, y)
            inside = is_inside(frame, column, row)
            means[m] += values[int(row) * frame.size_x + int(column) if inside else -1]
        means[m] /= len(points)
    return means
