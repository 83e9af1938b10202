"""Holding points: where a robot makes room, the nearest place off all paths of its peers."""

from __future__ import annotations

import math
from typing import Optional, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import costmap_view
from quad_nav.costmap.cost_grid_kernel import nearest_cell, raise_discs
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.geometry import Pose2D
from quad_nav.grid import INSCRIBED
from quad_nav.peers.peer import resample

COMFORTABLE = 128  # below this cost a robot has room to turn


def find_holding_point(
    costmap: LayeredCostmap,
    pose: Pose2D,
    paths: Sequence[NDArray[np.float64]],
    peers: NDArray[np.float64],
    min_separation_m: float,
) -> Optional[Pose2D]:
    """Find the nearest place that keeps the minimum separation from all paths and peers.

    Args:
        costmap: The global costmap.
        pose: Pose of the robot in ``map``.
        paths: Paths to keep clear, float64[n, 2] each, metres in ``map``, from the present
            positions of their robots on.
        peers: Positions of all peers, float64[k, 2], metres in ``map``; the path to the
            holding point does not pass through them.
        min_separation_m: Minimum separation of centres.

    Returns:
        The holding point, facing away from the robot; None if no such place is reachable.
    """
    spec, costs = costmap.spec, costmap.costs
    start = spec.cell_of(pose.x_m, pose.y_m)
    if start is None:
        return None
    occupied = (costs >= COMFORTABLE).astype(np.uint8)
    kept_clear = [peers, *(resample(path, 2.0 * spec.resolution_m) for path in paths)]
    for centres in kept_clear:
        raise_discs(costmap_view(spec, occupied), centres, min_separation_m, 1)
    blocked = _impassable(costmap, pose, peers, min_separation_m)
    cell_x, cell_y = nearest_cell(blocked, occupied, *start)
    if cell_x < 0:
        return None
    x_m, y_m = spec.centre_of(cell_x, cell_y)
    return Pose2D(x_m, y_m, math.atan2(y_m - pose.y_m, x_m - pose.x_m))


def is_reachable(
    costmap: LayeredCostmap,
    pose: Pose2D,
    target: Pose2D,
    peers: NDArray[np.float64],
    min_separation_m: float,
) -> bool:
    """Return whether a path leads to the target that passes through no peer.

    The arguments are those of ``find_holding_point``.
    """
    spec = costmap.spec
    start, end = spec.cell_of(pose.x_m, pose.y_m), spec.cell_of(target.x_m, target.y_m)
    if start is None or end is None:
        return False
    occupied = np.ones(spec.shape, dtype=np.uint8)
    occupied[end[1], end[0]] = 0
    blocked = _impassable(costmap, pose, peers, min_separation_m)
    return bool(nearest_cell(blocked, occupied, *start)[0] >= 0)


def _impassable(
    costmap: LayeredCostmap, pose: Pose2D, peers: NDArray[np.float64], min_separation_m: float
) -> NDArray[np.uint8]:
    """Return the cells that no path may cross, uint8[H, W]; the robot is in none of them."""
    spec = costmap.spec
    blocked: NDArray[np.uint8] = (costmap.costs >= INSCRIBED).astype(np.uint8)
    for peer in peers:
        distance_m = math.hypot(peer[0] - pose.x_m, peer[1] - pose.y_m)
        radius_m = min(min_separation_m, distance_m - 2.0 * spec.resolution_m)
        raise_discs(costmap_view(spec, blocked), peer[None, :], radius_m, 1)
    return blocked
