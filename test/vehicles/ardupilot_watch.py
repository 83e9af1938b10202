"""Boot, arming checks and failsafes of the stand-in for ArduCopter."""

from __future__ import annotations

import math

from vehicles.stand_in import CRITICAL, INFO, WARNING, StandIn

STABILIZE, ALT_HOLD, GUIDED, LOITER, RTL, LAND, POSHOLD, BRAKE = 0, 2, 4, 5, 6, 9, 16, 17
BOOT_TEXTS = (
    (1.056, "Calibrating barometer"),
    (2.655, "Barometer 1 calibration complete"),
    (2.655, "Barometer 2 calibration complete"),
    (3.180, "ArduPilot Ready"),
    (3.181, "AHRS: DCM active"),
    (3.478, "RC7: SaveWaypoint LOW"),
    (5.187, "EKF3 IMU0 initialised"),
    (5.187, "EKF3 IMU1 initialised"),
    (5.187, "AHRS: EKF3 active"),
    (6.534, "EKF3 IMU0 tilt alignment complete"),
    (6.534, "EKF3 IMU1 tilt alignment complete"),
    (6.633, "EKF3 IMU0 MAG0 initial yaw alignment complete"),
    (6.633, "EKF3 IMU1 MAG0 initial yaw alignment complete"),
    (10.543, "GPS 1: detected as u-blox at 230400 baud"),
    (20.754, "EKF3 IMU0 origin set"),
    (20.784, "Field Elevation Set: 488m"),
    (20.947, "EKF3 IMU1 origin set"),
    (42.156, "EKF3 IMU0 is using GPS"),
    (42.353, "EKF3 IMU1 is using GPS"),
)
STANDBY_S, ACCELS_S, GYROS_S, HOME_S, POSITION_S = 3.9, 14.0, 24.5, 20.754, 42.156
PREARM_S = 31.18
GCS_LATE_S, RADIO_S, GPS_S, GPS_END_S = 0.3, 0.99, 8.13, 15.19
LOW_VOLTAGE_S = 10.0  # BATT_LOW_TIMER
BATTERY_MODES = {1: LAND, 2: RTL, 3: RTL, 4: LAND, 6: RTL}
LAND_PAUSE_S = 4.0  # before the descent of a failsafe


