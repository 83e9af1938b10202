"""One grid of costs into another."""

from __future__ import annotations

from numba import njit

from quad_nav.grid import UNKNOWN


@njit(cache=True, nogil=True)
def raise_to(below, above):
    """Keep the higher cost of each cell of uint8[H, W] in ``below``; unknown is the lowest."""
    for y in range(below.shape[0]):
        for x in range(below.shape[1]):
            cost, other = below[y, x], above[y, x]
            if cost == UNKNOWN or (other != UNKNOWN and other > cost):
                below[y, x] = other
