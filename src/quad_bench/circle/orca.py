"""ORCA's velocities, from the package ``pyrvo``: the baseline.

Every robot knows the exact positions and velocities of all others. Each takes half of what two
robots need to avoid each other, and the velocity nearest to the preferred one that all others
leave it.

Source: J. van den Berg, S. J. Guy, M. Lin, D. Manocha, "Reciprocal n-Body Collision Avoidance",
ISRR 2009; its library RVO2.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError

Floats = NDArray[np.float64]

HORIZON_S = 10.0
_NEIGHBOURS = 10
"""Both as in the library's own example of a circle."""


@dataclass(frozen=True)
class OrcaParams:
    """Parameters of all robots.

    Attributes:
        radius_m: Radius that each keeps free.
        speed_mps: Greatest and preferred speed.
        period_s: Time between two velocities.
        horizon_s: Time for which velocities are free of collisions.
    """

    radius_m: float
    speed_mps: float
    period_s: float
    horizon_s: float = HORIZON_S

    @property
    def reach_m(self) -> float:
        """Distance from which two robots can meet within the horizon."""
        return 2.0 * (self.speed_mps * self.horizon_s + self.radius_m)


def load_pyrvo() -> Any:
    """Import the package.

    Raises:
        InputError: It is not installed.
    """
    try:
        return importlib.import_module("pyrvo")
    except ImportError as error:
        raise InputError(
            [
                f"--method orca, orca-points: cannot import pyrvo: {error}; expected "
                "pip install 'quad-nav[orca]' with Python 3.9 or newer, or only --method quad"
            ]
        ) from error


class Orca:
    """Velocities of robots that all follow ORCA to their goals."""

    def __init__(self, params: OrcaParams, positions_m: Floats, goals_m: Floats) -> None:
        """Place the robots.

        Args:
            params: Parameters.
            positions_m: float64[n, 2], positions in ``map``.
            goals_m: float64[n, 2], goals in ``map``.
        """
        self._params = params
        self._goals_m = goals_m
        self._agents = load_pyrvo().RVOSimulator(
            params.period_s,
            params.reach_m,
            _NEIGHBOURS,
            params.horizon_s,
            params.horizon_s,
            params.radius_m,
            params.speed_mps,
        )
        for position in positions_m:
            self._agents.add_agent(position.tolist())

    def step(self, positions_m: Floats, velocities_mps: Floats) -> Floats:
        """Return the velocities float64[n, 2] of robots for the next period.

        Args:
            positions_m: float64[n, 2], positions in ``map``.
            velocities_mps: float64[n, 2], velocities in ``map``.
        """
        for k, preferred in enumerate(self.preferred_mps(positions_m)):
            self._agents.set_agent_position(k, positions_m[k].tolist())
            self._agents.set_agent_velocity(k, velocities_mps[k].tolist())
            self._agents.set_agent_pref_velocity(k, preferred.tolist())
        self._agents.do_step()
        found = [self._agents.get_agent_velocity(k) for k in range(len(positions_m))]
        return np.array([(one.x, one.y) for one in found])

    def preferred_mps(self, positions_m: Floats) -> Floats:
        """Return velocities straight to the goals, as fast as allowed without passing them."""
        ways_m = self._goals_m - positions_m
        lengths_m = np.hypot(*ways_m.T)[:, None]
        speeds_mps = np.minimum(self._params.speed_mps, lengths_m / self._params.period_s)
        return ways_m / np.maximum(lengths_m, 1e-9) * speeds_mps
