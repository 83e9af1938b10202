"""Random numbers of amcl: drand48, and normal numbers made of it.

A state is uint64[1] with the 48 bits of the generator. Equal states give equal particles.

Source: POSIX, ``drand48``; G. Marsaglia, T. Bray, "A Convenient Method for Generating Normal
Variables", SIAM Review 6, 1964.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

State = NDArray[np.uint64]

_FACTOR, _SUMMAND, _MASK = np.uint64(0x5DEECE66D), np.uint64(0xB), np.uint64(2**48 - 1)
_SCALE = 2.0**-48


def seeded(seed: int) -> State:
    """Return the state after ``srand48(seed)``."""
    return np.array([((seed % 2**32) << 16) + 0x330E], np.uint64)


@njit(cache=True, nogil=True)
def uniform(state: State) -> float:
    """Draw a number in [0, 1)."""
    state[0] = (_FACTOR * state[0] + _SUMMAND) & _MASK
    return np.float64(state[0]) * _SCALE


@njit(cache=True, nogil=True)
def normals(state: State, count: int) -> NDArray[np.float64]:
    """Draw numbers float64[count] with mean 0 and deviation 1, by the polar method."""
    drawn, k = np.empty(count), 0
    while k < count:
        a = b = 0.0
        while a == 0.0:
            a = uniform(state)
        while b == 0.0:
            b = uniform(state)
        a, b = 2.0 * a - 1.0, 2.0 * b - 1.0
        w = a * a + b * b
        if 0.0 < w <= 1.0:
            drawn[k] = b * math.sqrt(-2.0 * math.log(w) / w)
            k += 1
    return drawn
