"""State of a vehicle as its autopilot reports it, in ROS's axes and without the autopilot's codes.

An adapter for each kind of vehicle fills these in; the state machine reads nothing else.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Optional, Tuple

from quad_nav.geometry import Pose3D, Quaternion, rotate

Vector = Tuple[float, float, float]


class Landed(enum.IntEnum):
    """Where the vehicle is, with the numbers of MAVLink's ``MAV_LANDED_STATE``."""

    UNKNOWN = 0
    ON_GROUND = 1
    IN_AIR = 2
    TAKING_OFF = 3
    LANDING = 4


@dataclass(frozen=True)
class Status:
    """What the autopilot does.

    Attributes:
        mode: Name of the flight mode, for people.
        is_controlled: Whether the autopilot obeys our set-points in this mode.
        is_landing: Whether the mode is the one that our order to land sets.
        is_armed: Whether the motors are armed.
        is_settling: Whether the mode is one that the autopilot passes through by itself on the way
            to ours, such as PX4's take-off; it is no change from outside.
    """

    mode: str
    is_controlled: bool
    is_landing: bool
    is_armed: bool
    is_settling: bool = False


@dataclass(frozen=True)
class Estimate:
    """Pose and velocity of the vehicle at one time.

    Attributes:
        stamp_s: Time of the estimate on our clock.
        odom_from_base: Pose of the body in the odometry frame, ENU axes.
        linear_mps: Velocity (x, y, z) in the body frame, FLU axes.
        angular_radps: Angular velocity (x, y, z) in the body frame, FLU axes.
    """

    stamp_s: float
    odom_from_base: Pose3D
    linear_mps: Vector = (0.0, 0.0, 0.0)
    angular_radps: Vector = (0.0, 0.0, 0.0)

    @classmethod
    def of(
        cls,
        stamp_s: float,
        position_m: Vector,
        quaternion: Quaternion,
        velocity: Vector,
        turn: Vector,
    ) -> Estimate:
        """Make an estimate from a velocity in the odometry frame, and a turn in the body's."""
        x, y, z, w = quaternion
        linear_mps = rotate((-x, -y, -z, w), velocity)
        return cls(stamp_s, Pose3D(*position_m, quaternion), linear_mps, turn)

    @property
    def is_finite(self) -> bool:
        """True if no number is infinite or NaN."""
        pose = self.odom_from_base
        numbers = (pose.x_m, pose.y_m, pose.z_m, *pose.quaternion)
        return all(map(math.isfinite, (*numbers, *self.linear_mps, *self.angular_radps)))

    @property
    def odom_velocity_mps(self) -> Vector:
        """Velocity (x, y, z) in the odometry frame."""
        return rotate(self.odom_from_base.quaternion, self.linear_mps)


@dataclass(frozen=True)
class Velocity:
    """A set-point: velocity in the body frame with FLU axes, heading and height.

    Attributes:
        vx_mps: Forward.
        vy_mps: To the left.
        vz_mps: Up; our height loop has computed it.
        vyaw_radps: Counter-clockwise.
        height_m: Height above the place of take-off that ``vz_mps`` leads to, for vehicles that
            hold a height themselves.
    """

    vx_mps: float = 0.0
    vy_mps: float = 0.0
    vz_mps: float = 0.0
    vyaw_radps: float = 0.0
    height_m: float = 0.0

    @property
    def is_finite(self) -> bool:
        """True if no component is infinite or NaN."""
        parts = (self.vx_mps, self.vy_mps, self.vz_mps, self.vyaw_radps, self.height_m)
        return all(map(math.isfinite, parts))


@dataclass(frozen=True)
class Limits:
    """Limits of one vehicle, which the bridge enforces.

    Attributes:
        speed_mps: Largest horizontal speed.
        climb_mps: Largest vertical speed.
        yaw_rate_radps: Largest yaw rate.
        height_m: Largest height above the place of take-off.
        radius_m: Largest distance from the place of take-off.
        battery: Smallest charge, 0 to 1; below it the vehicle lands.
    """

    speed_mps: float = 0.7
    climb_mps: float = 0.3
    yaw_rate_radps: float = 1.0
    height_m: float = 2.5
    radius_m: float = 30.0
    battery: float = 0.2

    def height_problem(self, altitude_m: float) -> Optional[str]:
        """Say that a flying altitude does not fit below the largest height."""
        if altitude_m + 0.3 <= self.height_m:
            return None
        return f"altitude {altitude_m:g} m, expected 0.3 m or more below limits.height"
