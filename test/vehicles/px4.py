"""A stand-in for PX4, after its documentation and messages of v1.14; nobody has measured it here.

OFFBOARD needs a stream of set-points of more than 2 Hz for a second: without it the mode is
rejected in the air, and arming is on the ground. When the stream stops for COM_OF_LOSS_T, the
vehicle holds for COM_FAIL_ACT_T and then does what COM_OBL_RC_ACT says. It streams some messages
unasked. Whole-number parameters travel as their bits. Its dynamics are made up from its default
gains: a velocity loop of 1.8/s, a yaw rate without overshoot.

Not modelled: the geofence, what it does itself about a low battery, sticks that take over.
"""

from __future__ import annotations

import math
import struct

from vehicles.climb import ClimbLaw
from vehicles.stand_in import (
    ACCEPTED,
    CRITICAL,
    IN_AIR,
    INFO,
    LANDING,
    MESSAGES,
    ON_GROUND,
    TAKING_OFF,
    UNSUPPORTED,
    WARNING,
    StandIn,
    text,
)

from quad_nav.sim.flight import Airframe, AutopilotResponse
from quad_nav.sim.simulation_params import STEP_S

REJECTED = 1  # MAV_RESULT_TEMPORARILY_REJECTED
MANUAL, ALTCTL, POSCTL, OFFBOARD = (n << 16 for n in (1, 2, 3, 6))
HOLD, RTL, LAND = (4 << 16 | n << 24 for n in (3, 5, 6))
ACTIONS = {0: POSCTL, 1: ALTCTL, 2: MANUAL, 3: RTL, 4: LAND, 5: HOLD}
LINK_ACTIONS = {1: HOLD, 2: RTL, 3: LAND}
NAMES = {OFFBOARD: "Offboard", HOLD: "Hold", LAND: "Land", RTL: "Return"}
REAL32, INT32 = 9, 6
FLOATS = ("COM_OF_LOSS_T", "COM_FAIL_ACT_T", "RTL_RETURN_ALT", "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST")
STREAM_S, GAP_S = 1.0, 0.5
SPOOL_S, LIFTS_MPS, RAMP_S = 1.0, 0.05, 3.0
LANDED_S, DISARM_LANDED_S, DISARM_PREFLIGHT_S = 1.0, 2.0, 10.0
LAND_MPS, RETURN_MPS, BRAKE_S = 0.7, 1.5, 0.6
POSITION_S = 10.0
FORCE = 21196
LOW_V, NO_AID_S = 10.5, 5.0  # 3.5 V for each cell; EKF2_NOAID_TOUT
UNASKED_S = {
    "ATTITUDE": 1 / 15.0,
    "LOCAL_POSITION_NED": 1.0,
    "SYS_STATUS": 1.0,
    "EXTENDED_SYS_STATE": 1.0,
    "RC_CHANNELS": 0.2,
}
AIRFRAME = Airframe(
    response=AutopilotResponse(
        velocity_delay_s=0.1,
        velocity_time_s=1.0 / 1.8,
        yaw_delay_s=0.05,
        yaw_frequency_radps=10.0,
        yaw_damping=1.0,
    )
)


