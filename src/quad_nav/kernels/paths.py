"""Where a robot is on its way after some distances."""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def sample_path(start, way, travelled):
    """Places float64[k, 2] after distances float64[k] on a way.

    It leads from start, float64[2], to the point of way, float64[n, 2], n >= 1, after the
    nearest one, and on from there; behind its end everything is at the end.
    """
    nearest, nearest2 = 0, np.inf
    for k in range(way.shape[0]):
        distance2 = (way[k, 0] - start[0]) ** 2 + (way[k, 1] - start[1]) ** 2
        if distance2 < nearest2:
            nearest, nearest2 = k, distance2
    first = min(nearest + 1, way.shape[0] - 1)
    places = np.empty((travelled.shape[0], 2))
    for i in range(travelled.shape[0]):
        left = travelled[i]
        x, y = start[0], start[1]
        for k in range(first, way.shape[0]):
            dx, dy = way[k, 0] - x, way[k, 1] - y
            length = math.sqrt(dx * dx + dy * dy)
            if left < length:
                x += dx * (left / length)
                y += dy * (left / length)
                break
            left -= length
            x, y = way[k, 0], way[k, 1]
        places[i, 0], places[i, 1] = x, y
    return places
