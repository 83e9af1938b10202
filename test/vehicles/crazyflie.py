"""A stand-in for a Crazyflie: a simulated body behind set-points and log variables.

Its supervisor follows crazyflie-firmware (`supervisor.c`, `commander.c`): it arms itself, levels
out when no set-point has come for 0.5 s, and stops the motors after 2 s or with a stop. How its
body responds is made up: faster than ArduCopter's.
"""

from __future__ import annotations

import math

import numpy as np

from quad_nav.sim.flight import Airframe, AutopilotResponse
from quad_vehicles.crazyflie_adapter import BLOCKS

AIRFRAME = Airframe(
    response=AutopilotResponse(
        velocity_delay_s=0.05,
        velocity_time_s=0.3,
        yaw_delay_s=0.03,
        yaw_frequency_radps=12.0,
        yaw_damping=0.7,
        max_yaw_rate_radps=3.0,
    )
)
LEVEL_S, STOP_S, FLYING_S = 0.5, 2.0, 2.0
CAN_BE_ARMED, ARMED, AUTO_ARM, CAN_FLY, FLYING, TUMBLED = 1, 2, 4, 8, 16, 32
_HEIGHT_GAINS = (9.0, 5.0)  # 1/s^2, 1/s


class Crazyflie:
    """One Crazyflie, which stands on the floor at first.

    Attributes:
        parameters: Values by their complete names.
        ranges_mm: Back, right, front, left and up.
        is_frozen: Fault: the estimate stays what it was.
        shift_m: Fault: a jump of the estimate along x.
        is_tumbled: Fault: it lies upside down.
        battery: Charge in per cent.
        setpoints: Set-points that have come: (time, vx, vy, yaw rate, z).
    """

    def __init__(self, bodies, robot=0, arms_itself=True):
        self._bodies, self._robot, self._arms_itself = bodies, robot, arms_itself
        self._start = bodies.pose(robot)
        self.parameters = {"deck.bcFlow2": 1, "deck.bcMultiranger": 1}
        self.ranges_mm = [32767, 1200, 800, 2500, 32767]
        self.is_frozen, self.is_tumbled, self.battery = False, False, 90
        self.shift_m = 0.0
        self.setpoints = []
        self._held = None
        self._is_armed, self._is_stopped = arms_itself, False
        self._setpoint, self._setpoint_s = None, -math.inf
        self._thrust_s = -math.inf

    @property
    def now_s(self):
        return self._bodies.now_s

    @property
    def height_m(self):
        return self._bodies.height_m(self._robot)

    @property
    def speed_mps(self):
        return math.hypot(*self._bodies.velocity_mps(self._robot)[:2])

    @property
    def is_running(self):
        """Whether the motors turn."""
        return self._bodies.lift_mps2[self._robot] is not None

    def freeze(self):
        """Let the estimate stay what it is."""
        self.is_frozen = True

    def jump(self, north_m):
        """Let the estimate jump."""
        self.shift_m = north_m

    # From the radio.

    def hover(self, vx, vy, yaw_degps, z_m):
        if all(map(math.isfinite, (vx, vy, yaw_degps, z_m))):
            self.setpoints.append((self.now_s, vx, vy, yaw_degps, z_m))
            self._setpoint, self._setpoint_s = (vx, vy, math.radians(yaw_degps), z_m), self.now_s

    def stop(self):
        self._setpoint = None

    def arm(self, is_on):
        self._is_armed = (is_on or self._arms_itself) and not self.is_tumbled

    # The firmware.

    def before_step(self):
        """Decide the motors for the next step of the bodies."""
        age_s = self.now_s - self._setpoint_s
        if self.is_tumbled or (self._setpoint is not None and age_s > STOP_S):
            self._setpoint = None
            self._is_armed = self._arms_itself and not self.is_tumbled
        if self._setpoint is None or not self._is_armed:
            self._bodies.lift_mps2[self._robot] = None
            return
        self._thrust_s = self.now_s
        vx, vy, rate, z_m = self._setpoint
        if age_s > LEVEL_S:  # no tilt: it goes on as it was
            rate, (vx, vy) = 0.0, self._bodies.body_velocity_mps(self._robot)
        self._bodies.set_velocity(self._robot, vx, vy, rate)
        gain, damping = _HEIGHT_GAINS
        climb_mps = self._bodies.velocity_mps(self._robot)[2]
        self._bodies.lift_mps2[self._robot] = gain * (z_m - self.height_m) - damping * climb_mps

    def values(self):
        """Return all log variables, as their types hold them."""
        if self._held is None or not self.is_frozen:
            self._held = self._estimate()
        info = ARMED * self._is_armed | AUTO_ARM * self._arms_itself
        info |= (
            0 if self.is_tumbled else CAN_FLY * self._is_armed | CAN_BE_ARMED * (not self._is_armed)
        )
        is_flying = self.now_s - self._thrust_s < FLYING_S and not self.is_tumbled
        info |= FLYING * is_flying | TUMBLED * self.is_tumbled
        names = ("back", "right", "front", "left", "up")
        return {
            **self._held,
            **{f"range.{name}": mm for name, mm in zip(names, self.ranges_mm)},
            "supervisor.info": info,
            "pm.state": 0 if self.battery > 10 else 3,
            "pm.batteryLevel": self.battery,
        }

    def _estimate(self):
        pose, start = self._bodies.pose(self._robot), self._start
        vx, vy, vz = self._bodies.velocity_mps(self._robot)
        cos, sin = math.cos(start.yaw_rad), math.sin(start.yaw_rad)
        x_m, y_m = pose.x_m - start.x_m, pose.y_m - start.y_m
        x, y, z, w = pose.quaternion
        roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
        yaw = math.remainder(pose.yaw_rad - start.yaw_rad, math.tau)
        estimate = {
            "x": cos * x_m + sin * y_m + self.shift_m,
            "y": cos * y_m - sin * x_m,
            "z": self.height_m,
            "vx": cos * vx + sin * vy,
            "vy": cos * vy - sin * vx,
            "vz": vz,
            "roll": math.degrees(roll),
            "pitch": -math.degrees(pitch),
            "yaw": math.degrees(yaw),
        }
        turn = dict(zip("xyz", map(math.degrees, self._bodies.turn_radps(self._robot))))
        values = {f"stateEstimate.{name}": value for name, value in estimate.items()}
        values.update({f"gyro.{name}": value for name, value in turn.items()})
        return {name: float(np.float32(value)) for name, value in values.items()}


class LogBlocks:
    """The log blocks of a Crazyflie, each at its period."""

    def __init__(self, crazyflie):
        self._crazyflie = crazyflie
        self._due_s = dict.fromkeys(BLOCKS, 0.0)

    def due(self, now_s):
        """Return (block, stamp in ms, values) of those that are due."""
        found, values = [], None
        for name, (period_ms, variables) in BLOCKS.items():
            if now_s >= self._due_s[name]:
                self._due_s[name] = now_s + period_ms / 1e3 - 1e-6
                values = values or self._crazyflie.values()
                found.append(
                    (name, int(now_s * 1e3) % (1 << 24), {k: values[k] for k in variables})
                )
        return found
