"""Fields of the messages that a stand-in sends when it was asked for them."""

from __future__ import annotations

from vehicles.estimator import euler

GLITCH_RATIO = 1.5
MESSAGES = {
    1: "SYS_STATUS",
    24: "GPS_RAW_INT",
    30: "ATTITUDE",
    31: "ATTITUDE_QUATERNION",
    32: "LOCAL_POSITION_NED",
    65: "RC_CHANNELS",
    85: "POSITION_TARGET_LOCAL_NED",
    193: "EKF_STATUS_REPORT",
    245: "EXTENDED_SYS_STATE",
}


class Messages:
    """Makers of messages, each called by the name of its message."""

    def _make_sys_status(self):
        sensors = 1 << 28 | 1 << 25
        health = (0 if self.refuses_arming else 1 << 28) | (0 if self.has_low_battery else 1 << 25)
        names = ("load", "drop_rate_comm", "errors_comm")
        names += tuple(f"errors_count{k}" for k in (1, 2, 3, 4))
        return dict(
            onboard_control_sensors_present=sensors,
            onboard_control_sensors_enabled=sensors,
            onboard_control_sensors_health=health,
            voltage_battery=round(1e3 * self.voltage_v),
            current_battery=0,
            battery_remaining=int(self.battery),
            **dict.fromkeys(names, 0),
        )

    def _make_gps_raw_int(self):
        zeros = dict.fromkeys(("lat", "lon", "alt", "vel", "cog"), 0)
        return dict(
            time_usec=int(self.clock_s * 1e6),
            fix_type=6 if self.has_receiver else 1,
            eph=121,
            epv=200,
            satellites_visible=10 if self.has_receiver else 3,
            **zeros,
        )

    def _make_attitude(self):
        roll, pitch, yaw = euler(self.estimator.attitude)
        p, q, r = self.estimator.rates_frd
        return dict(
            time_boot_ms=self._boot_ms,
            roll=roll,
            pitch=pitch,
            yaw=yaw,
            rollspeed=p,
            pitchspeed=q,
            yawspeed=r,
        )

    def _make_attitude_quaternion(self):
        w, x, y, z = self.estimator.attitude
        p, q, r = self.estimator.rates_frd
        rates = dict(rollspeed=p, pitchspeed=q, yawspeed=r)
        return dict(time_boot_ms=self._boot_ms, q1=w, q2=x, q3=y, q4=z, **rates)

    def _make_local_position_ned(self):
        (x, y, z), (vx, vy, vz) = self.estimator.position_ned, self.estimator.velocity_ned
        return dict(time_boot_ms=self._boot_ms, x=x, y=y, z=z, vx=vx, vy=vy, vz=vz)

    def _make_rc_channels(self):
        values = [*self.sticks, *(1000,) * 14]
        channels = {f"chan{k}_raw": value for k, value in enumerate(values, 1)}
        return dict(time_boot_ms=self._boot_ms, chancount=16, rssi=255, **channels)

    def _make_position_target_local_ned(self):
        names = ("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate")
        values = dict.fromkeys(names, 0.0)
        return dict(time_boot_ms=self._boot_ms, coordinate_frame=1, type_mask=3079, **values)

    def _make_ekf_status_report(self):
        names = ("velocity_variance", "pos_horiz_variance", "pos_vert_variance")
        names += ("compass_variance", "terrain_alt_variance")
        values = dict.fromkeys(names, 0.01)
        values["pos_horiz_variance"] = 0.01 if self._glitch is None else GLITCH_RATIO
        return dict(flags=831 if self.has_position else 167, **values)

    def _make_estimator_status(self):
        names = ("vel_ratio", "pos_vert_ratio", "mag_ratio", "hagl_ratio", "tas_ratio")
        ratio = 0.01 if self._glitch is None else GLITCH_RATIO
        return dict(
            time_usec=int(self.clock_s * 1e6),
            flags=831 if self.has_position else 167,
            pos_horiz_ratio=ratio,
            pos_horiz_accuracy=0.3,
            pos_vert_accuracy=0.3,
            **dict.fromkeys(names, 0.01),
        )

    def _make_extended_sys_state(self):
        return dict(vtol_state=3, landed_state=self.landed)
