"""A stand-in for ArduCopter 4.5.3 that behaves as its recorded flights.

Times, texts and refusals are those of recordings of the autopilot in software, without wind and
with its default parameters. Not modelled: turning to a heading (masks that use yaw), parameters
beside ``DEFAULTS``, and the fence.
"""

from __future__ import annotations

import math

from vehicles.ardupilot_watch import (
    ALT_HOLD,
    BOOT_TEXTS,
    BRAKE,
    GUIDED,
    LAND,
    LOITER,
    POSHOLD,
    RTL,
    STABILIZE,
    ArduPilotWatch,
)
from vehicles.climb import ClimbLaw
from vehicles.stand_in import (
    ACCEPTED,
    CRITICAL,
    FAILED,
    IN_AIR,
    INFO,
    LANDING,
    ON_GROUND,
    TAKING_OFF,
    UNSUPPORTED,
    WARNING,
)

REBOOT_S = 0.69
"""Time since boot at which the clock stands after a reboot by command."""
SPOOL_S, RUN_UP_S = 2.35, 0.88
DISARM_DELAY_S, LANDED_DISARM_S, LAND_DISARM_S = 9.9, 9.95, 2.1
LANDED_S = {GUIDED: 2.15, LAND: 1.75, RTL: 1.75}
OTHER_LANDED_S = 1.6
RTL_AT_HOME_M, RTL_WAIT_S, RTL_MPS = 0.3, 5.0, 5.0
HOLDS_STICK = (LOITER, ALT_HOLD, POSHOLD, STABILIZE)
FORCE = 21196
BRAKE_S = {BRAKE: 2.6, LOITER: 1.1, POSHOLD: 1.1}  # from any speed to a stop
SWING_MPS, SWING_S, SWING_LATE_S = 0.58, 1.09, 0.743
SWING_FROM_MPS = 0.1
LANDING_S, LAND_MPS = 0.2, 0.49
RTL_MPS2, RTL_UP_MPS, RTL_LATE_S = 0.78, 1.5, 0.52
YAW_ALIGNED_M, RTL_BELOW_M = 2.6, 0.6


