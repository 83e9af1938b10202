"""A stand-in's estimate of its pose: its own local frame, drift, and faults.

Without a position from outside an autopilot integrates its velocity. The recorded one's (ArduCopter
4.5.3) is wrong by 0.024 m/s, root mean square of 57 pieces of 3 s in seven recordings, 0.038 m/s at
most: its integral is 0.27 m off after the 50 s of `velocity_steps`, 0.47 m after the 42 s of
`random_commands`, 0.30 m after the 14 s of `start_to_hover`, measured against the position, which
GPS held. The error is 0.018 m/s to the back and as much to the right, and follows turns within 3 s:
so much explains the two long recordings to 0.07 m. The heading did not drift.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

from quad_nav.geometry import multiply_quaternions

GROUND_OFFSET_M = -0.035
"""Height that the recorded autopilot reports while it stands on the ground."""
_DRIFT_S, _POSITION_SD_M, _HEIGHT_SD_M, _VELOCITY_SD_MPS = 20.0, 0.005, 0.005, 0.006
DRIFT_MPS2 = 2.0 * 0.63 / 8.0**2  # 0.63 m off after 8 s without GPS
VELOCITY_ERROR_MPS, _ERROR_S = 0.018 * math.sqrt(2.0), 3.0
_BARO_S = 1.2  # within this time the estimate follows an error of the barometer


@dataclass(frozen=True)
class LocalFrame:
    """Where the local frame lies: the vehicle's place and heading in it at the start.

    Attributes:
        north_m: Place of the start.
        east_m: The same.
        heading_rad: Heading at the start, clockwise from north.
    """

    north_m: float = 0.0
    east_m: float = 0.0
    heading_rad: float = 0.0


class Estimator:
    """Estimate of one body in its local frame.

    Attributes:
        is_frozen: Fault: the estimate stays what it was.
        jump_m: Fault: a jump (north, east, up).
        baro_error_m: Fault: an error of the barometer, which the estimate follows.
        is_lost: Whether there is no position any more.
        is_dead_reckoning: Fault: nothing corrects the position, and the vehicle drifts unseen.
        drifts: Whether the position is the integral of the velocity with its recorded error, in a
            direction of the seed.
    """

    def __init__(self, bodies, robot, frame, seed):
        self._bodies, self._robot, self._frame = bodies, robot, frame
        self._random = random.Random(f"estimator {seed}")
        start = bodies.pose(robot)
        self._start = start
        self._phi = frame.heading_rad + start.yaw_rad
        self._noise = [0.0] * 7
        self._baro_m = 0.0
        self.is_frozen, self.jump_m, self.baro_error_m = False, (0.0, 0.0, 0.0), 0.0
        self.is_lost = self.is_dead_reckoning = self.drifts = False
        self._drift_yaw_rad = self._random.uniform(-math.pi, math.pi)
        self._drift_mps, self._drift_m = (0.0, 0.0), (0.0, 0.0)
        self._held = None

    def step(self, seconds):
        """Let the drift go on."""
        share = seconds / _DRIFT_S
        spread = math.sqrt(2.0 * share)
        sizes = (_POSITION_SD_M,) * 2 + (_HEIGHT_SD_M,) + (_VELOCITY_SD_MPS,) * 3 + (0.002,)
        gauss = self._random.gauss
        self._noise = [n + spread * gauss(0.0, s) - share * n for n, s in zip(self._noise, sizes)]
        self._baro_m += (self.baro_error_m - self._baro_m) * min(1.0, seconds / _BARO_S)
        self._drift(seconds)
        if not self.is_frozen:
            self._held = None
        elif self._held is None:
            self._held = (self._position(), self._velocity(), self._attitude(), self._rates())

    def _drift(self, seconds):
        """Move away from where the estimate is; with a receiver the error is gone at once."""
        if self.drifts:
            yaw_rad = self._bodies.pose(self._robot).yaw_rad + self._drift_yaw_rad
            wanted, share = _along(yaw_rad, VELOCITY_ERROR_MPS), seconds / _ERROR_S
            self._drift_mps = tuple(v + (w - v) * share for v, w in zip(self._drift_mps, wanted))
        elif self.is_dead_reckoning:
            size = math.hypot(*self._drift_mps) + DRIFT_MPS2 * seconds
            self._drift_mps = _along(self._drift_yaw_rad, size)
        else:
            self._drift_mps = self._drift_m = (0.0, 0.0)
        self._drift_m = tuple(m + v * seconds for m, v in zip(self._drift_m, self._drift_mps))
        self._bodies.drift_mps[self._robot] = self._drift_mps

    @property
    def height_m(self):
        """Estimated height, up, that the autopilot holds."""
        true_m = self._bodies.height_m(self._robot) - self._start.z_m
        return true_m + GROUND_OFFSET_M + self._noise[2] + self._baro_m

    @property
    def position_ned(self):
        return self._held[0] if self._held else self._position()

    @property
    def velocity_ned(self):
        return self._held[1] if self._held else self._velocity()

    @property
    def attitude(self):
        """(w, x, y, z), the rotation from FRD to NED."""
        return self._held[2] if self._held else self._attitude()

    @property
    def rates_frd(self):
        return self._held[3] if self._held else self._rates()

    @property
    def heading_rad(self):
        return math.remainder(self._phi - self._bodies.pose(self._robot).yaw_rad, math.tau)

    def ned(self, x, y):
        """Return a horizontal vector of ``map`` as (north, east)."""
        cos, sin = math.cos(self._phi), math.sin(self._phi)
        return cos * x + sin * y, sin * x - cos * y

    def _position(self):
        pose = self._bodies.pose(self._robot)
        drift_x, drift_y = self._drift_m
        north, east = self.ned(
            pose.x_m - self._start.x_m - drift_x, pose.y_m - self._start.y_m - drift_y
        )
        n, e, up = self.jump_m
        return (
            self._frame.north_m + north + self._noise[0] + n,
            self._frame.east_m + east + self._noise[1] + e,
            -(self.height_m + up),
        )

    def _velocity(self):
        x, y, z = self._bodies.velocity_mps(self._robot)
        drift_x, drift_y = self._drift_mps
        north, east = self.ned(x - drift_x, y - drift_y)
        return (north + self._noise[3], east + self._noise[4], -z + self._noise[5])

    def _attitude(self):
        # ENU of the local frame is map turned about z by pi/2 - phi.
        half = (math.pi / 2.0 - self._phi) / 2.0
        s, c = math.sin(half), math.cos(half)
        x, y, z, w = self._bodies.pose(self._robot).quaternion
        turned = (c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z)
        return ned_from_frd(turned)

    def _rates(self):
        forward, left, up = self._bodies.turn_radps(self._robot)
        return (forward, -left, -up + self._noise[6])


def _along(yaw_rad, size):
    return size * math.cos(yaw_rad), size * math.sin(yaw_rad)


def ned_from_frd(flu_to_enu):
    """Return an attitude of ROS, (x, y, z, w), as MAVLink's (w, x, y, z) with w >= 0."""
    half = math.sqrt(0.5)
    turned = multiply_quaternions(flu_to_enu, (1.0, 0.0, 0.0, 0.0))
    x, y, z, w = multiply_quaternions((half, half, 0.0, 0.0), turned)
    return (w, x, y, z) if w >= 0.0 else (-w, -x, -y, -z)


def euler(quaternion):
    """Return roll, pitch and yaw of a quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw
