"""Set-points: height loop, caps, and the fields of MAVLink's message.

An autopilot that gets velocities in the plane and ``vz = 0`` holds its height within centimetres,
but any error of the height at take-off stays. A proportional loop around the autopilot's own
velocity control removes it: vz = gain (z_ref - z), limited. With gain 1.0/s and 0.3 m/s a step of
0.5 m takes 2.9 s to 95 % without overshoot, measured on ArduCopter 4.5.3.

ArduPilot discards a set-point with a number that is not finite, a wrong frame or a wrong mask
without a word and swings if they go on, and it takes NaN as a yaw rate. It does not cap speeds. So
nothing leaves here but finite numbers within the limits, in one frame and with one mask.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Dict, Optional

from quad_nav.geometry import leading_velocity
from quad_vehicles.frames import frd_from_flu, yaw_rate
from quad_vehicles.telemetry import Limits, Velocity

BODY_NED = 8  # MAV_FRAME_BODY_NED: forward along the heading, right, down
VELOCITY_AND_YAW_RATE = 1479
"""Mask of SET_POSITION_TARGET_LOCAL_NED: position, acceleration, force and yaw are ignored."""
PERIOD_S = 0.05
SOONEST_S = 0.02
"""Shortest time between two set-points, when commands come faster than the stream."""
COMMANDED_PERIOD_S = 0.075
"""Time to the next set-point after one that a command has caused: the next command comes first,
even if it is late."""


@dataclass(frozen=True)
class HeightLoop:
    """A proportional loop from height to vertical velocity.

    Attributes:
        gain_1ps: Vertical velocity for each metre of error, 1/s.
        climb_mps: Largest vertical velocity, up and down.
        deadband_m: Error below which the velocity is 0: the noise of the estimate.
    """

    gain_1ps: float = 1.0
    climb_mps: float = 0.3
    deadband_m: float = 0.01

    def velocity_mps(self, reference_m: float, height_m: float) -> float:
        """Return the vertical velocity, up, for a height.

        Args:
            reference_m: Wanted height.
            height_m: Present height, from the same ground.

        Returns:
            The velocity; 0 if the height is not finite.
        """
        error_m = reference_m - height_m
        if not math.isfinite(error_m) or abs(error_m) <= self.deadband_m:
            return 0.0
        return min(max(self.gain_1ps * error_m, -self.climb_mps), self.climb_mps)


def limited(velocity: Velocity, limits: Limits) -> Optional[Velocity]:
    """Return a set-point within the limits; None if a number is not finite.

    The direction of the horizontal velocity stays.
    """
    if not velocity.is_finite:
        return None
    speed_mps = math.hypot(velocity.vx_mps, velocity.vy_mps)
    scale = min(1.0, limits.speed_mps / speed_mps) if speed_mps > 0.0 else 1.0
    return Velocity(
        velocity.vx_mps * scale,
        velocity.vy_mps * scale,
        _clamp(velocity.vz_mps, limits.climb_mps),
        _clamp(velocity.vyaw_radps, limits.yaw_rate_radps),
        velocity.height_m,
    )


def led(velocity: Velocity, lead_s: float) -> Velocity:
    """Return a set-point turned ahead of the heading, as an autopilot that follows late needs.

    Args:
        velocity: The set-point.
        lead_s: Time by which the velocity follows it.
    """
    vx, vy = leading_velocity(velocity.vx_mps, velocity.vy_mps, velocity.vyaw_radps, lead_s)
    return replace(velocity, vx_mps=vx, vy_mps=vy)


def setpoint_fields(velocity: Velocity, time_boot_ms: int) -> Dict[str, Any]:
    """Return the fields of SET_POSITION_TARGET_LOCAL_NED, without the target.

    Args:
        velocity: A set-point that `limited` has returned.
        time_boot_ms: Our time since the start of the program.
    """
    vx, vy, vz = frd_from_flu((velocity.vx_mps, velocity.vy_mps, velocity.vz_mps))
    unused = dict.fromkeys(("x", "y", "z", "afx", "afy", "afz", "yaw"), 0.0)
    return {
        "time_boot_ms": time_boot_ms & 0xFFFFFFFF,
        "coordinate_frame": BODY_NED,
        "type_mask": VELOCITY_AND_YAW_RATE,
        **unused,
        "vx": vx,
        "vy": vy,
        "vz": vz,
        "yaw_rate": yaw_rate(velocity.vyaw_radps),
    }


@dataclass
class SetpointClock:
    """Times of the stream: at 20 Hz, and at once after a command, but not too often.

    Attributes:
        due_s: When the next set-point is due without a command.
    """

    due_s: float = -math.inf
    _sent_s: float = -math.inf

    def is_due(self, now_s: float) -> bool:
        """Return whether the stream is due."""
        return now_s >= self.due_s

    def may_follow_command(self, now_s: float) -> bool:
        """Return whether a set-point may be sent at once for a new command, else have it soon."""
        if now_s - self._sent_s >= SOONEST_S:
            return True
        self.due_s = min(self.due_s, self._sent_s + SOONEST_S)
        return False

    def sent(self, now_s: float, by_command: bool) -> None:
        """Note that a set-point was sent.

        Args:
            now_s: Time.
            by_command: Whether a command has caused it.
        """
        on_time = not by_command and now_s - self.due_s < PERIOD_S
        start_s = self.due_s if on_time else now_s
        self.due_s = start_s + (COMMANDED_PERIOD_S if by_command else PERIOD_S)
        self._sent_s = now_s


def _clamp(value: float, most: float) -> float:
    return min(max(value, -most), most)
