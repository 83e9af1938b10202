"""World coordinate to cell index along one axis."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def cell_index(world_m, origin_m, resolution_m, size):
    """The cell that holds ``world_m``; -1 outside the grid and for NaN."""
    cell = (world_m - origin_m) / resolution_m
    if not 0.0 <= cell < size:
        return -1
    return int(cell)
