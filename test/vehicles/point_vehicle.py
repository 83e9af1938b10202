"""A point that flies and speaks MAVLink, as much as the bridge's own tests need.

It has neither attitude nor estimator. Its velocity follows set-points with the delay and the lag of
ArduCopter 4.5.3; refusals, the take-off that a set-point cancels, the time-out of the stream and
the failsafe for a lost ground station are as recorded.
"""

from __future__ import annotations

import math
from collections import deque
from types import SimpleNamespace

from quad_vehicles.vehicle_file import OUR_SYSTEM

ARDUPILOT = {
    "autopilot": 3,
    "control": 4,
    "land": 9,
    "other": 5,
    "parameters": {
        "GUID_TIMEOUT": 3.0,
        "FS_GCS_ENABLE": 5.0,
        "SYSID_MYGCS": float(OUR_SYSTEM),
        "FS_THR_ENABLE": 3.0,
        "FS_OPTIONS": 0.0,
        "FS_EKF_ACTION": 1.0,
        "RTL_ALT": 1500.0,
        "BATT_FS_LOW_ACT": 1.0,
        "BATT_LOW_VOLT": 10.5,
        "EK3_SRC1_POSXY": 3.0,
        "FENCE_ENABLE": 0.0,
        "FENCE_TYPE": 7.0,
        "FENCE_ACTION": 1.0,
        "FENCE_ALT_MAX": 100.0,
        "FENCE_RADIUS": 300.0,
        "FENCE_MARGIN": 2.0,
    },
    "timeout": "GUID_TIMEOUT",
}
PX4 = {
    "autopilot": 12,
    "control": 6 << 16,
    "land": 4 << 16 | 6 << 24,
    "other": 3 << 16,
    "parameters": {
        "COM_OF_LOSS_T": 1.0,
        "COM_OBL_RC_ACT": 4.0,
        "NAV_DLL_ACT": 3.0,
        "NAV_RCL_ACT": 3.0,
        "COM_RCL_EXCEPT": 0.0,
        "COM_LOW_BAT_ACT": 2.0,
        "EKF2_GPS_CTRL": 7.0,
        "RTL_RETURN_ALT": 30.0,
        "GF_ACTION": 0.0,
        "GF_MAX_HOR_DIST": 0.0,
        "GF_MAX_VER_DIST": 0.0,
    },
    "timeout": "COM_OF_LOSS_T",
}
DELAY_S, LAG_S, VZ_LAG_S = 0.196, 0.449, 0.2
YAW_LAG_S = 0.2
RUN_UP_S = 3.1
DISARM_DELAY_S = 10.0
LINK_FAILSAFE_S = 5.3


