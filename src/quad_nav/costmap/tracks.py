"""Tracks of moving obstacles at one time: what a scan filter tells command filters of them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Tracks:
    """Moving obstacles at one time, as upright discs with a constant velocity.

    They are in the local costmap's frame.

    Attributes:
        time_s: Time of the states.
        numbers: int64[n], a number for each obstacle, kept from scan to scan.
        states: float64[n, 4]: x and y, m, and their velocities, m/s.
        covariances: float64[n, 4, 4] of the states.
        radii_m: float64[n], radii of the discs that hold the obstacles.
        unseen_s: float64[n], times for which the obstacles have not been seen, but predicted.
        suspects: float64[k, 5], rows x, y, vx, vy and radius of what is no track, but may move:
            obstacles that have stopped, and what moves for the first time.
    """

    time_s: float
    numbers: NDArray[np.int64]
    states: Floats
    covariances: Floats
    radii_m: Floats
    unseen_s: Floats
    suspects: Floats = field(default_factory=lambda: np.empty((0, 5)))

    @classmethod
    def none(cls, time_s: float) -> Tracks:
        """Return no tracks."""
        return cls(
            time_s,
            np.empty(0, np.int64),
            np.empty((0, 4)),
            np.empty((0, 4, 4)),
            np.empty(0),
            np.empty(0),
        )

    def __len__(self) -> int:
        return len(self.numbers)

    @property
    def any_may_move(self) -> bool:
        """True if there is a track or a suspect."""
        return bool(len(self.numbers) or len(self.suspects))

    def chosen(self, rows: NDArray[np.bool_]) -> Tracks:
        """Return some of the obstacles, bool[n]."""
        return replace(
            self,
            numbers=self.numbers[rows],
            states=self.states[rows],
            covariances=self.covariances[rows],
            radii_m=self.radii_m[rows],
            unseen_s=self.unseen_s[rows],
        )

    def at(self, time_s: float) -> Tracks:
        """Return the obstacles where they are at another time if they keep their velocities.

        The covariances grow with the uncertainty of the velocities only.
        """
        step = np.eye(4)
        step[0, 2] = step[1, 3] = time_s - self.time_s
        suspects = self.suspects.copy()
        suspects[:, :4] = suspects[:, :4] @ step.T
        return replace(
            self,
            time_s=time_s,
            states=self.states @ step.T,
            covariances=step @ self.covariances @ step.T,
            suspects=suspects,
        )

    def transformed(self, a_from_b: Pose2D) -> Tracks:
        """Return the tracks in frame a, of tracks in frame b; neither frame moves."""
        turn = np.kron(
            np.eye(2), np.column_stack([a_from_b.rotate(1.0, 0.0), a_from_b.rotate(0.0, 1.0)])
        )
        return replace(
            self,
            states=_transformed(a_from_b, self.states),
            covariances=turn @ self.covariances @ turn.T,
            suspects=np.column_stack(
                [_transformed(a_from_b, self.suspects[:, :4]), self.suspects[:, 4]]
            ),
        )


def _transformed(a_from_b: Pose2D, states: Floats) -> Floats:
    """Return states in frame a, float64[n, 4], of states in frame b."""
    x, y, vx, vy = states.T
    return np.column_stack([*a_from_b.transform(x, y), *a_from_b.rotate(vx, vy)])
