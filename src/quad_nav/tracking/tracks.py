"""Tracks of moving obstacles at one time, and the parameters of the tracker."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D
from quad_nav.parameter import flag, number

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class TrackerParams:
    """Parameters of the tracking of moving obstacles, see ``docs/moving_obstacles.md``.

    Attributes:
        max_acceleration_mps2: Greatest acceleration of an obstacle for passive safety; above 0
            what may walk on or in is told as well, see ``Tracks.suspects``.
    """

    track_moving_obstacles: bool = flag(
        "track_moving_obstacles", False, "Track what moves in the scans of LIDARs.", upstream=False
    )
    range_m: float = number("range", 10.0, "metres", 0, 100, "Greatest range of tracked obstacles.")
    min_speed_mps: float = number(
        "min_speed", 0.2, "metres/s", 0, 5, "Slower obstacles count as standing."
    )
    max_radius_m: float = number(
        "max_radius", 1.0, "metres", 0, 10, "Larger obstacles count as standing."
    )
    acceleration_mps2: float = number(
        "acceleration", 1.5, "metres/s^2", 0, 20, "Deviation of accelerations."
    )
    lost_after_s: float = number(
        "timeout", 1.5, "seconds", 0, 60, "Hidden obstacles are kept so long."
    )
    margin_m: float = number(
        "margin", 0.12, "metres", 0, 1, "A point moves that is so far in free space."
    )
    max_acceleration_mps2: float = number(
        "max_acceleration", 0.0, "metres/s^2", 0, 100, "Obstacles' greatest; 0: no passive safety."
    )


@dataclass(frozen=True)
class Tracks:
    """Moving obstacles at one time, as upright discs with a constant velocity.

    Attributes:
        time_s: Time of the states.
        numbers: int64[n], a number for each obstacle, kept from scan to scan.
        states: float64[n, 4]: x and y, m, and their velocities, m/s, in one fixed frame.
        covariances: float64[n, 4, 4] of the states.
        radii_m: float64[n], radii of the discs that hold the obstacles.
        suspects: float64[k, 5], rows x, y, vx, vy and radius of what is no track, but may move:
            obstacles that have stopped, and what moves for the first time.
    """

    time_s: float
    numbers: NDArray[np.int64]
    states: Floats
    covariances: Floats
    radii_m: Floats
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
        )

    def __len__(self) -> int:
        return len(self.numbers)

    @property
    def any_may_move(self) -> bool:
        """True if there is a track or a suspect."""
        return bool(len(self.numbers) or len(self.suspects))

    @property
    def position_variances(self) -> Floats:
        """Mean variances of the positions along x and y, float64[n]."""
        return self._mean_variances(0)

    @property
    def velocity_variances(self) -> Floats:
        """Mean variances of the velocities along x and y, float64[n]."""
        return self._mean_variances(2)

    def _mean_variances(self, first: int) -> Floats:
        along_x, along_y = (self.covariances[:, k, k] for k in (first, first + 1))
        means: Floats = (along_x + along_y) / 2.0
        return means

    def chosen(self, rows: NDArray[np.bool_]) -> Tracks:
        """Return some of the obstacles, bool[n]."""
        return replace(
            self,
            numbers=self.numbers[rows],
            states=self.states[rows],
            covariances=self.covariances[rows],
            radii_m=self.radii_m[rows],
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
