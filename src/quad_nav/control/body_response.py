"""Response of a body to velocity commands: a velocity loop with a lag, and a limit."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

_PARTS = 2  # steps of a short motion


class Body(NamedTuple):
    """Response of the body to a velocity command, see ``control/evasion.py``."""

    gain_per_s: float  # of the velocity loop
    lag_s: float  # of the acceleration
    acceleration_mps2: float  # greatest


@njit(cache=True, nogil=True)
def move_bodies(
    body: Body, moving: NDArray[np.float64], commands: NDArray[np.float64], duration_s: float
) -> None:
    """Move bodies, each under a command, by a short duration.

    Args:
        body: Response of the bodies.
        moving: float64[6, c], positions, velocities and accelerations along x and y.
        commands: float64[c, 2], velocities in m/s.
        duration_s: A few hundredths of a second.
    """
    x, y, vx, vy, ax, ay = moving
    dt = duration_s / _PARTS
    rest = math.exp(-dt / body.lag_s)
    for _ in range(_PARTS):
        for n in range(len(commands)):
            wanted_x = body.gain_per_s * (commands[n, 0] - vx[n])
            wanted_y = body.gain_per_s * (commands[n, 1] - vy[n])
            wanted = math.sqrt(wanted_x * wanted_x + wanted_y * wanted_y)
            shorten = body.acceleration_mps2 / max(wanted, body.acceleration_mps2)
            ax[n] = shorten * wanted_x + (ax[n] - shorten * wanted_x) * rest
            ay[n] = shorten * wanted_y + (ay[n] - shorten * wanted_y) * rest
            x[n] += dt * (vx[n] + 0.5 * dt * ax[n])
            y[n] += dt * (vy[n] + 0.5 * dt * ay[n])
            vx[n] += dt * ax[n]
            vy[n] += dt * ay[n]


@njit(cache=True, nogil=True)
def rest_s(body: Body, speed_mps: float) -> float:
    """Return for how long a body would fly on at its speed to get as far as it does until it rests.

    Below the speed from which its velocity loop brakes with less than its greatest acceleration,
    the way to rest is that of an exponential decay.
    """
    over = max(speed_mps - body.acceleration_mps2 / body.gain_per_s, 0.0)
    braking_s = 0.5 * over * over / body.acceleration_mps2 / max(speed_mps, 1e-9)
    return 1.0 / body.gain_per_s + braking_s
