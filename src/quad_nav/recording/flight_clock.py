"""Times of a recorded flight from times of recording."""

from __future__ import annotations

from typing import Sequence, Tuple

import numpy as np
from numpy.typing import NDArray


class FlightClock:
    """Converts times of recording to times of the flight.

    A recorder that was started before the simulation stores wall times: ``/clock`` counts.

    Args:
        clocks_ns: Time of recording, and time on ``/clock``, of each of its messages.
        start_s: Start of the flight on the recording's clock.
    """

    def __init__(self, clocks_ns: Sequence[Tuple[int, int]], start_s: float) -> None:
        self._clocks_ns = np.array(clocks_ns, np.int64).reshape(-1, 2)
        self._start_s = start_s

    def times_s(self, stamps_ns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the last times on ``/clock`` before times of recording, float64[n], in order."""
        if len(self._clocks_ns):
            numbers = np.searchsorted(self._clocks_ns[:, 0], stamps_ns, side="right") - 1
            stamps_ns = self._clocks_ns[np.maximum(numbers, 0), 1]
        times_s: NDArray[np.float64] = np.maximum.accumulate(stamps_ns / 1e9 - self._start_s)
        return times_s
