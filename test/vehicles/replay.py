#!/usr/bin/env python3
"""Replay the received side of recorded MAVLink logs, and check what the bridge sends.

    PYTHONPATH=src:test python3 test/vehicles/replay.py FOLDER

Each line of a log is a JSON object with `t` (s), `dir` (`rx` from the vehicle), `sys`, `comp`,
`name` and `fields`, where a missing field is 0. The vehicle does not react to the bridge, so that
only the kind, the rate and the order of what is sent can be compared: the bridge follows a vehicle
that others fly.

Checked for each log: nothing but known messages; finite set-points in frame 8 with mask 1479 at
20 Hz; none while the vehicle is on the ground, taking off, landing, in another mode, or silent; no
order but those that the state allows; no order after the vehicle was taken over; and what the
bridge says about the failsafes of `TOLD`.
"""

from __future__ import annotations

import collections
import json
import math
import sys
from pathlib import Path

from vehicles.stand_in import Fields

from quad_nav.geometry import Twist2D
from quad_nav.topics.vehicle_states import State
from quad_vehicles.autopilots import AUTOPILOTS
from quad_vehicles.mavlink_adapter import MavlinkAdapter
from quad_vehicles.orders import Permissions
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Limits
from quad_vehicles.vehicle_file import OUR_SYSTEM, Vehicle

TICK_S, COMMAND_S = 0.01, 0.05
GUIDED = 4
NOTICED_S = 0.1  # the stream ends this long after the vehicle says that it stands
KNOWN = {
    "HEARTBEAT",
    "TIMESYNC",
    "PARAM_REQUEST_READ",
    "PARAM_SET",
    "COMMAND_LONG",
    "SET_POSITION_TARGET_LOCAL_NED",
}
TOLD = {
    "gcs_failsafe": "taken over: the mode was changed to LAND by the autopilot: GCS Failsafe",
    "rc_failsafe": "taken over: the mode was changed to RTL by the autopilot: Radio Failsafe",
    # At 6.2 s; the autopilot's own failsafe acts at 8.1 s.
    "gps_lost": "landing: the GPS has lost its position (3 satellites) for 2 s",
}
PARAMETERS = {
    "GUID_TIMEOUT": 0.5,
    "FENCE_TYPE": 3.0,
    "FENCE_ACTION": 2.0,
    "FENCE_ALT_MAX": 20.5,
    "FENCE_RADIUS": 100.5,
    "FENCE_MARGIN": 0.25,
    "FENCE_ENABLE": 1.0,
    "FS_GCS_ENABLE": 5.0,
    "SYSID_MYGCS": float(OUR_SYSTEM),
    "FS_THR_ENABLE": 3.0,
    "FS_OPTIONS": 0.0,
    "FS_EKF_ACTION": 1.0,
    "RTL_ALT": 1500.0,
    "BATT_FS_LOW_ACT": 1.0,
    "BATT_LOW_VOLT": 10.5,
    "EK3_SRC1_POSXY": 3.0,
}


