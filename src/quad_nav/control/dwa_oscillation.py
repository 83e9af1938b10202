"""Oscillation critic: keeps the dynamic window controller from going back and forth.

A command that reverses the direction of an earlier one forbids the direction given up, until the
robot has moved or turned far enough. Sideways motion and turns count only while the robot hardly
moves forward.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

from quad_nav.control.dwa_search import Directions
from quad_nav.costmap.collision import Triple
from quad_nav.geometry import Pose2D


@dataclass
class Axis:
    """Component of the velocity: its last direction, and the only direction allowed.

    Attributes:
        going_positive: The last command was positive.
        going_negative: The last command was negative.
        positive_only: Negative commands are forbidden.
        negative_only: Positive commands are forbidden.
    """

    going_positive: bool = False
    going_negative: bool = False
    positive_only: bool = False
    negative_only: bool = False

    def record(self, velocity: float) -> bool:
        """Record a command; return True if it was a reversal."""
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
        """True if a direction is forbidden."""
        return self.positive_only or self.negative_only


class OscillationCritic:
    """State of the critic; every chosen trajectory changes it, a new plan and a goal reset it."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Allow every direction."""
        self.forward, self.strafe, self.turn = Axis(), Axis(), Axis()
        self.reversed_at = Pose2D(0.0, 0.0, 0.0)

    @property
    def axes(self) -> Tuple[Axis, Axis, Axis]:
        """Forward, sideways and turning axis."""
        return self.forward, self.strafe, self.turn

    @property
    def directions(self) -> Directions:
        """Directions that are allowed."""
        x, y, theta = self.axes
        return Directions(
            (x.positive_only, y.positive_only, theta.positive_only),
            (x.negative_only, y.negative_only, theta.negative_only),
        )

    def record(
        self,
        command: Triple,
        pose: Pose2D,
        slow_mps: float,
        reset_dist_m: float,
        reset_angle_rad: float,
    ) -> None:
        """Record a chosen command (vx, vy, vtheta) at a pose in the local costmap's frame.

        Up to a forward speed of ``slow_mps`` sideways motion and turns count. All is allowed again
        at a distance, or after a turn, from the last reversal.
        """
        reversals = [self.forward.record(command[0])]
        if abs(command[0]) <= slow_mps:
            reversals += [self.strafe.record(command[1]), self.turn.record(command[2])]
        if any(reversals):
            self.reversed_at = pose
        if any(axis.is_restricted for axis in self.axes):
            turned_rad = abs(pose.yaw_rad - self.reversed_at.yaw_rad)  # upstream does not wrap
            if self.reversed_at.distance_to(pose) > reset_dist_m or turned_rad > reset_angle_rad:
                self.reset()
