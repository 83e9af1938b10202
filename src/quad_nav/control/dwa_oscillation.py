"""What keeps the dynamic window controller from going to and fro for ever.

A command that reverses the direction of an earlier one forbids the direction
given up, until the robot has moved or turned far enough. Sideways motion and
turns count only while the robot hardly moves forward.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.rollout import Triple
from quad_nav.geometry import Pose2D


@dataclass
class Axis:
    """One component of the velocity: where it last went, and where alone it may go."""

    going_positive: bool = False
    going_negative: bool = False
    positive_only: bool = False
    negative_only: bool = False

    def note(self, velocity: float) -> bool:
        """Remembers a command; whether it was a reversal."""
        if velocity == 0.0:
            return False
        forwards = velocity > 0.0
        reversal = self.going_negative if forwards else self.going_positive
        self.positive_only = self.positive_only or (reversal and forwards)
        self.negative_only = self.negative_only or (reversal and not forwards)
        self.going_positive, self.going_negative = forwards, not forwards
        return reversal

    @property
    def is_restricted(self) -> bool:
        return self.positive_only or self.negative_only

    def forbids(self, velocities: NDArray[np.float64]) -> NDArray[np.bool_]:
        return ((velocities < 0.0) & self.positive_only) | ((velocities > 0.0) & self.negative_only)


class OscillationCritic:
    """Changed by every choice of a trajectory; a new plan and a stop at the goal reset it."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self.forward, self.strafe, self.turn = Axis(), Axis(), Axis()
        self.reversed_at = Pose2D(0.0, 0.0, 0.0)

    @property
    def axes(self) -> Tuple[Axis, Axis, Axis]:
        return self.forward, self.strafe, self.turn

    def forbids(self, commands: NDArray[np.float64]) -> NDArray[np.bool_]:
        """bool[n]: which commands, float64[n, 3], go where they may not."""
        forbidden = [axis.forbids(commands[:, k]) for k, axis in enumerate(self.axes)]
        return np.logical_or.reduce(forbidden)

    def note(
        self,
        command: Triple,
        pose: Pose2D,
        slow_mps: float,
        reset_dist_m: float,
        reset_angle_rad: float,
    ) -> None:
        """A chosen command; ``slow_mps`` is the forward speed up to which all axes count."""
        reversals = [self.forward.note(command[0])]
        if abs(command[0]) <= slow_mps:
            reversals += [self.strafe.note(command[1]), self.turn.note(command[2])]
        if any(reversals):
            self.reversed_at = pose
        if any(axis.is_restricted for axis in self.axes):
            turned_rad = abs(pose.yaw_rad - self.reversed_at.yaw_rad)  # the original does not wrap
            if self.reversed_at.distance_to(pose) > reset_dist_m or turned_rad > reset_angle_rad:
                self.reset()
