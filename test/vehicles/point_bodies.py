"""Bodies of stand-in vehicles as points: quick, without a physics engine, contacts and walls.

A point follows horizontal set-points with the delay and the lag of ArduCopter 4.5.3, never tilts,
and falls with its motors off.
"""

from __future__ import annotations

import math
from collections import deque

from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.sim.simulation_params import STEP_S

GRAVITY_MPS2 = 9.81
DELAY_S, LAG_S, YAW_LAG_S = 0.196, 0.449, 0.2
_AT_ORIGIN = (Pose2D(0.0, 0.0),)
_TOUCHING_M = 0.015
_SHARE, _YAW_SHARE = 1.0 - math.exp(-STEP_S / LAG_S), 1.0 - math.exp(-STEP_S / YAW_LAG_S)


class PointBodies:
    """As `bodies.Bodies`.

    Attributes:
        count: Steps since the start.
        lift_mps2: Vertical acceleration of each body; None with the motors off.
        drift_mps: Velocity (x, y) in ``map`` of each body that its estimator does not know.
        contacts: None: they pass through each other.
    """

    def __init__(self, starts=_AT_ORIGIN):
        self._points = [_Point(start) for start in starts]
        self.count, self.lift_mps2, self.contacts = 0, [None] * len(self._points), []
        self.drift_mps = [(0.0, 0.0)] * len(self._points)

    def __len__(self):
        return len(self._points)

    @property
    def now_s(self):
        return self.count * STEP_S

    def set_velocity(self, robot, forward_mps, left_mps, yaw_radps):
        """Give a set-point in the body's frame; it takes effect after a delay."""
        wanted = (self.now_s + DELAY_S, forward_mps, left_mps, yaw_radps)
        self._points[robot].wanted.append(wanted)

    def step(self):
        """Advance all bodies by one step of the simulation."""
        self.count += 1
        for point, lift, drift in zip(self._points, self.lift_mps2, self.drift_mps):
            point.advance(self.now_s, lift, drift)

    def height_m(self, robot):
        return self._points[robot].z_m

    def is_touching(self, robot):
        return self._points[robot].z_m < _TOUCHING_M

    def pose(self, robot):
        point = self._points[robot]
        pose = Pose2D(point.x_m, point.y_m, point.yaw_rad).to_3d()
        return Pose3D(pose.x_m, pose.y_m, point.z_m, pose.quaternion)

    def place(self, robot):
        point = self._points[robot]
        return point.x_m, point.y_m, point.z_m

    def velocity_mps(self, robot):
        point = self._points[robot]
        return point.vx_mps, point.vy_mps, point.vz_mps

    def turn_radps(self, robot):
        return 0.0, 0.0, self._points[robot].turn_radps

    def body_velocity_mps(self, robot):
        point = self._points[robot]
        cos, sin = math.cos(point.yaw_rad), math.sin(point.yaw_rad)
        return cos * point.vx_mps + sin * point.vy_mps, cos * point.vy_mps - sin * point.vx_mps

    def close(self):
        pass


class _Point:
    """One body."""

    def __init__(self, start):
        self.x_m, self.y_m, self.z_m, self.yaw_rad = start.x_m, start.y_m, 0.0, start.yaw_rad
        self.vx_mps = self.vy_mps = self.vz_mps = self.turn_radps = 0.0
        self.wanted = deque()  # (time, forward, left, turn)
        self._target = (0.0, 0.0, 0.0)

    def advance(self, now_s, lift_mps2, drift_mps):
        while self.wanted and self.wanted[0][0] <= now_s:
            self._target = self.wanted.popleft()[1:]
        if self.z_m <= 0.0 and (lift_mps2 is None or lift_mps2 <= 0.0):
            self.z_m = self.vx_mps = self.vy_mps = self.vz_mps = self.turn_radps = 0.0
            return
        if lift_mps2 is None:  # it falls
            lift_mps2 = -GRAVITY_MPS2
        else:
            self._follow(*drift_mps)
        self.vz_mps += lift_mps2 * STEP_S
        self.x_m += self.vx_mps * STEP_S
        self.y_m += self.vy_mps * STEP_S
        self.z_m = max(self.z_m + self.vz_mps * STEP_S, 0.0)
        self.yaw_rad += self.turn_radps * STEP_S

    def _follow(self, drift_x_mps, drift_y_mps):
        forward, left, turn = self._target
        cos, sin = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        self.vx_mps += _SHARE * (cos * forward - sin * left + drift_x_mps - self.vx_mps)
        self.vy_mps += _SHARE * (sin * forward + cos * left + drift_y_mps - self.vy_mps)
        self.turn_radps += _YAW_SHARE * (turn - self.turn_radps)
