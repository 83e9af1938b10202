"""What keeps the controller from turning left and right for ever.

Turning or strafing without moving forward is remembered until the robot has
moved; a direction that was already tried is then not taken again. Backing out
("escaping") likewise lasts until the robot has moved or turned far enough.
"""

from __future__ import annotations

from dataclasses import dataclass

from quad_nav.control.rollout import Triple
from quad_nav.geometry import Pose2D, angle_difference


@dataclass
class Oscillation:
    """Changed by every choice of a trajectory, kept from plan to plan."""

    rotating_left: bool = False
    rotating_right: bool = False
    stuck_left: bool = False
    stuck_right: bool = False
    strafe_left: bool = False
    strafe_right: bool = False
    stuck_left_strafe: bool = False
    stuck_right_strafe: bool = False
    escaping: bool = False
    since: Pose2D = Pose2D(0.0, 0.0, 0.0)  # where it last turned or strafed
    escape_from: Pose2D = Pose2D(0.0, 0.0, 0.0)  # where it last began to back out

    def note_turn(self, sample: Triple, pose: Pose2D) -> None:
        """A trajectory chosen from the forward and in-place samples."""
        vx, vy, vtheta = sample
        if vx > 0.0:
            return
        if vtheta < 0.0:
            self.stuck_right = self.stuck_right or self.rotating_right
            self.rotating_right = True
        elif vtheta > 0.0:
            self.stuck_left = self.stuck_left or self.rotating_left
            self.rotating_left = True
        elif vy > 0.0:
            self.stuck_right_strafe = self.stuck_right_strafe or self.strafe_right
            self.strafe_right = True
        elif vy < 0.0:
            self.stuck_left_strafe = self.stuck_left_strafe or self.strafe_left
            self.strafe_left = True
        self.since = pose

    def note_strafe(self, sample: Triple, pose: Pose2D) -> None:
        """A trajectory chosen from the sideways samples."""
        vx, vy, _ = sample
        if vx > 0.0:
            return
        if vy > 0.0:
            self.stuck_right_strafe = self.stuck_right_strafe or self.strafe_right
            self.strafe_left = True
        elif vy < 0.0:
            self.stuck_left_strafe = self.stuck_left_strafe or self.strafe_left
            self.strafe_right = True
        self.since = pose

    def begin_escape(self, pose: Pose2D) -> None:
        if not self.escaping:
            self.escape_from = pose
            self.escaping = True

    def forget_if_moved(self, pose: Pose2D, reset_dist_m: float) -> None:
        if self.since.distance_to(pose) > reset_dist_m:
            self.rotating_left = self.rotating_right = False
            self.stuck_left = self.stuck_right = False
            self.strafe_left = self.strafe_right = False
            self.stuck_left_strafe = self.stuck_right_strafe = False

    def end_escape_if_moved(
        self, pose: Pose2D, reset_dist_m: float, reset_theta_rad: float
    ) -> None:
        turned_rad = abs(angle_difference(pose.yaw_rad, self.escape_from.yaw_rad))
        if self.escape_from.distance_to(pose) > reset_dist_m or turned_rad > reset_theta_rad:
            self.escaping = False
