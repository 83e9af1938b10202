"""Descent of a potential, half a cell a step, for NavFn and the global planner.

Grids are flat arrays, cell = y * size_x + x. A position is a flat cell and an offset from its
centre, float32, in cells to the right (dx) and up (dy). Each value has the width and is rounded in
the order of upstream's, so that paths are equal to the bit.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.plan.wavefront_kernel import NOT_REACHED

OBSTACLE = 254  # NavFn never enters cells of this cost
NEUTRAL = 50  # NavFn's cost of a free cell
_STEP_CELLS = np.float32(0.5)


class Surroundings(NamedTuple):
    """Cells around one of a potential; most steps of a descent stay in the same cell.

    The gradients are float32, of length 1 or 0, at the cell (00), right of it (10), above it (01)
    and both (11). They are 0 unless all cells are reached.
    """

    lowest: int  # flat index of the lowest of the cell and its eight neighbours
    all_reached: bool  # all nine
    x00: np.float32
    y00: np.float32
    x10: np.float32
    y10: np.float32
    x01: np.float32
    y01: np.float32
    x11: np.float32
    y11: np.float32


@njit(cache=True, nogil=True)
def _length(x: np.float32, y: np.float32) -> np.float32:
    return np.float32(math.sqrt(np.float64(x) * x + np.float64(y) * y))


@njit(cache=True, nogil=True)
def _slope(potential: NDArray[np.float32], cell: int, stride: int) -> np.float32:
    """Return the fall of float32[n] at a reached cell, towards higher indices."""
    before, here, after = potential[cell - stride], potential[cell], potential[cell + stride]
    slope = np.float32(0.0)
    if before < NOT_REACHED:
        slope += before - here
    if after < NOT_REACHED:
        slope += here - after
    return np.float32(slope)


@njit(cache=True, nogil=True)
def _unit_gradient(
    potential: NDArray[np.float32], size_x: int, cell: int
) -> Tuple[np.float32, np.float32]:
    """Return the direction down float32[n] at a reached cell, (0, 0) where there is none."""
    none = np.float32(0.0)
    if cell < size_x or cell > potential.size - size_x - 1:
        return none, none
    gx, gy = _slope(potential, cell, 1), _slope(potential, cell, size_x)
    length = _length(gx, gy)
    if length > none:
        inverse = np.float32(1.0) / length
        return inverse * gx, inverse * gy
    return none, none


@njit(cache=True, nogil=True)
def _lowest_around(potential: NDArray[np.float32], size_x: int, cell: int) -> Tuple[int, bool]:
    """Return the lowest of a cell and its eight neighbours; True if all nine are reached.

    As upstream, one is lower than another if it is below the whole part of that.
    """
    lowest, all_reached = cell, potential[cell] < NOT_REACHED
    bound = math.floor(potential[cell])
    for offset_y in (-size_x, 0, size_x):
        for offset_x in (-1, 0, 1):
            neighbour = cell + offset_y + offset_x
            if not 0 <= neighbour < potential.size or potential[neighbour] >= NOT_REACHED:
                all_reached = False
            elif neighbour != cell and potential[neighbour] < bound:
                lowest, bound = neighbour, math.floor(potential[neighbour])
    return lowest, all_reached


@njit(cache=True, nogil=True)
def _blend(share: np.float32, first: np.float32, second: np.float32) -> np.float32:
    """Return the mean of two numbers, of which the second one has a share."""
    return np.float32((1.0 - share) * first + share * second)


@njit(cache=True, nogil=True)
def surroundings(potential: NDArray[np.float32], size_x: int, cell: int) -> Surroundings:
    """Return what a descent of float32[n] needs to know of a flat cell for its next step."""
    lowest, all_reached = _lowest_around(potential, size_x, cell)
    if not all_reached:
        none = np.float32(0.0)
        return Surroundings(lowest, False, none, none, none, none, none, none, none, none)
    x00, y00 = _unit_gradient(potential, size_x, cell)
    x10, y10 = _unit_gradient(potential, size_x, cell + 1)
    x01, y01 = _unit_gradient(potential, size_x, cell + size_x)
    x11, y11 = _unit_gradient(potential, size_x, cell + size_x + 1)
    return Surroundings(lowest, True, x00, y00, x10, y10, x01, y01, x11, y11)


@njit(cache=True, nogil=True)
def _carry(cell: int, offset: np.float32, stride: int) -> Tuple[int, np.float32]:
    """Move whole cells of an offset into the cell index."""
    if offset > 1.0:
        cell, offset = cell + stride, np.float32(offset - 1.0)
    if offset < -1.0:
        cell, offset = cell - stride, np.float32(offset + 1.0)
    return cell, offset


@njit(cache=True, nogil=True)
def leaves_map(potential: NDArray[np.float32], size_x: int, cell: int) -> bool:
    """Tell whether a cell of float32[n] is in the lowest or highest row, where descents end."""
    return cell < size_x or cell > potential.size - size_x


@njit(cache=True, nogil=True)
def step_down(
    potential: NDArray[np.float32],
    size_x: int,
    around: Surroundings,
    cell: int,
    dx: np.float32,
    dy: np.float32,
    path: NDArray[np.float32],
    last: int,
) -> Tuple[bool, int, np.float32, np.float32]:
    """Return the next position of a descent of float32[n]: whether there is one, cell, dx and dy.

    The step is half a cell along the gradient where all cells around are reached, otherwise to the
    centre of the lowest of them; so too when the path, float32[k, 2], is where it was two points
    before its last row.
    """
    lowest, all_reached, x00, y00, x10, y10, x01, y01, x11, y11 = around
    oscillates = (
        last > 1 and path[last, 0] == path[last - 2, 0] and path[last, 1] == path[last - 2, 1]
    )
    if oscillates or not all_reached:
        return potential[lowest] < NOT_REACHED, lowest, np.float32(0.0), np.float32(0.0)
    gx = _blend(dy, _blend(dx, x00, x10), _blend(dx, x01, x11))
    gy = _blend(dy, _blend(dx, y00, y10), _blend(dx, y01, y11))
    if gx == 0.0 and gy == 0.0:
        return False, cell, dx, dy
    scale = _STEP_CELLS / _length(gx, gy)
    cell, dx = _carry(cell, dx + gx * scale, 1)
    cell, dy = _carry(cell, dy + gy * scale, size_x)
    return True, cell, dx, dy


@njit(cache=True, nogil=True)
def _nearest(cell: int, dx: np.float32, dy: np.float32, size_x: int, size: int) -> int:
    """Return the flat cell nearest to a point, halves rounded away from zero."""
    step_x = int(math.copysign(math.floor(abs(dx) + 0.5), dx))
    step_y = int(math.copysign(math.floor(abs(dy) + 0.5), dy))
    return max(0, min(size - 1, cell + step_x + size_x * step_y))


@njit(cache=True, nogil=True)
def descend(
    potential: NDArray[np.float32], size_x: int, start: int, source: int, path: NDArray[np.float32]
) -> Tuple[int, bool]:
    """Follow NavFn's potential, float32[n], down in half-cell steps to the wave's source.

    The path, float32[k, 2], is filled with cells (x, y).

    Returns:
        The number of points written, and True if the source was reached.
    """
    cell, dx, dy = start, np.float32(0.0), np.float32(0.0)
    around, known = surroundings(potential, size_x, cell), cell
    for k in range(path.shape[0]):
        if potential[_nearest(cell, dx, dy, size_x, potential.size)] < NEUTRAL:
            path[k, 0], path[k, 1] = source % size_x, source // size_x
            return k + 1, True
        if leaves_map(potential, size_x, cell):
            return k, False
        path[k, 0] = np.float32(np.float32(cell % size_x) + dx)
        path[k, 1] = np.float32(np.float32(cell // size_x) + dy)
        if cell != known:
            around, known = surroundings(potential, size_x, cell), cell
        goes_on, cell, dx, dy = step_down(potential, size_x, around, cell, dx, dy, path, k)
        if not goes_on:
            return k + 1, False
    return path.shape[0], False
