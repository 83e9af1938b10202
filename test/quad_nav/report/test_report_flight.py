"""The report of a flight that was flown says what the mission's summary says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from quad_nav.cli import main
from quad_nav.offline.run import fly
from quad_nav.recording.trace import TraceObserver
from quad_nav.report.flight_metrics import flight_metrics
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.simulation_params import SimulationParams

ROOT = Path(__file__).resolve().parents[3]
FEW_BEAMS = LidarParams(step_size_rad=2 * np.pi / 128)


def test_metrics_are_those_of_the_summary():
    observer = TraceObserver()
    summary = fly(
        read_setup(
            FlightOptions(
                scene=ROOT / "scenes" / "arena.yaml",
                goals=ROOT / "goals",
                config="tutorial",
                time_limit_s=6.0,
                simulation=SimulationParams(FEW_BEAMS, jitter_m=0.3),
            )
        ),
        [observer],
    )
    found = flight_metrics(observer.trace(summary.contacts, summary.reason))
    assert found.mission_s == pytest.approx(summary.sim_time_s, abs=1 / 40 + 1e-9)
    assert found.min_separation_m == pytest.approx(summary.min_separation_m, abs=1e-3)
    assert found.faults == ("ended early (time limit of 6 s)", "6 of 6 goals not reached")
    for ours, theirs in zip(found.robots, summary.robots):
        assert ours.path_length_m == pytest.approx(theirs.path_length_m, abs=1e-6)
        assert ours.straight_length_m == pytest.approx(theirs.straight_length_m, abs=1e-6)
        assert ours.min_clearance_m == pytest.approx(theirs.min_clearance_m, abs=1e-3)
        assert ours.spin_s == pytest.approx(theirs.spin_s, abs=1e-6)
        assert ours.path_length_m > 0.5


def test_quad_fly_refuses_an_animation_before_it_flies(tmp_path):
    result = CliRunner().invoke(main, ["fly", "--animate", str(tmp_path / "flight.avi")])
    assert result.exit_code == 2
    assert "expected a name that ends in .gif or .mp4" in result.output
