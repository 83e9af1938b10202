"""NavFn's own loop: the descent from the goal's cell to the robot's.

The wavefront is in ``wave.py``, the maths in ``plan/navfn.py``.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from quad_nav.kernels.descent import leaves_map, step_down

OBSTACLE = 254  # cells of this cost are never entered
NEUTRAL = 50  # cost of a free cell


@njit(cache=True, nogil=True)
def _nearest(cell, dx, dy, size_x, size):
    """The cell nearest to the point, halves rounded away from zero."""
    step_x = int(math.copysign(math.floor(abs(dx) + 0.5), dx))
    step_y = int(math.copysign(math.floor(abs(dy) + 0.5), dy))
    return max(0, min(size - 1, cell + step_x + size_x * step_y))


@njit(cache=True, nogil=True)
def descend(potential, size_x, start, source, path):
    """Follow the potential down from ``start`` in half-cell steps into ``path``.

    ``path`` is float32[n, 2], cells (x, y). Returns the number of points
    written and whether the source was reached.
    """
    cell, dx, dy = start, np.float32(0.0), np.float32(0.0)
    for k in range(path.shape[0]):
        if potential[_nearest(cell, dx, dy, size_x, potential.size)] < NEUTRAL:
            path[k, 0], path[k, 1] = source % size_x, source // size_x
            return k + 1, True
        if leaves_map(potential, size_x, cell):
            return k, False
        path[k, 0], path[k, 1] = cell % size_x + dx, cell // size_x + dy
        goes_on, cell, dx, dy = step_down(potential, size_x, cell, dx, dy, path, k)
        if not goes_on:
            return k + 1, False
    return path.shape[0], False
