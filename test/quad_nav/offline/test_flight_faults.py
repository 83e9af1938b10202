"""Sensors that fail in flight: the robot hovers while it has no valid input, then resumes."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from flight_faults import (
    FrozenScans,
    LateScans,
    NoPose,
    NoScans,
    OldScans,
    ScansOf,
    SensorFault,
    ShiftedPose,
)

from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.simulation_params import SimulationParams

ROOT = Path(__file__).resolve().parents[3]
FEW_BEAMS = LidarParams(step_size_rad=2 * np.pi / 128)
BEGIN_S, END_S = 2.0, 4.0
CONTROL_PERIOD_S, TIMEOUT_S = 0.1, 0.5


def fly_with(fault, folder, config="default", time_limit_s=END_S + 0.5):
    """Fly one robot over three metres: 10 s, and as long as it hovers."""
    (folder / "quad0_goals.json").write_text(json.dumps({"goals": [[1.0, 4.5]]}))
    options = FlightOptions(
        ROOT / "scenes" / "arena.yaml",
        folder,
        config,
        time_limit_s=time_limit_s,
        scans_per_s=10.0,
        simulation=SimulationParams(FEW_BEAMS),
    )
    return fly(read_setup(options), [fault])


def test_without_a_fault_the_robot_does_not_hover(tmp_path):
    harmless = SensorFault(BEGIN_S, END_S)
    fly_with(harmless, tmp_path)
    assert harmless.hover_after_s > END_S - BEGIN_S - 2 * CONTROL_PERIOD_S


@pytest.mark.parametrize(
    "fault",
    [
        NoScans(BEGIN_S, END_S),
        FrozenScans(BEGIN_S, END_S),
        OldScans(BEGIN_S, END_S),
        LateScans(BEGIN_S, END_S),
        ScansOf(BEGIN_S, END_S, 0.0),
        ScansOf(BEGIN_S, END_S, math.nan, first_half=True),
        ScansOf(BEGIN_S, END_S, math.inf, first_half=True),
        NoPose(BEGIN_S, END_S),
    ],
    ids=["none", "frozen", "old", "late", "zeros", "half NaN", "half inf", "no pose"],
)
def test_the_robot_hovers_without_valid_input_and_then_resumes(fault, tmp_path):
    summary = fly_with(fault, tmp_path)
    assert fault.hover_after_s <= CONTROL_PERIOD_S + TIMEOUT_S
    assert fault.resume_after_s is not None and fault.resume_after_s <= 2 * CONTROL_PERIOD_S + 0.1
    assert summary.contacts == () and summary.robots[0].recoveries == 0


def test_a_mission_with_a_fault_in_it_succeeds_at_the_first_attempt(tmp_path):
    summary = fly_with(FrozenScans(BEGIN_S, END_S), tmp_path, time_limit_s=40.0)
    assert summary.success and summary.robots[0].legs[0].attempts == 1, summary


def test_a_shifted_pose_does_not_end_the_mission(tmp_path):
    summary = fly_with(ShiftedPose(BEGIN_S, END_S), tmp_path, time_limit_s=40.0)
    assert summary.success, summary


def test_without_scan_validation_the_robot_follows_a_frozen_scan(tmp_path):
    """A frozen scan clears obstacles from the costmap that are there."""
    config = tmp_path / "config"
    shutil.copytree(ROOT / "config" / "default", config)
    with (config / "move_base_params.yaml").open("a") as file:
        file.write("reject_implausible_scans: false\n")
    fault = FrozenScans(BEGIN_S, END_S)
    fly_with(fault, tmp_path, str(config))
    assert fault.hover_after_s > CONTROL_PERIOD_S + TIMEOUT_S
