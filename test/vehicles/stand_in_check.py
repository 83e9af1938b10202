#!/usr/bin/env python3
"""Send the stand-in for ArduCopter what a recorded log has sent, and compare what it answers.

    PYTHONPATH=src:test python3 test/vehicles/stand_in_check.py FOLDER

The logs are those of `replay.py`. Compared are the events, in order and in time: acknowledgements,
texts, changes of mode, arming, `system_status` and `landed_state`, echoed parameters; and the
velocity and height at the times of the recorded estimates. What somebody else has done to the
recorded vehicle is in `OTHERS`.
"""

from __future__ import annotations

import difflib
import json
import math
import re
import statistics
import sys
from pathlib import Path

import numpy as np
from vehicles.ardupilot import GUIDED, LOITER, ArduPilot
from vehicles.bodies import Bodies
from vehicles.estimator import LocalFrame
from vehicles.stand_in import MESSAGES, advance

OTHERS = {
    "mode_kick_out": ((4.0, GUIDED, LOITER), (8.26, LOITER, GUIDED)),
    "mode_kick_out_throttle_low": ((4.0, GUIDED, LOITER), (8.255, LOITER, GUIDED)),
}
MISDIRECTED_S, OTHER_SYSTEM = {"two_vehicles": 21.0}, 99
"""From then on all set-points go to vehicle 1, those for vehicle 2 too."""
DEAD_RECKONING_S = {"gps_lost": 8.5}
"""From then on the recorded velocity drifts, without a position."""
LATE_S = {"landed": 0.7, "armed": 1.1, "status": 1.1}
"""Told at the next message only; the recorded ones are thinned or come once a second."""
MOST_LATE_S = 0.35
MOST_RMS_MPS, MOST_RMS_M = 0.10, 0.10
UNASKED = ("STAT_", "MOT_THST_HOVER")
SITL_THROTTLE_US = 1000
PERIODS_S = {"LOCAL_POSITION_NED": 0.02, "ATTITUDE": 0.02, "EXTENDED_SYS_STATE": 0.2}
WARM_UP_S, MOVING_S, MOVING_MPS = 14.0, 4.0, 0.1


def read(path, system):
    """Return the rows of one vehicle; a field that is missing is 0, "NaN" is a number."""
    rows = []
    for row in map(json.loads, path.read_text().splitlines()):
        fields = {k: math.nan if v == "NaN" else v for k, v in row["fields"].items()}
        link = row["sys"] if row["dir"] == "rx" else fields.get("target_system", system)
        if row["dir"] == "tx" and row["t"] > MISDIRECTED_S.get(path.stem, math.inf):
            link = 1
        if link != system:
            continue
        if row["dir"] == "tx":  # the stand-in has number 1
            is_its_own = fields.get("target_system", system) == system
            fields["target_system"] = 0 if is_its_own else OTHER_SYSTEM
        rows.append({**row, "fields": fields})
    return rows


class Events:
    """Events of a stream of messages: (kind, what) with times."""

    def __init__(self, asked):
        self.found, self._last, self._asked = [], {}, asked

    def take(self, at_s, name, fields):
        get = fields.get
        if name == "COMMAND_ACK":
            self._add(at_s, "ack", (get("command", 0), get("result", 0)))
        elif name == "STATUSTEXT":
            # A speed at the ground, not a number of a device.
            words = re.sub(r"\d+\.\d+", "#", get("text", ""))
            self._add(at_s, "text", (get("severity", 0), words))
        elif name == "HEARTBEAT":
            self._change(at_s, "mode", get("custom_mode", 0))
            self._change(at_s, "armed", bool(get("base_mode", 0) & 128))
            self._change(at_s, "status", get("system_status", 0))
        elif name == "EXTENDED_SYS_STATE":
            self._change(at_s, "landed", get("landed_state", 0))
        elif name == "PARAM_VALUE" and get("param_id") in self._asked:
            self._add(at_s, "parameter", (get("param_id"), float(get("param_value", 0.0))))

    def _change(self, at_s, kind, value):
        if self._last.get(kind) != value:
            self._add(at_s, kind, value)
        self._last[kind] = value

    def _add(self, at_s, kind, what):
        self.found.append((at_s, kind, what))

    def of(self, kind):
        return [(at_s, what) for at_s, one, what in self.found if one == kind]


