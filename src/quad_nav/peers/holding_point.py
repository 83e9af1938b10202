"""Where a robot goes that is in another's way: the nearest place that is in nobody's."""

from __future__ import annotations

import math
from typing import Optional, Sequence

import numpy as np

from quad_nav.geometry import Pose2D
from quad_nav.grid import INSCRIBED, GridSpec
from quad_nav.kernels.discs import nearest_cell, raise_discs
from quad_nav.peers.peer import thinned

COMFORTABLE = 128  # who stands where costs are lower has room to turn


def find_holding_point(
    spec: GridSpec,
    costs: np.ndarray,
    here: Pose2D,
    ways: Sequence[np.ndarray],
    others: np.ndarray,
    min_separation_m: float,
) -> Optional[Pose2D]:
    """The nearest place on the global costmap, uint8[H, W], that is ``min_separation_m`` from all ways.

    ``ways`` are float64[n, 2] each, the present positions of those who go included.
    ``others``, float64[k, 2], are the positions of all peers: they are kept off too and
    not passed through. None when there is no such place that can be reached.
    """
    start = spec.cell_of(here.x_m, here.y_m)
    if start is None:
        return None
    unwanted = (costs >= COMFORTABLE).astype(np.uint8)
    grid = (spec.origin_x_m, spec.origin_y_m, spec.resolution_m)
    raise_discs(unwanted, *grid, others, min_separation_m, 1)
    for way in ways:
        raise_discs(unwanted, *grid, thinned(way, 2.0 * spec.resolution_m), min_separation_m, 1)
    cell_x, cell_y = nearest_cell(
        _blocked(spec, costs, here, others, min_separation_m), unwanted, *start
    )
    if cell_x < 0:
        return None
    x_m, y_m = spec.centre_of(cell_x, cell_y)
    return Pose2D(x_m, y_m, math.atan2(y_m - here.y_m, x_m - here.x_m))


def can_be_reached(
    spec: GridSpec,
    costs: np.ndarray,
    here: Pose2D,
    place: Pose2D,
    others: np.ndarray,
    min_separation_m: float,
) -> bool:
    """Whether there is a way to a place that passes through no peer."""
    start, end = spec.cell_of(here.x_m, here.y_m), spec.cell_of(place.x_m, place.y_m)
    if start is None or end is None:
        return False
    unwanted = np.ones(spec.shape, dtype=np.uint8)
    unwanted[end[1], end[0]] = 0
    return (
        nearest_cell(_blocked(spec, costs, here, others, min_separation_m), unwanted, *start)[0]
        >= 0
    )


def _blocked(
    spec: GridSpec, costs: np.ndarray, here: Pose2D, others: np.ndarray, min_separation_m: float
) -> np.ndarray:
    """Where no way out leads through, uint8[H, W]; it begins outside of every peer's disc."""
    blocked = (costs >= INSCRIBED).astype(np.uint8)
    for other in others:
        away_m = math.hypot(other[0] - here.x_m, other[1] - here.y_m)
        raise_discs(
            blocked,
            spec.origin_x_m,
            spec.origin_y_m,
            spec.resolution_m,
            other[None, :],
            min(min_separation_m, away_m - 2.0 * spec.resolution_m),
            1,
        )
    return blocked
