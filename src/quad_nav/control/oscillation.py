"""Oscillation state of the trajectory planner: keeps it from turning left and right for ever.

The planner remembers turning or strafing without moving forward until the robot has moved, and
does not take again a direction that it has tried. Backing out ("escaping") likewise lasts until
the robot has moved or turned far enough.
"""

from __future__ import annotations

from dataclasses import dataclass

from quad_nav.costmap.collision import Triple
from quad_nav.geometry import Pose2D, angle_difference


@dataclass
class Oscillation:
    """State that every chosen trajectory changes, kept from plan to plan.

    Attributes:
        since: Pose of the last turn or sideways motion.
        escape_from: Pose where the robot last began to back out.
    """

    rotating_left: bool = False
    rotating_right: bool = False
    stuck_left: bool = False
    stuck_right: bool = False
    strafe_left: bool = False
    strafe_right: bool = False
    stuck_left_strafe: bool = False
    stuck_right_strafe: bool = False
    escaping: bool = False
    since: Pose2D = Pose2D(0.0, 0.0, 0.0)
    escape_from: Pose2D = Pose2D(0.0, 0.0, 0.0)

    def record_turn(self, sample: Triple, pose: Pose2D) -> None:
        """Record a trajectory chosen from the forward and in-place samples."""
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

    def record_strafe(self, sample: Triple, pose: Pose2D) -> None:
        """Record a trajectory chosen from the sideways samples."""
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
        """Start to back out, unless it has started."""
        if not self.escaping:
            self.escape_from = pose
            self.escaping = True

    def forget_if_moved(self, pose: Pose2D, reset_dist_m: float) -> None:
        """Allow every direction again once the robot has moved."""
        if self.since.distance_to(pose) > reset_dist_m:
            self.rotating_left = self.rotating_right = False
            self.stuck_left = self.stuck_right = False
            self.strafe_left = self.strafe_right = False
            self.stuck_left_strafe = self.stuck_right_strafe = False

    def end_escape_if_moved(
        self, pose: Pose2D, reset_dist_m: float, reset_theta_rad: float
    ) -> None:
        """Stop backing out once the robot has moved or turned."""
        turned_rad = abs(angle_difference(pose.yaw_rad, self.escape_from.yaw_rad))
        if self.escape_from.distance_to(pose) > reset_dist_m or turned_rad > reset_theta_rad:
            self.escaping = False
