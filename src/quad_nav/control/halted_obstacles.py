"""Halted obstacles: those that were tracked, have stopped, and stand in the costmap since.

An obstacle that stands for two seconds has no track any more. It may walk on at any time, so a
robot with passive safety remembers where it stopped, until the costmap shows nothing there, or
something that is tracked is there.
"""

from __future__ import annotations

from typing import Dict, List

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D
from quad_nav.grid import LETHAL, GridSpec
from quad_nav.tracking.tracks import Tracks

Floats = NDArray[np.float64]

_SLOW_MPS = 0.3  # who was slower when the track ended has stopped
_MARKED_AFTER_S = 1.0  # by which an obstacle without a track is marked in the costmap
_BESIDE_M = 0.1
_FAR_M = 3.0  # from the robot, beyond which none is remembered


class HaltedObstacles:
    """Obstacles that have stopped.

    Attributes:
        discs: float64[k, 3], x, y and radius of each, in the local costmap's frame.
    """

    def __init__(self) -> None:
        """Remember none."""
        self.discs: Floats = np.zeros((0, 3))
        self._since_s: List[float] = []
        self._tracked: Dict[int, List[float]] = {}

    def update(
        self, tracks: Tracks, pose: Pose2D, spec: GridSpec, costs: NDArray[np.uint8]
    ) -> None:
        """Remember which tracks ended, and forget who moves or is gone.

        Args:
            tracks: The moving obstacles, in the local costmap's frame.
            pose: Pose of the robot in the same frame.
            spec: Grid of the local costmap.
            costs: uint8[H, W] on it.
        """
        rows = np.column_stack([tracks.states, tracks.radii_m])
        now = dict(zip(tracks.numbers.tolist(), rows.tolist()))
        for number in set(self._tracked) - set(now):
            x_m, y_m, vx_mps, vy_mps, radius_m = self._tracked[number]
            if np.hypot(vx_mps, vy_mps) < _SLOW_MPS:
                self.discs = np.vstack([self.discs, (x_m, y_m, radius_m)])
                self._since_s.append(tracks.time_s)
        self._tracked = now
        if len(self.discs):
            stays = [self._stays(k, tracks, pose, spec, costs) for k in range(len(self.discs))]
            self.discs = self.discs[stays]
            self._since_s = [since_s for since_s, is_kept in zip(self._since_s, stays) if is_kept]

    def _stays(
        self, row: int, tracks: Tracks, pose: Pose2D, spec: GridSpec, costs: NDArray[np.uint8]
    ) -> bool:
        x_m, y_m, radius_m = self.discs[row].tolist()
        if np.hypot(x_m - pose.x_m, y_m - pose.y_m) > _FAR_M:
            return False
        if (np.hypot(*(tracks.states[:, :2] - (x_m, y_m)).T) < radius_m).any():
            return False
        is_new = tracks.time_s - self._since_s[row] < _MARKED_AFTER_S
        return is_new or _is_marked(spec, costs, x_m, y_m, radius_m + _BESIDE_M)


def _is_marked(
    spec: GridSpec, costs: NDArray[np.uint8], x_m: float, y_m: float, radius_m: float
) -> bool:
    """Return whether the costmap has something within a disc."""
    rows, columns = np.nonzero(costs == LETHAL)
    x = spec.origin_x_m + spec.resolution_m * (columns + 0.5)
    y = spec.origin_y_m + spec.resolution_m * (rows + 0.5)
    return bool((np.hypot(x - x_m, y - y_m) < radius_m).any())