class ArduPilotWatch(StandIn):
    """Boot, reasons not to arm, and failsafes, as recorded."""

    NUMBER = 3
    DEFAULTS = {
        "GUID_TIMEOUT": 3.0,
        "FS_GCS_ENABLE": 0.0,
        "FS_GCS_TIMEOUT": 5.0,
        "SYSID_MYGCS": 255.0,
        "FS_THR_ENABLE": 1.0,
        "FS_OPTIONS": 0.0,
        "FS_EKF_ACTION": 1.0,
        "RTL_ALT": 1500.0,
        "BATT_FS_LOW_ACT": 0.0,
        "BATT_LOW_VOLT": 10.5,
        "EK3_SRC1_POSXY": 3.0,
        "FENCE_ENABLE": 0.0,
        "FENCE_TYPE": 7.0,
        "FENCE_ACTION": 1.0,
        "FENCE_ALT_MAX": 100.0,
        "FENCE_RADIUS": 300.0,
        "FENCE_MARGIN": 2.0,
        "SIM_RC_FAIL": 0.0,
        "SIM_GPS_DISABLE": 0.0,
    }
    kind = {"control": GUIDED, "land": LAND, "other": LOITER}

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self._heard_s, self._descent_s = -math.inf, -math.inf
        self._radio_lost_s = self._gps_lost_s = None
        self._fired, self._told = set(), self.boot_s
        self._home = self.estimator.position_ned

    @property
    def system_status(self):
        return 4 if self.boot_s < STANDBY_S else super().system_status

    @property
    def has_position(self):
        return super().has_position and self.boot_s >= POSITION_S

    def _arming_problems(self):
        if self.mode == LAND:
            return ["LAND mode not armable"]
        if self.refuses_arming:
            return [self.refuses_arming]
        if "radio" in self._fired:
            return ["Radio failsafe on"]
        if self.has_low_battery:
            return ["Battery failsafe"]
        found = []
        if self.boot_s < ACCELS_S:
            found.append("Accels inconsistent")
        elif self.boot_s < GYROS_S:
            found.append("Gyros inconsistent")
        if self.boot_s < HOME_S:
            found.append("AHRS: waiting for home")
        elif not self.has_position:
            found.append("Need Position Estimate")
        return found

    def _on_heartbeat(self, _, sender):
        if sender[0] == int(self.parameters["SYSID_MYGCS"]):
            self._heard_s = self.now_s
            if "gcs" in self._fired:
                self._clear("gcs", "GCS Failsafe Cleared")

    def lose_receiver(self):
        """Let the receiver lose its position."""
        self.receive("PARAM_SET", {"param_id": "SIM_GPS_DISABLE", "param_value": 1.0})

    def lose_radio(self):
        """Let the pilot's transmitter fall silent."""
        self.receive("PARAM_SET", {"param_id": "SIM_RC_FAIL", "param_value": 1.0})

    def parameter_changed(self, name, before):
        value = self.parameters[name]
        if name == "SIM_RC_FAIL":
            self._radio_lost_s = self.now_s if value else None
            if not value and "radio" in self._fired:
                self._clear("radio", "Radio Failsafe Cleared")
        elif name == "SIM_GPS_DISABLE":
            self._gps_lost_s = self.now_s if value else None
            self.estimator.is_dead_reckoning = bool(value)

    def _boot(self):
        for at_s, words in BOOT_TEXTS:
            if self._told <= at_s < self.boot_s:
                if at_s == HOME_S:
                    self._send_home()
                self.say(INFO, words)
        if self.boot_s < POSITION_S and self._told < PREARM_S <= self.boot_s:
            self.say(CRITICAL, "PreArm: Need Position Estimate")
        self._told = max(self._told, self.boot_s)

    def _send_home(self):
        self.send("GPS_GLOBAL_ORIGIN", latitude=0, longitude=0, altitude=0, time_usec=0)
        zeros = dict.fromkeys(("latitude", "longitude", "altitude"), 0)
        approach = dict.fromkeys(("approach_x", "approach_y", "approach_z"), 0.0)
        x, y, z = self._home
        q = [math.nan] * 4
        self.send("HOME_POSITION", **zeros, x=x, y=y, z=z, q=q, **approach, time_usec=0)

    def _watch(self):
        """Act on a lost ground station, radio or position."""
        if self._radio_lost_s is not None and self.now_s - self._radio_lost_s > RADIO_S:
            self._lose_radio()
        if self._gps_lost_s is not None:
            self._lose_position(self.now_s - self._gps_lost_s)
        if self.is_voltage_low(self.parameters["BATT_LOW_VOLT"], LOW_VOLTAGE_S):
            self._tell_low_battery()
        enabled = self.parameters["FS_GCS_ENABLE"]
        silent_s = self.parameters["FS_GCS_TIMEOUT"] + GCS_LATE_S
        late = -math.inf < self._heard_s < self.now_s - silent_s
        if self.armed and enabled and late and "gcs" not in self._fired:
            self._fire("gcs", LAND if enabled == 5 else RTL, "GCS Failsafe")

    def _tell_low_battery(self):
        """Tell it once and act; until a reboot it does not arm again."""
        if self.armed and not self.has_low_battery:
            self.has_low_battery = True
            self.say(WARNING, f"Battery 1 is low {self.voltage_v:.2f}V used 0 mAh")
            mode = BATTERY_MODES.get(int(self.parameters["BATT_FS_LOW_ACT"]))
            self._fire("battery", mode, "Battery Failsafe")

    def _lose_radio(self):
        action = self.parameters["FS_THR_ENABLE"]
        if "radio" in self._fired or not action:
            return
        if int(self.parameters["FS_OPTIONS"]) & 4 and self.mode == GUIDED:
            self._fire("radio", None, "Radio Failsafe - Continuing Guided Mode")
        elif self.armed:
            self._fire("radio", LAND if action == 3 else RTL, "Radio Failsafe")
        else:
            self._fired.add("radio")

    def _lose_position(self, since_s):
        if since_s > GPS_S and "ekf" not in self._fired:
            if self.armed and self.parameters["FS_EKF_ACTION"]:
                self._fire("ekf", LAND, "EKF variance", "EKF Failsafe: changed to LAND Mode")
            self._fired.add("ekf")
        if since_s > GPS_END_S and "aiding" not in self._fired:
            self._fired.add("aiding")
            self.estimator.is_lost = True
            self.say(WARNING, "EKF3 IMU1 stopped aiding")
            self.say(WARNING, "EKF3 IMU0 stopped aiding")

    def _fire(self, name, mode, *texts):
        self._fired.add(name)
        self.is_critical = True
        if mode is not None and mode != self.mode:
            self.set_mode(mode)
            self._descent_s = self.now_s + LAND_PAUSE_S
        for words in texts:
            self.say(CRITICAL if name == "ekf" else WARNING, words)

    def _clear(self, name, words):
        self._fired.discard(name)
        self.is_critical = bool(self._fired)
        self.say(WARNING, words)