class Replay:
    """One vehicle of a log, and the bridge that listens to it."""

    def __init__(self, path, system=1):
        self.rows = [
            row
            for row in map(json.loads, path.read_text().splitlines())
            if row["dir"] == "rx" and row["sys"] == system
        ]
        limits = Limits(height_m=20.0, radius_m=100.0, battery=0.0)
        traits = AUTOPILOTS["ardupilot"].traits
        self.machine = VehicleMachine(1.5, limits, traits, Permissions(may_arm=True))
        vehicle = Vehicle(0, "mavlink", limits=limits, altitude_m=1.5, has_radio=False)
        self.adapter = MavlinkAdapter(vehicle, self.machine)
        self.sent, self.states, self.news, self._name = [], [], [], path.stem
        self._command_s = 0.0
        self.modes, self.landed = [], []  # (time, value) as received

    def run(self):
        """Replay all; the parameters that a log lacks are answered as a safe vehicle would."""
        waiting, now_s = collections.deque(self.rows), 0.0
        end_s = self.rows[-1]["t"] + 2.0
        asked = False
        while now_s < end_s:
            now_s = round(now_s + TICK_S, 3)
            while waiting and waiting[0]["t"] <= now_s:
                self._receive(waiting.popleft(), now_s)
            messages = []
            if now_s >= self._command_s:
                self._command_s += COMMAND_S
                messages = self.adapter.follow(Twist2D(0.3, 0.0, 0.1), now_s)[1]
            output, more = self.adapter.tick(now_s)
            self.news += output.news
            for name, fields in messages + more:
                self.sent.append((now_s, name, fields))
                self._answer(name, fields, now_s)
            state = self.machine.state
            if not self.states or self.states[-1][1] is not state:
                self.states.append((now_s, state))
            # In a log that begins in flight the bridge is asked to fly on, once.
            if state is State.TAKEN_OVER and not asked:
                asked = True
                self.machine.odom_from_start = self.machine.inputs.estimate and (
                    self.machine.inputs.estimate.odom_from_base.to_2d()
                )
                self.machine.resume(now_s)
            if state is State.READY and not asked:
                asked = True
                self.machine.take_off(now_s)

    def _receive(self, row, now_s):
        fields = {
            name: math.nan if value == "NaN" else value for name, value in row["fields"].items()
        }
        fields.setdefault("text", "")
        if row["name"] == "HEARTBEAT" and row["comp"] == 1:
            self.modes.append((now_s, fields.get("custom_mode", 0), fields.get("base_mode", 0)))
        if row["name"] == "EXTENDED_SYS_STATE":
            self.landed.append((now_s, fields.get("landed_state", 0)))
        if row["name"] == "PARAM_VALUE":
            return
        self.adapter.receive(row["name"], row["comp"], Fields(**fields), now_s)

    def _answer(self, name, fields, now_s):
        known = fields.get("param_id") in PARAMETERS
        if name in ("PARAM_REQUEST_READ", "PARAM_SET") and known:
            value = fields.get("param_value", PARAMETERS.get(fields["param_id"]))
            answer = Fields(param_id=fields["param_id"], param_value=value, param_type=9)
            self.adapter.receive("PARAM_VALUE", 1, answer, now_s)

    def problems(self):
        """Return what was sent that should not have been."""
        found = [f"{name} sent" for _, name, _ in self.sent if name not in KNOWN]
        stream = [(s, f) for s, name, f in self.sent if name == "SET_POSITION_TARGET_LOCAL_NED"]
        for at_s, fields in stream:
            numbers = [fields[key] for key in ("vx", "vy", "vz", "yaw_rate")]
            if not all(map(math.isfinite, numbers)):
                found.append(f"{at_s:.2f} s: set-point {numbers}")
            if (fields["coordinate_frame"], fields["type_mask"]) != (8, 1479):
                found.append(f"{at_s:.2f} s: another frame or mask")
            mode, armed = last(self.modes, at_s)
            landed = last(self.landed, at_s)[0]
            stopping = at_s - TICK_S * 1.5 < self._left_s(at_s)
            if mode != GUIDED and not stopping:
                found.append(f"{at_s:.2f} s: set-point in mode {mode}")
            if not armed & 128:
                found.append(f"{at_s:.2f} s: set-point while disarmed")
            if landed == 3 or (landed == 1 and at_s - self._landed_s(at_s) > NOTICED_S):
                found.append(f"{at_s:.2f} s: set-point with landed_state {landed}")
        found += self._order_problems()
        told = TOLD.get(self._name)
        if told and told not in self.news:
            found.append(f"not told: {told}")
        return list(dict.fromkeys(found))[:10]

    def _landed_s(self, at_s):
        """Return since when the last landed_state has been received."""
        row = [row for row in self.landed if row[0] <= at_s]
        since_s = row[-1][0]
        for time_s, value in reversed(row):
            if value != row[-1][1]:
                break
            since_s = time_s
        return since_s

    def _left_s(self, at_s):
        """Return when GUIDED was left last before a time; -inf if it was not."""
        changes = [b[0] for a, b in zip(self.modes, self.modes[1:]) if a[1] == GUIDED != b[1]]
        return max((s for s in changes if s <= at_s), default=-math.inf)

    def _order_problems(self):
        """Check that nothing is ordered after the vehicle was taken over a second time."""
        over = [at_s for at_s, state in self.states if state is State.TAKEN_OVER]
        if len(over) < 2:
            return []
        return [
            f"{at_s:.2f} s: command {fields['command']} after it was taken over"
            for at_s, name, fields in self.sent
            if name == "COMMAND_LONG" and fields["command"] != 511 and at_s > over[1]
        ]

    def rate_hz(self):
        """Return the rate of the stream while it lasts; None without one."""
        times = [s for s, name, _ in self.sent if name == "SET_POSITION_TARGET_LOCAL_NED"]
        gaps = [b - a for a, b in zip(times, times[1:]) if b - a < 0.2]
        return len(gaps) / sum(gaps) if len(gaps) > 20 else None


def last(history, at_s):
    """Return the values that were received last before a time."""
    rows = [row[1:] for row in history if row[0] <= at_s]
    return rows[-1] if rows else (0, 0)


def main():
    folder = Path(sys.argv[1])
    logs = sorted(folder.glob("*.jsonl"))
    if not logs:
        print(f"no logs in {folder}")
        return 2
    failed = 0
    for path in logs:
        for system in (1, 2) if "two_vehicles" in path.name else (1,):
            replay = Replay(path, system)
            replay.run()
            problems, rate = replay.problems(), replay.rate_hz()
            if rate is not None and not 19.0 < rate < 21.0:
                problems.append(f"rate {rate:.1f} Hz")
            failed += bool(problems)
            names = collections.Counter(name for _, name, _ in replay.sent)
            print(f"{path.stem}/{system}: {'ok' if not problems else 'FAILED'}")
            print("   states:", ", ".join(f"{s:.1f} {state.value}" for s, state in replay.states))
            print("   sent:", dict(names), "" if rate is None else f"stream {rate:.1f} Hz")
            for problem in problems:
                print("   ", problem)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