class PointVehicle:
    """The vehicle; `receive` takes messages, `advance` returns those that it sends."""

    def __init__(self, kind=ARDUPILOT, start_ned=(0.0, 0.0), heading_rad=0.0, boot_s=0.0):
        self.kind, self.parameters = kind, dict(kind["parameters"])
        self.now_s, self.boot_s = 0.0, boot_s
        self.position = [start_ned[0], start_ned[1], 0.0]  # NED, m
        self.velocity = [0.0, 0.0, 0.0]
        self.heading_rad, self.yaw_rate = heading_rad, 0.0
        self.mode, self.armed, self.landed = 0, False, 1
        self.battery, self.sticks = 97, [1500, 1500, 1500, 1500]
        self.refuses_arming = ""
        self.is_frozen = self.hides_position = False  # its estimate
        self.jump_m = 0.0
        self.received = []  # names
        self.setpoints = []  # (time, fields)
        self._wanted = deque()  # (time, NED velocity, yaw rate)
        self._target, self._target_yaw_rate, self._setpoint_s = (0.0, 0.0, 0.0), 0.0, -math.inf
        self._takeoff_s, self._takeoff_m = None, 0.0
        self._armed_s = self._heard_s = 0.0
        self._grounded_s = None
        self._rates, self._last = {}, {"HEARTBEAT": -1.0}
        self._out = []
        self._seen = None

    # Messages to it.

    def receive(self, name, fields):
        self.received.append(name)
        handler = getattr(self, f"_on_{name.lower()}", None)
        if handler:
            handler(SimpleNamespace(**fields))

    def _on_heartbeat(self, _):
        self._heard_s = self.now_s

    def _on_timesync(self, message):
        if message.tc1 == 0:
            boot_ns = int((self.now_s + self.boot_s) * 1e9)
            self._send("TIMESYNC", tc1=boot_ns, ts1=message.ts1)

    def _on_param_request_read(self, message):
        self._send_parameter(message.param_id)

    def _on_param_set(self, message):
        if message.param_id in self.parameters:
            self.parameters[message.param_id] = message.param_value
        self._send_parameter(message.param_id)

    def _send_parameter(self, name):
        if name in self.parameters:
            self._send(
                "PARAM_VALUE",
                param_id=name,
                param_value=self.parameters[name],
                param_type=9,
                param_count=1346,
                param_index=65535,
            )

    def _on_command_long(self, message):
        handlers = {176: self._set_mode, 400: self._arm, 22: self._take_off, 511: self._set_rate}
        accepted = handlers.get(message.command, lambda _: False)(message)
        self._send(
            "COMMAND_ACK",
            command=message.command,
            result=0 if accepted else 4,
            progress=0,
            result_param2=0,
            target_system=255,
            target_component=191,
        )
        if not accepted and message.command == 400 and self.refuses_arming:
            self._send("STATUSTEXT", severity=2, text=f"Arm: {self.refuses_arming}")

    def _set_mode(self, message):
        if self.kind is PX4:
            mode = int(message.param2) << 16 | int(message.param3) << 24
            if mode == self.kind["control"] and self.now_s - self._setpoint_s > 0.5:
                return False
        else:
            mode = int(message.param2)
        self.set_mode(mode)
        return True

    def set_mode(self, mode):
        """Change the mode, as somebody else can; a heartbeat tells it at once."""
        self.mode = mode
        self._takeoff_s = None
        self._heartbeat()

    def freeze(self):
        """Let the estimate stay what it is."""
        self.is_frozen = True

    def jump(self, north_m=0.0, up_m=0.0):
        """Let the estimate jump."""
        self.jump_m = north_m
        self.position[2] -= up_m

    def kill_motors(self):
        """Disarm in the air."""
        self.armed = False
        self._heartbeat()

    @property
    def height_m(self):
        return -self.position[2]

    @property
    def speed_mps(self):
        return math.hypot(*self.velocity[:2])

    def _arm(self, message):
        if message.param1 == 1 and self.refuses_arming:
            return False
        if message.param1 == 0 and self.landed != 1:
            return False
        self.armed, self._armed_s = message.param1 == 1, self.now_s
        self._grounded_s = None
        self._heartbeat()
        return True

    def _take_off(self, message):
        if not self.armed or self.mode != self.kind["control"] or self.landed != 1:
            return False
        self._takeoff_s, self._takeoff_m = self.now_s, message.param7
        return True

    def _set_rate(self, message):
        names = {
            32: "LOCAL_POSITION_NED",
            30: "ATTITUDE",
            245: "EXTENDED_SYS_STATE",
            1: "SYS_STATUS",
            65: "RC_CHANNELS",
        }
        if int(message.param1) in names:
            self._rates[names[int(message.param1)]] = message.param2 / 1e6
        return int(message.param1) in names

    def _on_set_position_target_local_ned(self, message):
        self.setpoints.append((self.now_s, message))
        numbers = (message.vx, message.vy, message.vz, message.yaw_rate)
        assert all(map(math.isfinite, numbers)), numbers
        assert (message.coordinate_frame, message.type_mask) == (8, 1479)
        self._setpoint_s = self.now_s
        self._takeoff_s = None  # a take-off is cancelled, without a word
        cos, sin = math.cos(self.heading_rad), math.sin(self.heading_rad)
        velocity = (
            cos * message.vx - sin * message.vy,
            sin * message.vx + cos * message.vy,
            message.vz,
        )
        self._wanted.append((self.now_s + DELAY_S, velocity, message.yaw_rate))

    # Time.

    def advance(self, seconds):
        """Fly for a short time; return (name, fields) of the messages that it sends."""
        self.now_s += seconds
        self._watch()
        self._follow()
        self._move(seconds)
        self._land_or_lift()
        self._report()
        out, self._out = self._out, []
        return out

    def _watch(self):
        if self.armed and self.now_s - self._heard_s > LINK_FAILSAFE_S:
            if self.mode == self.kind["control"]:
                self._send("STATUSTEXT", severity=4, text="GCS Failsafe")
                self.set_mode(self.kind["land"])

    def _follow(self):
        while self._wanted and self._wanted[0][0] <= self.now_s:
            _, self._target, self._target_yaw_rate = self._wanted.popleft()
        if self.now_s - self._setpoint_s > self.parameters[self.kind["timeout"]]:
            self._target, self._target_yaw_rate = (0.0, 0.0, 0.0), 0.0
        if self.mode != self.kind["control"]:
            self._target, self._target_yaw_rate = (0.0, 0.0, 0.0), 0.0
            if self.mode == self.kind["land"]:
                self._target = (0.0, 0.0, 0.5)
        elif self._takeoff_s is not None:
            rising = self.now_s - self._takeoff_s > RUN_UP_S
            up = min(1.0, 1.5 * (self._takeoff_m + self.position[2])) if rising else 0.0
            self._target = (0.0, 0.0, -up)

    def _move(self, seconds):
        flies = self.armed and (self.position[2] < -0.01 or self._may_lift())
        lags = (LAG_S, LAG_S, VZ_LAG_S)
        for k in range(3):
            if flies:
                share = 1.0 - math.exp(-seconds / lags[k])
                self.velocity[k] += share * (self._target[k] - self.velocity[k])
            else:
                self.velocity[k] = 0.0
            self.position[k] += self.velocity[k] * seconds
        if flies:
            share = 1.0 - math.exp(-seconds / YAW_LAG_S)
            self.yaw_rate += share * (self._target_yaw_rate - self.yaw_rate)
            self.heading_rad += self.yaw_rate * seconds
        if self.position[2] > 0.0:
            self.position[2], self.velocity = 0.0, [0.0, 0.0, 0.0]

    def _may_lift(self):
        if self.kind is PX4:
            return self.mode == self.kind["control"] and self._target[2] < -0.05
        return self._takeoff_s is not None and self._target[2] < 0.0

    def _land_or_lift(self):
        height_m = -self.position[2]
        if height_m > 0.05:
            self._grounded_s = None
            if self.mode == self.kind["land"]:
                self.landed = 4
            elif self._takeoff_s is not None and height_m < 0.97 * self._takeoff_m:
                self.landed = 3
            else:
                self.landed = 2
            return
        if self._grounded_s is None:
            self._grounded_s = self.now_s
        if self.landed != 1 and self.now_s - self._grounded_s > 1.5:
            self.landed = 1
        wait_s = 2.0 if self.mode == self.kind["land"] else DISARM_DELAY_S
        if self.armed and self._takeoff_s is None:
            if self.now_s - max(self._grounded_s, self._armed_s) > wait_s:
                self.armed = False
                self._heartbeat()

    # Messages from it.

    def _send(self, name, **fields):
        self._out.append((name, fields))

    def _heartbeat(self):
        self._send(
            "HEARTBEAT",
            type=2,
            autopilot=self.kind["autopilot"],
            base_mode=209 if self.armed else 81,
            custom_mode=self.mode,
            system_status=4 if self.armed else 3,
            mavlink_version=3,
        )

    def _report(self):
        boot_ms = int((self.now_s + self.boot_s) * 1e3)
        if self._seen is None or not self.is_frozen:
            x, y, z = self.position
            self._seen = (x + self.jump_m, y, z, *self.velocity, self.heading_rad, self.yaw_rate)
        x, y, z, vx, vy, vz, heading, rate = self._seen
        makers = {
            "LOCAL_POSITION_NED": dict(time_boot_ms=boot_ms, x=x, y=y, z=z, vx=vx, vy=vy, vz=vz),
            "ATTITUDE": dict(
                time_boot_ms=boot_ms,
                roll=0.0,
                pitch=0.0,
                yaw=math.remainder(heading, math.tau),
                rollspeed=0.0,
                pitchspeed=0.0,
                yawspeed=rate,
            ),
            "EXTENDED_SYS_STATE": dict(vtol_state=0, landed_state=self.landed),
            "SYS_STATUS": system_status(self.battery),
            "RC_CHANNELS": channels(boot_ms, self.sticks),
        }
        if self._due("HEARTBEAT", 1.0):
            self._heartbeat()
        for name in ("ATTITUDE", "LOCAL_POSITION_NED", "EXTENDED_SYS_STATE", "SYS_STATUS"):
            if name == "LOCAL_POSITION_NED" and self.hides_position:
                continue
            if name in self._rates and self._due(name, self._rates[name]):
                self._send(name, **makers[name])
        if "RC_CHANNELS" in self._rates and self._due("RC_CHANNELS", self._rates["RC_CHANNELS"]):
            self._send("RC_CHANNELS", **makers["RC_CHANNELS"])

    def _due(self, name, period_s):
        if self.now_s - self._last.get(name, -math.inf) < period_s - 1e-6:
            return False
        self._last[name] = self.now_s
        return True


def system_status(battery):
    sensors = 1 << 28
    zeros = dict.fromkeys(
        (
            "load",
            "drop_rate_comm",
            "errors_comm",
            "errors_count1",
            "errors_count2",
            "errors_count3",
            "errors_count4",
        ),
        0,
    )
    return dict(
        onboard_control_sensors_present=sensors,
        onboard_control_sensors_enabled=sensors,
        onboard_control_sensors_health=sensors,
        voltage_battery=12600,
        current_battery=0,
        battery_remaining=battery,
        **zeros,
    )


def channels(boot_ms, sticks):
    values = [*sticks, *(1000,) * 14]
    return dict(
        time_boot_ms=boot_ms,
        chancount=16,
        rssi=255,
        **{f"chan{k}_raw": value for k, value in enumerate(values, 1)},
    )