class ArduPilot(ArduPilotWatch):
    """The autopilot; modes by ArduCopter's own numbers."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.climb = ClimbLaw(self.estimator)
        self._armed_s = self._flown_s = -math.inf
        self._takeoff_s = self._touch_s = None
        self._setpoint_s = -math.inf
        self._is_flying = self._is_stopped = False
        self._brake = None  # (time, forward, left, seconds)
        self._invalid = (-math.inf, 0, 0.0)  # last one, how many in a row, begin
        self._direction = (1.0, 0.0)
        self._seen = set()
        self._wait_s, self._mode_s = None, -math.inf

    @property
    def base_mode(self):
        return super().base_mode + (8 if self.mode in (GUIDED, LOITER, RTL, POSHOLD, BRAKE) else 0)

    # Commands.

    def command(self, number, message):
        handlers = {
            176: lambda m: self._ask_mode(int(m.param2)),
            21: lambda _: self._ask_mode(LAND),
            400: self._arm,
            22: self._take_off,
            246: self._reboot,
        }
        handler = handlers.get(number)
        return handler(message) if handler else (UNSUPPORTED, [])

    def _on_set_mode(self, message, sender):
        result, texts = self._ask_mode(int(message.custom_mode))
        self.acknowledge(11, result, sender)
        for severity, words in texts:
            self.say(severity, words)

    def _ask_mode(self, mode):
        if mode == GUIDED and self.armed and (not self.has_position or "ekf" in self._fired):
            return FAILED, [(WARNING, "Mode change to GUIDED failed: requires position")]
        if mode != self.mode:
            self.set_mode(mode)
        return ACCEPTED, []

    def set_mode(self, mode):
        """Change the mode; what moves comes to a stop in the way of the new mode."""
        if mode != self.mode and self._is_flying:
            forward, left = self._bodies.body_velocity_mps(self._robot)
            self._brake = (self.now_s, forward, left, BRAKE_S.get(mode, 0.0))
        self._takeoff_s, self._setpoint_s, self._is_stopped = None, -math.inf, True
        self._wait_s, self._mode_s, self._descent_s = None, self.now_s, self.now_s
        self.climb.stop()
        super().set_mode(mode)

    def _arm(self, message):
        if message.param1 == 0:
            if self.landed != ON_GROUND and int(message.param2) != FORCE:
                return FAILED, []
            self._disarm()
            return ACCEPTED, []
        if self.armed:
            return ACCEPTED, []
        reasons = self._arming_problems()
        if reasons:
            return FAILED, [(CRITICAL, f"Arm: {reason}") for reason in reasons]
        self.armed, self._armed_s, self._touch_s = True, self.now_s, None
        self._home = self.estimator.position_ned
        return ACCEPTED, [(INFO, "Arming motors")]

    def acknowledge(self, command, result, sender):
        super().acknowledge(command, result, sender)
        if command == 400 and result == ACCEPTED and self.armed and self._armed_s == self.now_s:
            self._send_home()

    def _disarm(self):
        if self.armed:
            self.armed, self._is_flying, self._takeoff_s = False, False, None
            self.say(INFO, "Disarming motors")

    def _take_off(self, message):
        if not self.armed or self.mode != GUIDED or self.landed != ON_GROUND:
            return FAILED, []
        self._takeoff_s = self.now_s
        self.climb.target_m = message.param7
        return ACCEPTED, []

    def _reboot(self, _):
        self.armed = self._is_flying = self.is_critical = self.has_low_battery = False
        self.mode, self.landed, self._fired = STABILIZE, ON_GROUND, set()
        self.reboot(REBOOT_S)
        self._told = BOOT_TEXTS[0][0] + 0.001  # the first text comes before the connection
        return ACCEPTED, []

    # Other messages to it.

    def _on_rc_channels_override(self, message, _):
        for k in range(4):
            value = getattr(message, f"chan{k + 1}_raw")
            if value not in (0, 65535):
                self.sticks[k] = value

    def _on_set_position_target_local_ned(self, message, _):
        self.setpoints.append((self.now_s, message))
        if self.mode != GUIDED or not self.armed:
            return
        if not self._is_flying:
            self._takeoff_s = None  # cancelled, without a word
            return
        if self._takeoff_s is not None:
            self._takeoff_s = None
            self.climb.stop()
        uses_yaw = not message.type_mask & 1024
        if uses_yaw and math.isnan(message.yaw):
            self.has_ended = True
            return
        if not is_valid(message):
            self._discard()
            return
        self._setpoint_s, self._is_stopped, self._brake = self.now_s, False, None
        self._invalid = (-math.inf, 0, 0.0)
        rate = 0.0 if message.type_mask & 2048 or uses_yaw else message.yaw_rate
        if math.isnan(rate):
            rate = 0.0
            if not self.is_critical:
                self.is_critical = True
                self.say(CRITICAL, "Internal Errors 0x400")
        forward, right = message.vx, message.vy
        if message.coordinate_frame in (1, 7):
            cos, sin = math.cos(self.estimator.heading_rad), math.sin(self.estimator.heading_rad)
            forward, right = cos * forward + sin * right, cos * right - sin * forward
        self._bodies.set_velocity(self._robot, forward, -right, -rate)
        self.climb.set_velocity(-message.vz)

    def _discard(self):
        """Brake for a set-point that is not valid; a stream of them makes it swing."""
        last_s, count, begin_s = self._invalid
        if self.now_s - last_s > 0.3:
            forward, left = self._bodies.body_velocity_mps(self._robot)
            speed = math.hypot(forward, left)
            is_moving = speed > SWING_FROM_MPS
            self._direction = (forward / speed, left / speed) if is_moving else (0.0, 0.0)
            count, begin_s = 0, self.now_s
            self._stop()
        self._invalid = (self.now_s, count + 1, begin_s)
        self._setpoint_s, self._is_stopped = self.now_s, False
        if count > 5:
            phase = math.tau * (self.now_s - begin_s - SWING_LATE_S) / SWING_S
            swing = SWING_MPS * math.sin(phase)
            x, y = self._direction
            self._bodies.set_velocity(self._robot, swing * x, swing * y, 0.0)

    # Flight.

    def fly(self):
        self._boot()
        self._watch()
        self._lift_or_land()
        self._move()
        lift = self.climb.acceleration_mps2(self.height_rate) if self._is_flying else None
        if lift is not None and self._touch_s is not None and self.climb.velocity_mps <= 0.0:
            lift = None
        self._bodies.lift_mps2[self._robot] = lift if self.armed else None

    @property
    def height_rate(self):
        """True vertical velocity, up."""
        return self._bodies.velocity_mps(self._robot)[2]

    def _lift_or_land(self):
        """Leave the ground, notice the ground, and disarm."""
        if self._takeoff_s is not None and not self._is_flying:
            if self.now_s > max(self._takeoff_s, self._armed_s + SPOOL_S) + RUN_UP_S:
                self._is_flying, self._touch_s = True, None
                self.climb.take_off()
                self.landed = TAKING_OFF
        if self._is_flying:
            self._in_the_air()
        elif self.armed:
            begin_s = max(self._armed_s, self._flown_s)
            wait_s = LANDED_DISARM_S if self._flown_s > self._armed_s else DISARM_DELAY_S
            if self._takeoff_s is None and self.now_s - begin_s > wait_s:
                self._disarm()

    def _in_the_air(self):
        if self._takeoff_s is not None:
            if self.climb.has_arrived:
                self._takeoff_s, self.landed = None, IN_AIR
            return
        touches = self._bodies.is_touching(self._robot) and self.climb.velocity_mps <= 0.0
        if not touches:
            self._touch_s = None
            self.landed = LANDING if self._is_descending else IN_AIR
            return
        if self._touch_s is None:
            self._touch_s = self.now_s
            self.say(INFO, f"SIM Hit ground at {-self.climb.velocity_mps:f} m/s")
        since_s = self.now_s - self._touch_s
        if since_s > LANDED_S.get(self.mode, OTHER_LANDED_S):
            self.landed, self._flown_s = ON_GROUND, self.now_s
            if self.mode not in (LAND, RTL):
                self._is_flying = False
        if self.mode in (LAND, RTL) and since_s > LAND_DISARM_S:
            self._disarm()

    @property
    def _is_descending(self):
        if self.mode == LAND:
            return self.now_s > self._mode_s + LANDING_S
        return self.mode == RTL and self._wait_s == math.inf

    def _move(self):
        if not self._is_flying:
            return
        if self._brake is not None:
            begin_s, forward, left, seconds = self._brake
            share = 1.0 - (self.now_s - begin_s) / seconds if seconds > 0.0 else 0.0
            self._bodies.set_velocity(
                self._robot, max(share, 0.0) * forward, max(share, 0.0) * left, 0.0
            )
            if share <= 0.0:
                self._brake = None
        if self.mode == GUIDED:
            timeout_s = max(0.1, self.parameters["GUID_TIMEOUT"])
            if not self._is_stopped and self.now_s - self._setpoint_s > timeout_s:
                self._stop()
                self._is_stopped = True
        elif self.mode == LAND and self.now_s >= self._descent_s:
            self.climb.set_velocity(-LAND_MPS, delay_s=0.1)
        elif self.mode == RTL:
            self._return()
        elif self.mode in HOLDS_STICK:
            down = self.sticks[2] < 1400
            self.climb.ramp(-2.5 if down else 0.0, 1.7)

    def _stop(self):
        self._bodies.set_velocity(self._robot, 0.0, 0.0, 0.0)
        self.climb.set_velocity(0.0)

    def _return(self):
        """Return to launch: climb, fly home, wait, descend."""
        north, east, down = self.estimator.position_ned
        to_n, to_e = self._home[0] - north, self._home[1] - east
        distance_m = math.hypot(to_n, to_e)
        if self._wait_s is None:
            if -down < self.parameters["RTL_ALT"] / 100.0 - RTL_BELOW_M:
                if self.now_s > self._mode_s + RTL_LATE_S:
                    self.climb.ramp(RTL_UP_MPS, RTL_MPS2)
                if self.height_m > YAW_ALIGNED_M and "aligned" not in self._seen:
                    self._seen.add("aligned")
                    for k in (1, 0):
                        self.say(INFO, f"EKF3 IMU{k} MAG0 in-flight yaw alignment complete")
                return
            self.climb.ramp(0.0, 2.5)
            if distance_m < RTL_AT_HOME_M:
                self._wait_s = self.now_s + RTL_WAIT_S
                return
            speed = min(RTL_MPS, 0.5 * distance_m) / distance_m
            heading = self.estimator.heading_rad
            forward = math.cos(heading) * to_n + math.sin(heading) * to_e
            right = math.cos(heading) * to_e - math.sin(heading) * to_n
            self._bodies.set_velocity(self._robot, speed * forward, -speed * right, 0.0)
        elif self.now_s > self._wait_s or self._wait_s == math.inf:
            self._wait_s = math.inf
            self.climb.ramp(-0.5, 1.0)


def is_valid(message):
    """Return whether ArduCopter takes a set-point: frame, mask and finite, sane velocities."""
    velocity = (message.vx, message.vy, message.vz)
    return (
        message.coordinate_frame in (1, 7, 8, 9)
        and not message.type_mask & 0b111000
        and all(math.isfinite(v) and abs(v) <= 1000.0 for v in velocity)
    )
