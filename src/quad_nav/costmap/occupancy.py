"""Costs as occupancies, for ``nav_msgs/OccupancyGrid``."""

from __future__ import annotations

import numpy as np

from quad_nav.grid import FREE, INSCRIBED, LETHAL, UNKNOWN


def _table() -> np.ndarray:
    """int8[256]: free 0, inflated 1..98, inscribed 99, lethal 100, unknown -1."""
    table = np.empty(256, dtype=np.int8)
    inflated = np.arange(1, INSCRIBED)
    table[1:INSCRIBED] = 1 + 97 * (inflated - 1) // 251
    table[FREE], table[INSCRIBED], table[LETHAL], table[UNKNOWN] = 0, 99, 100, -1
    return table


OCCUPANCY_OF_COST = _table()


def occupancy(costs: np.ndarray) -> np.ndarray:
    """Costs, uint8 of any shape, as occupancies, int8 of the same shape."""
    return OCCUPANCY_OF_COST[costs]
