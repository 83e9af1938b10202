"""How near quadcopters came to things and to each other.

Positions are gathered and compared in blocks: one comparison of arrays costs about
as much as one of two numbers, and a long flight needs no more memory than a short one.
"""

from __future__ import annotations

from typing import List

import numpy as np

from quad_nav.offline.flight import Flight
from quad_nav.offline.observer import FlightObserver
from quad_nav.sim.scene import Scene

_BLOCK = 512  # positions of all quadcopters per comparison


class Gaps(FlightObserver):
    """Smallest distances so far, between hulls: discs of ``radius_m`` around the centres.

    ``clearances_m`` float64[n]: to an obstacle or a wall, at the flying altitude.
    ``separations_m`` float64[n]: to another quadcopter; +inf when there is none. Both are
    up to date after ``ended``.
    """

    def __init__(self, scene: Scene, robots: int, radius_m: float):
        self._scene = scene
        self._radius_m = radius_m
        self._waiting: List[np.ndarray] = []
        self.clearances_m = np.full(robots, np.inf)
        self.separations_m = np.full(robots, np.inf)

    def moved(self, flight: Flight) -> None:
        self._waiting.append(flight.simulation.body_state.positions_m)
        if len(self._waiting) == _BLOCK:
            self._compare()

    def ended(self, flight: Flight) -> None:
        self._compare()

    def _compare(self) -> None:
        if not self._waiting:
            return
        positions = np.array(self._waiting)[:, :, :2]
        self._waiting = []
        nearest_m = [
            self._scene.flight_clearances_m(positions[:, robot]).min()
            for robot in range(positions.shape[1])
        ]  # each is near few obstacles
        self.clearances_m = np.minimum(self.clearances_m, np.array(nearest_m) - self._radius_m)
        distance_m = _nearest_other_m(positions) - 2 * self._radius_m
        self.separations_m = np.minimum(self.separations_m, distance_m)


def _nearest_other_m(positions: np.ndarray) -> np.ndarray:
    """Smallest distance float64[n] to another body at the same time; positions [t, n, 2]."""
    nearest = np.full(positions.shape[1], np.inf)
    for k in range(1, positions.shape[1]):
        apart = positions[:, :-k] - positions[:, k:]
        smallest = np.sqrt(np.min(np.sum(apart * apart, axis=2), axis=0))
        nearest[:-k] = np.minimum(nearest[:-k], smallest)
        nearest[k:] = np.minimum(nearest[k:], smallest)
    return nearest