class Px4(StandIn):
    """The autopilot; modes by PX4's own numbers."""

    NUMBER = 12
    MESSAGES = {number: name for number, name in MESSAGES.items() if number != 193}
    MESSAGES[230] = "ESTIMATOR_STATUS"
    DEFAULTS = {
        "COM_OF_LOSS_T": 1.0,
        "COM_OBL_RC_ACT": 0.0,
        "COM_FAIL_ACT_T": 5.0,
        "COM_DL_LOSS_T": 10.0,
        "NAV_DLL_ACT": 0.0,
        "NAV_RCL_ACT": 2.0,
        "COM_RCL_EXCEPT": 0.0,
        "COM_LOW_BAT_ACT": 0.0,
        "EKF2_GPS_CTRL": 7.0,
        "RTL_RETURN_ALT": 60.0,
        "GF_ACTION": 2.0,
        "GF_MAX_HOR_DIST": 0.0,
        "GF_MAX_VER_DIST": 0.0,
    }
    kind = {"control": OFFBOARD, "land": LAND, "other": POSCTL}

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.mode = HOLD
        self.climb = ClimbLaw(self.estimator)
        self._periods = dict(UNASKED_S)
        self._heard_s = self._armed_s = self._setpoint_s = self._stream_s = -math.inf
        self._flown_s = self._lift_s = -math.inf
        self._touch_s = self._brake = self._action = None
        self._is_flying, self._wants_up = False, 0.0
        self._gps_lost_s = None

    @property
    def base_mode(self):
        return 1 | (128 if self.armed else 0)

    @property
    def has_position(self):
        return super().has_position and self.boot_s >= POSITION_S

    @property
    def has_stream(self):
        """Whether set-points have come for long enough, without a gap."""
        is_fresh = self.now_s - self._setpoint_s < GAP_S
        return is_fresh and self.now_s - self._stream_s >= STREAM_S

    def say(self, severity, words):
        """Send a text; the tab says that there is an event of the same meaning, too."""
        super().say(severity, words + "\t")

    # Parameters.

    def _send_parameter(self, name):
        if name in self.parameters:
            value, kind = self.parameters[name], REAL32
            if name not in FLOATS:
                value, kind = struct.unpack("<f", struct.pack("<i", int(value)))[0], INT32
            names = dict(param_id=name, param_value=value, param_type=kind)
            self.send("PARAM_VALUE", param_count=900, param_index=65535, **names)

    def _on_param_set(self, message, _):
        name = text(message.param_id)
        if name in self.parameters:
            value = message.param_value
            if message.param_type == INT32:
                value = struct.unpack("<i", struct.pack("<f", value))[0]
            self.parameters[name] = float(value)
            self._send_parameter(name)

    # Commands.

    def command(self, number, message):
        if number == 176:
            return self._ask_mode(int(message.param2) << 16 | int(message.param3) << 24)
        if number == 21:
            return self._ask_mode(LAND)
        if number == 400:
            return self._arm(message)
        return UNSUPPORTED, []

    def _ask_mode(self, mode):
        if self.armed and mode == OFFBOARD and not (self.has_stream and self.has_position):
            what = f"Switching to {NAMES[mode]} is currently not available"
            return REJECTED, [(CRITICAL, what)]
        if mode != self.mode:
            self.set_mode(mode)
        return ACCEPTED, []

    def set_mode(self, mode):
        """Change the mode, by a command of somebody else or by a failsafe."""
        self._action = None
        if mode != self.mode and self._is_flying:
            self._brake = (self.now_s, *self._bodies.body_velocity_mps(self._robot))
            self.climb.stop()
        super().set_mode(mode)

    def _arm(self, message):
        if message.param1 == 0:
            if self.landed != ON_GROUND and int(message.param2) != FORCE:
                return REJECTED, [(CRITICAL, "Disarming denied: not landed")]
            self._disarm("Disarmed by external command")
            return ACCEPTED, []
        if self.armed:
            return ACCEPTED, []
        problems = self._arming_problems()
        if problems:
            texts = [(CRITICAL, f"Preflight Fail: {one}") for one in problems]
            denied = (CRITICAL, "Arming denied: Resolve system health failures first")
            return REJECTED, [*texts, denied]
        self.armed, self._armed_s = True, self.now_s
        return ACCEPTED, [(INFO, "Armed by external command")]

    def _arming_problems(self):
        found = [self.refuses_arming] if self.refuses_arming else []
        if self.parameters["NAV_DLL_ACT"] and self.now_s - self._heard_s > self._link_s:
            found.append("No connection to the GCS")
        if not self.has_position:
            found.append("position estimate invalid")
        if self.mode == OFFBOARD and not self.has_stream:
            found.append("No offboard signal")
        return found

    def _disarm(self, words):
        if self.armed:
            self.armed = self._is_flying = False
            self.say(INFO, words)

    # Other messages to it.

    def _on_heartbeat(self, message, _):
        if message.type == 6:  # a ground station
            self._heard_s = self.now_s

    def _on_set_position_target_local_ned(self, message, _):
        self.setpoints.append((self.now_s, message))
        if self.now_s - self._setpoint_s > GAP_S:
            self._stream_s = self.now_s
        self._setpoint_s = self.now_s
        velocity = (message.vx, message.vy, message.vz)
        is_velocity = not message.type_mask & 0b111000 and all(map(math.isfinite, velocity))
        if self.mode != OFFBOARD or not is_velocity or message.coordinate_frame not in (1, 8):
            return
        forward, right = message.vx, message.vy
        if message.coordinate_frame == 1:
            cos, sin = math.cos(self.estimator.heading_rad), math.sin(self.estimator.heading_rad)
            forward, right = cos * forward + sin * right, cos * right - sin * forward
        rate = 0.0 if message.type_mask & 2048 else message.yaw_rate
        self._wants_up, self._brake = -message.vz, None
        if self._is_flying:
            self._bodies.set_velocity(self._robot, forward, -right, -rate)

    # Flight.

    @property
    def _link_s(self):
        return self.parameters["COM_DL_LOSS_T"]

    def fly(self):
        self._watch()
        self._lift_or_land()
        self._move()
        rate = self._bodies.velocity_mps(self._robot)[2]
        lift = self.climb.acceleration_mps2(rate) if self._is_flying and self.armed else None
        if lift is not None and self._touch_s is not None and self.climb.velocity_mps <= 0.0:
            lift = None
        self._bodies.lift_mps2[self._robot] = lift

    def lose_receiver(self):
        """Let the receiver lose its position."""
        self._gps_lost_s, self.estimator.is_dead_reckoning = self.now_s, True
        self.say(WARNING, "GNSS data fusion stopped")

    def lose_radio(self):
        """Let the pilot's transmitter fall silent."""
        mode = LINK_ACTIONS.get(int(self.parameters["NAV_RCL_ACT"]))
        if mode is not None and not int(self.parameters["COM_RCL_EXCEPT"]) & 4:
            self._hold_then(mode)

    def _watch_sensors(self):
        if self._gps_lost_s is not None and self.now_s - self._gps_lost_s > NO_AID_S:
            self.estimator.is_lost = True
            if self.armed and self.mode != LAND:
                self.set_mode(LAND)
                self.say(CRITICAL, "Failsafe activated")
        if self.is_voltage_low(LOW_V, 1.0) and not self.has_low_battery:
            self.has_low_battery = True
            self.say(CRITICAL, "Low battery")

    def _watch(self):
        """Hold, and act later, when the stream or the ground station is lost."""
        self._watch_sensors()
        if not self.armed:
            return
        if self._action is not None and self.now_s >= self._action[0]:
            mode = self._action[1]
            self.set_mode(mode)
            self.say(CRITICAL, "Failsafe activated")
        is_late = self.now_s - self._setpoint_s > self.parameters["COM_OF_LOSS_T"]
        if self.mode == OFFBOARD and is_late:
            self._hold_then(ACTIONS.get(int(self.parameters["COM_OBL_RC_ACT"]), HOLD))
        is_late = self.now_s - self._heard_s > self._link_s
        mode = LINK_ACTIONS.get(int(self.parameters["NAV_DLL_ACT"]))
        if mode is not None and is_late and self._action is None and self.mode not in (LAND, RTL):
            self._hold_then(mode)

    def _hold_then(self, mode):
        wait_s = self.parameters["COM_FAIL_ACT_T"]
        self.set_mode(HOLD)
        self._action = (self.now_s + wait_s, mode)
        self.say(CRITICAL, f"Failsafe activated, entering Hold for {wait_s:.0f} seconds")

    def _lift_or_land(self):
        if self._is_flying:
            self._in_the_air()
        elif self.armed:
            spooled = self.now_s - self._armed_s > SPOOL_S
            if self.mode == OFFBOARD and spooled and self._wants_up > LIFTS_MPS:
                self._is_flying, self._touch_s, self._lift_s = True, None, self.now_s
                self.landed = TAKING_OFF
                self.say(INFO, "Takeoff detected")
            begin_s = max(self._armed_s, self._flown_s)
            after_flight = self._flown_s > self._armed_s
            wait_s = DISARM_LANDED_S if after_flight else DISARM_PREFLIGHT_S
            if not self._is_flying and self.now_s - begin_s > wait_s:
                self._disarm(
                    "Disarmed by landing" if after_flight else "Disarmed by auto preflight"
                )

    def _in_the_air(self):
        touches = self._bodies.is_touching(self._robot) and self.climb.velocity_mps <= 0.0
        if not touches:
            self._touch_s = None
            self.landed = LANDING if self.mode == LAND else IN_AIR
            return
        self._touch_s = self.now_s if self._touch_s is None else self._touch_s
        if self.now_s - self._touch_s > LANDED_S:
            self.landed, self._flown_s, self._is_flying = ON_GROUND, self.now_s, False
            self.say(INFO, "Landing detected")

    def _move(self):
        if not self._is_flying:
            return
        if self._brake is not None:
            begin_s, forward, left = self._brake
            share = max(1.0 - (self.now_s - begin_s) / BRAKE_S, 0.0)
            self._bodies.set_velocity(self._robot, share * forward, share * left, 0.0)
            if share == 0.0:
                self._brake = None
        if self.mode == OFFBOARD:
            ramp = min(1.0, (self.now_s - self._lift_s + STEP_S) / RAMP_S)
            up = self._wants_up
            self.climb.set_velocity(up * ramp if up > 0.0 else up)
        elif self.mode == LAND:
            self.climb.set_velocity(-LAND_MPS)
        elif self.mode == RTL:
            is_below = self.height_m < self.parameters["RTL_RETURN_ALT"]
            self.climb.ramp(RETURN_MPS if is_below else 0.0, 1.0)
        elif self.mode in (POSCTL, ALTCTL):
            self.climb.ramp(-RETURN_MPS if self.sticks[2] < 1400 else 0.0, 2.0)