class Check:
    """One vehicle of a log, and the stand-in that gets the same messages."""

    def __init__(self, path, system=1):
        self.name, self.rows = path.stem, read(path, system)
        self._system = system
        asked = {r["fields"].get("param_id") for r in self.rows if r["name"] == "PARAM_SET"}
        self.recorded, self.answered = Events(asked), Events(asked)
        self.path_recorded, self.path_flown = [], []  # (t, vn, ve, vd, z)
        for row in self.rows:
            if row["dir"] == "rx" and row["comp"] == 1:
                self.recorded.take(row["t"], row["name"], row["fields"])
                if row["name"] == "LOCAL_POSITION_NED":
                    values = [row["fields"].get(k, 0.0) for k in ("vx", "vy", "vz", "z")]
                    self.path_recorded.append((row["t"], *values))

    def _first(self, name, field, default=0):
        for row in self.rows:
            if row["dir"] == "rx" and row["name"] == name and row["comp"] == 1:
                return row["fields"].get(field, 0)
        return default

    def run(self):
        """Bring the stand-in into the log's first state, and send it what the log has sent."""
        boots = self.name == "boot_and_refusals"
        frame = LocalFrame(heading_rad=self._first("ATTITUDE", "yaw"))
        self._bodies = Bodies()
        self.vehicle = ArduPilot(self._bodies, frame=frame, boot_s=0.0 if boots else 60.0)
        self.vehicle.sticks[2] = SITL_THROTTLE_US
        if not boots:
            self._begin()
        waiting = [row for row in self.rows if row["dir"] == "tx"]
        others = list(OTHERS.get(self.name, ()))
        start_s, now_s = self.vehicle.now_s, 0.0
        theirs = ("rx", "EXTENDED_SYS_STATE")
        told = [row["t"] for row in self.rows if (row["dir"], row["name"]) == theirs]
        end_s = self.rows[-1]["t"] + 0.05
        while now_s < end_s:
            while waiting and waiting[0]["t"] <= now_s:
                row = waiting.pop(0)
                self.vehicle.receive(row["name"], row["fields"], (row["sys"], row["comp"]))
            if others and others[0][0] <= now_s:
                self.vehicle.set_mode(others.pop(0)[2])
            advance(self._bodies, [self.vehicle], 0.001)
            now_s = self.vehicle.now_s - start_s
            while told and told[0] <= now_s:  # as often as the log has it, which is thinned
                state = {"landed_state": self.vehicle.landed}
                self.answered.take(told.pop(0), "EXTENDED_SYS_STATE", state)
            for name, fields in self.vehicle.messages():
                if name != "EXTENDED_SYS_STATE":
                    self.answered.take(now_s, name, fields)
                if name == "LOCAL_POSITION_NED":
                    values = [fields[k] for k in ("vx", "vy", "vz", "z")]
                    self.path_flown.append((now_s, *values))
        self._bodies.close()

    def _command(self, number, seconds=0.05, **parameters):
        self.vehicle.receive("COMMAND_LONG", {"command": number, **parameters})
        advance(self._bodies, [self.vehicle], seconds)

    def _begin(self):
        """Fly to where the log begins, and let heartbeats come at the recorded times."""
        vehicle, mode = self.vehicle, self._first("HEARTBEAT", "custom_mode")
        if self._first("EXTENDED_SYS_STATE", "landed_state", 2) == 2:
            self._command(176, param2=GUIDED)
            self._command(400, param1=1)
            height_m = -self.path_recorded[0][4] if self.path_recorded else 1.46
            self._command(22, WARM_UP_S, param7=height_m + 0.043)
            if self.path_recorded and math.hypot(*self.path_recorded[0][1:3]) > MOVING_MPS:
                self._begin_moving()
        else:
            vehicle.mode = mode if mode != GUIDED or self.name == "takeoff_cancelled" else 0
            advance(self._bodies, [vehicle], 1.0)
        if self.name != "reboot":
            for number, name in MESSAGES.items():
                if name in PERIODS_S:
                    self._command(511, 0.01, param1=number, param2=PERIODS_S[name] * 1e6)
        vehicle.messages()
        names = ("HEARTBEAT", "EXTENDED_SYS_STATE")
        for name in names:
            times = [r["t"] for r in self.rows if r["dir"] == "rx" and r["name"] == name]
            first_s = times[0] % vehicle._periods.get(name, 1.0) if times else 0.0
            vehicle._due[name] = vehicle.boot_s + first_s
        vehicle._heard_s = vehicle.now_s

    def _begin_moving(self):
        """Follow the log's first set-point for a while: the log begins in motion."""
        first = next(r for r in self.rows if r["name"] == "SET_POSITION_TARGET_LOCAL_NED")
        for _ in range(round(MOVING_S / 0.05)):
            self.vehicle.receive(first["name"], first["fields"])
            advance(self._bodies, [self.vehicle], 0.05)

    def problems(self):
        """Return what differs, and a line of figures."""
        problems, count, late = [], 0, []
        for kind in ("ack", "text", "mode", "armed", "status", "landed", "parameter"):
            ours, theirs = self.answered.of(kind), self.recorded.of(kind)
            if theirs and ours and kind in ("mode", "armed", "status", "landed"):
                ours[0], theirs[0] = (0.0, ours[0][1]), (0.0, theirs[0][1])  # the first one heard
            matcher = difflib.SequenceMatcher(
                None, [str(w) for _, w in theirs], [str(w) for _, w in ours], autojunk=False
            )
            for tag, a0, a1, b0, b1 in matcher.get_opcodes():
                if tag != "equal":
                    missing = [f"{t:.2f} {w}" for t, w in theirs[a0:a1]]
                    extra = [f"{t:.2f} {w}" for t, w in ours[b0:b1]]
                    problems.append(f"{kind}: recorded {missing}, stand-in {extra}")
                    continue
                for (at_s, what), (our_s, _) in zip(theirs[a0:a1], ours[b0:b1]):
                    count += 1
                    late.append(our_s - at_s)
                    if abs(our_s - at_s) > LATE_S.get(kind, MOST_LATE_S):
                        problems.append(f"{kind} {what}: at {our_s:.2f} s, recorded {at_s:.2f} s")
        line = f"{count} of {len(self.recorded.found)} events"
        if late:
            worst = max(late, key=abs)
            median = statistics.median(map(abs, late))
            line += f", time off by {median:.3f} s (median), {worst:+.2f} s (most)"
        return problems, line

    def path_errors(self):
        """Return root mean square errors of the horizontal velocity, m/s, and the height, m."""
        if not self.path_recorded or not self.path_flown:
            return None
        a, b = np.array(self.path_recorded), np.array(self.path_flown)
        end_s = min(b[-1, 0], DEAD_RECKONING_S.get(self.name, math.inf))
        a = a[(a[:, 0] >= b[0, 0]) & (a[:, 0] <= end_s)]
        at = [np.interp(a[:, 0], b[:, 0], b[:, k]) - a[:, k] for k in (1, 2, 4)]
        speed = math.sqrt(float(np.mean(np.square(at[:2])) * 2.0))
        return speed, math.sqrt(float(np.mean(np.square(at[2]))))


def main():
    logs = sorted(Path(sys.argv[1]).glob("*.jsonl"))
    if not logs:
        print(f"no logs in {sys.argv[1]}")
        return 2
    failed = 0
    for path in logs:
        for system in (1, 2) if "two_vehicles" in path.name else (1,):
            check = Check(path, system)
            check.run()
            problems, line = check.problems()
            errors = check.path_errors()
            if errors:
                line += f"; rms {errors[0]:.3f} m/s, {errors[1]:.3f} m"
                if errors[0] > MOST_RMS_MPS or errors[1] > MOST_RMS_M:
                    problems.append("the path differs")
            failed += bool(problems)
            print(f"{path.stem}/{system}: {'ok' if not problems else 'DIFFERS'}: {line}")
            for problem in problems:
                print("   ", problem)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
