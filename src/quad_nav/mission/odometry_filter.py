"""Odometry filter: drops positions that no flight explains, until they last.

Any node can publish on an odometry topic, and a sensor may fail for a moment. A single message
that is far from the one before is dropped. Odometry that stays elsewhere is accepted after
``JUMP_RECOVERY_S``: an estimator that restarts begins at another position. A reset of the
simulation is not guessed from odometry; the simulator reports it.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

STEP_M, JUMP_MPS = 0.25, 5.0
"""A step that is longer than this distance, and faster than this speed, is a jump."""
JUMP_RECOVERY_S = 1.0
"""Odometry that has jumped is accepted after it has been continuous for so long."""


class OdometrySample(NamedTuple):
    """Position of the robot in an odometry frame at a time."""

    stamp_s: float
    frame: str
    x_m: float
    y_m: float

    def jumps_from(self, before: OdometrySample) -> bool:
        """Return whether no flight leads here from an earlier sample."""
        if self.frame != before.frame:
            return True
        most_m = max(STEP_M, JUMP_MPS * (self.stamp_s - before.stamp_s))
        return not math.hypot(self.x_m - before.x_m, self.y_m - before.y_m) <= most_m


class OdometryFilter:
    """Accepts or drops the odometry of one robot, in the order in which it arrives.

    Attributes:
        is_jumping: The last sample was dropped, and none has been accepted since.
        has_relocated: The last accepted sample ended a jump: no path leads there.
    """

    def __init__(self) -> None:
        self._last: Optional[OdometrySample] = None
        self._elsewhere: Optional[OdometrySample] = None  # the last one dropped
        self._elsewhere_since_s = 0.0
        self.has_relocated = False

    @property
    def is_jumping(self) -> bool:
        """True while only samples elsewhere arrive."""
        return self._elsewhere is not None

    def accepts(self, sample: OdometrySample) -> bool:
        """Return whether to use a sample."""
        self.has_relocated = False
        if self._last is not None and sample.jumps_from(self._last):
            if self._elsewhere is None or sample.jumps_from(self._elsewhere):
                self._elsewhere_since_s = sample.stamp_s
            self._elsewhere = sample
            if sample.stamp_s - self._elsewhere_since_s < JUMP_RECOVERY_S:
                return False
            self.has_relocated = True
        self._last, self._elsewhere = sample, None
        return True

    def accepts_track(
        self, stamps_s: NDArray[np.float64], frame: str, positions_m: NDArray[np.float64]
    ) -> Tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Apply `accepts` to samples in the order in which they arrived.

        Args:
            stamps_s: float64[n], times of the samples.
            frame: Frame of all samples.
            positions_m: float64[n, 2], positions in the frame.

        Returns:
            Masks bool[n] of the accepted samples and of those that ended a jump.
        """
        accepted = np.ones(len(stamps_s), np.bool_)
        relocated = np.zeros(len(stamps_s), np.bool_)
        steps_m = np.diff(positions_m, axis=0)
        most_m = np.maximum(STEP_M, JUMP_MPS * np.diff(stamps_s))
        is_continuous = bool((np.hypot(steps_m[:, 0], steps_m[:, 1]) <= most_m).all())
        last = len(stamps_s) - 1
        for n in range(last + 1):
            accepted[n] = self.accepts(_sample(stamps_s[n], frame, positions_m[n]))
            relocated[n] = self.has_relocated
            if is_continuous and accepted[n] and n < last:  # so are all that follow
                self._last = _sample(stamps_s[last], frame, positions_m[last])
                self.has_relocated = False
                break
        return accepted, relocated


def _sample(stamp_s: np.float64, frame: str, position_m: NDArray[np.float64]) -> OdometrySample:
    return OdometrySample(float(stamp_s), frame, *position_m.tolist())
