#!/usr/bin/env python3
"""Compare the airframe ``arducopter`` with recorded flights of ArduCopter.

    PYTHONPATH=src:test python3 test/vehicles/airframe_check.py FOLDER

FOLDER has ``random_commands.jsonl`` and ``velocity_steps.jsonl``: a JSON object a line with t, dir,
name and fields. The simulated quadcopter gets the recorded set-points at their times, and its
velocities are compared with the recorded estimates. A recorded heading differs from the simulated
one after a while, so each set-point is turned by the recorded heading at its arrival.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.sim.flight import Airframe, AutopilotResponse
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEPS_PER_S, SimulationParams

LOGS = {"random_commands": (0.031, 0.1), "velocity_steps": (0.031, 0.069)}
"""Largest root mean square errors, m/s and rad/s.

Those of the fitted model, except for the yaw rate of ``random_commands``: there the model has 0.069
rad/s on the flight's full telemetry, and 0.092 rad/s on the log, which is thinned to 8 Hz.
"""


def read_log(path):
    """Return set-points (t, vx, vy, yaw rate), velocities (t, vn, ve), yaw rates (t, yaw, rate)."""
    setpoints, velocities, yaws = [], [], []
    for line in path.read_text().splitlines():
        one = json.loads(line)
        get, t = lambda name, fields=one["fields"]: fields.get(name, 0.0), one["t"]
        if one["name"] == "SET_POSITION_TARGET_LOCAL_NED" and one["dir"] == "tx":
            setpoints.append((t, get("vx"), get("vy"), get("yaw_rate")))
        elif one["name"] == "LOCAL_POSITION_NED":
            velocities.append((t, get("vx"), get("vy")))
        elif one["name"] == "ATTITUDE":
            yaws.append((t, get("yaw"), get("yawspeed")))
    return np.array(setpoints), np.array(velocities), np.array(yaws)


def fly(setpoints, yaws):
    """Return the simulated quadcopter's (t, vn, ve, yaw rate), float64[n, 4], at every step."""
    scene = Scene("check", 400.0, 400.0, 1.0, Walls(), (), (Pose2D(200.0, 200.0, 0.0),))
    airframe = Airframe(response=AutopilotResponse())  # the log has what the autopilot got
    params = SimulationParams(airframe=airframe, command_timeout_s=3.0)
    simulation, rows, k = Simulation(scene, 1, params), [], 0
    headings = np.interp(setpoints[:, 0], yaws[:, 0], np.unwrap(yaws[:, 1]))
    while simulation.now_s <= setpoints[-1, 0]:
        while k < len(setpoints) and setpoints[k, 0] <= simulation.now_s:
            _, vx, vy, rate = setpoints[k].tolist()
            # NED is a mirror image of the map: east is -y.
            north = math.cos(headings[k]) * vx - math.sin(headings[k]) * vy
            east = math.sin(headings[k]) * vx + math.cos(headings[k]) * vy
            yaw = simulation.state(0).map_from_base.to_2d().yaw_rad
            forward = math.cos(yaw) * north - math.sin(yaw) * east
            left = -math.sin(yaw) * north - math.cos(yaw) * east
            simulation.set_command(0, Twist2D(forward, left, -rate))
            k += 1
        simulation.advance(1)
        velocity = simulation.state(0).map_velocities
        rows.append((simulation.step_count / STEPS_PER_S, velocity[0], -velocity[1], -velocity[5]))
    simulation.close()
    return np.array(rows)


def errors(folder, name):
    """Return the root mean square errors of velocity, m/s, and yaw rate, rad/s."""
    setpoints, velocities, yaws = read_log(Path(folder) / f"{name}.jsonl")
    flown = fly(setpoints, yaws)
    t, yaw_t = velocities[:, 0], yaws[:, 0]
    inside, yaw_inside = t < flown[-1, 0], yaw_t < flown[-1, 0]
    difference = [
        np.interp(t[inside], flown[:, 0], flown[:, k]) - velocities[inside, k] for k in (1, 2)
    ]
    yaw = np.interp(yaw_t[yaw_inside], flown[:, 0], flown[:, 3]) - yaws[yaw_inside, 2]
    return float(np.sqrt(np.mean(np.square(difference)))), float(np.sqrt(np.mean(yaw**2)))


def main():
    status = 0
    for name, (largest_mps, largest_radps) in LOGS.items():
        speed, rate = errors(sys.argv[1], name)
        is_good = speed <= largest_mps and rate <= largest_radps
        status |= not is_good
        print(
            f"{name}: rms {speed:.3f} m/s (at most {largest_mps}), {rate:.3f} rad/s "
            f"(at most {largest_radps}): {'good' if is_good else 'BAD'}"
        )
    return status


if __name__ == "__main__":
    sys.exit(main())
