"""The BARN benchmark on worlds made here: what is read, flown, counted and said."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from test_limits import missing_numbers
from test_outputs import assert_output_is_checked_first
from test_terminal import NAME, quad
from test_user_files import assert_reads_files_alone

from quad_bench.barn import arrays
from quad_bench.barn.protocol import Outcome, Run, metric
from quad_bench.barn.results import Results
from quad_bench.barn.runs import fly_all, fly_world, judge
from quad_bench.barn.setup import BarnOptions, read_barn_setup
from quad_bench.barn.statistics import barn_statistics
from quad_bench.barn.worlds import BarnWorld, load_worlds
from quad_bench.cli.barn import barn
from quad_nav.errors import InputError
from quad_nav.mission.flight_log import Leg
from quad_nav.mission.goal import Goal
from quad_nav.mission.summary import MissionSummary, RobotSummary
from quad_nav.report.results import wilson_interval
from quad_nav.sim.contacts import Contact
from quad_nav.sim.obstacles import Cylinder

COLUMN_AHEAD = 14  # x = -2.325 m, 7.5 cm beside the straight way
SLOW = (("TrajectoryPlannerROS/max_vel_x", 0.3),)
BLIND = tuple(
    (f"{costmap}/base_scan/marking", False) for costmap in ("global_costmap", "local_costmap")
)
RUN = Run(0, 0, 0, Outcome.SUCCESS, 20.0, 0.25, 9.5, 0.3, 0)


def free() -> np.ndarray:
    return np.zeros((64, 30), np.uint8)


def one_ahead() -> np.ndarray:
    """A cylinder at y = 4.575 m."""
    cells = free()
    cells[30, COLUMN_AHEAD] = 1
    return cells


def write_worlds(path: Path, **worlds: np.ndarray) -> Path:
    """``w6=cells`` is world 6; its reference path goes from (-2.25, 5) to (-2.25, 9)."""
    numbers = [int(name[1:]) for name in worlds]
    np.savez(
        path,
        index=np.array(numbers, np.int32),
        occupied=np.stack(list(worlds.values())),
        **{f"path_{n}": np.array([[-2.25, 5.0], [-2.25, 9.0]], np.float32) for n in numbers},
    )
    return path


def setup_of(path: Path, **options):
    return read_barn_setup(BarnOptions(path, **options))


@pytest.mark.parametrize(
    "time_s, expected",
    [
        (8.0, 0.5),  # 2 OT = 10 s is the least: 5 / 10
        (20.0, 0.25),  # 5 / 20
        (60.0, 0.125),  # 8 OT = 40 s is the most: 5 / 40
    ],
)
def test_the_metric_of_a_10_m_path_whose_optimal_time_is_5_s(time_s, expected):
    assert metric(Outcome.SUCCESS, time_s, 10.0) == expected
    assert metric(Outcome.COLLISION, time_s, 10.0) == 0.0
    assert metric(Outcome.TIME_OUT, time_s, 10.0) == 0.0


def test_wilsons_interval_has_the_values_of_the_textbook():
    assert wilson_interval(8, 10) == pytest.approx((0.4902, 0.9433), abs=5e-5)
    assert wilson_interval(0, 10) == pytest.approx((0.0, 0.2775), abs=5e-5)
    assert wilson_interval(50, 50)[1] == 1.0


def test_statistics_are_means_over_worlds_of_the_successful_runs_times():
    runs = [
        RUN,
        replace(RUN, run=1, time_s=30.0, metric=0.2),
        replace(RUN, world=1, time_s=35.0, metric=0.15),
        replace(RUN, world=1, run=1, outcome=Outcome.COLLISION, time_s=3.0, metric=0.0),
        replace(
            RUN, world=2, outcome=Outcome.TIME_OUT, time_s=100.0, metric=0.0, gave_up="aborted"
        ),
    ]
    row = barn_statistics(runs)
    assert (row.worlds, row.runs, row.successes, row.collisions, row.time_outs, row.gave_up) == (
        3,
        5,
        3,
        1,
        1,
        1,
    )
    assert row.mean_time_s == pytest.approx(30.0)  # of 25 s in world 0 and 35 s in world 1
    assert row.metric == pytest.approx(0.12)
    assert barn_statistics(runs[3:]).mean_time_s is None


def test_a_world_has_cylinders_where_its_cells_say_and_the_path_counts_from_start_to_goal(tmp_path):
    (world,) = load_worlds(write_worlds(tmp_path / "w.npz", w6=one_ahead()))
    assert world.number == 6 and world.path_length_m == pytest.approx(10.0)
    scene = world.scene()
    assert scene.obstacles == (
        Cylinder("cylinder [30, 14]", pytest.approx(-2.325), pytest.approx(4.575), 0.075, 1.0),
    )
    assert scene.starts[0].x_m == -2.25 and scene.starts[0].yaw_rad == pytest.approx(math.pi / 2)
    # The walls are 5 m off the field and 5 m off start and goal.
    assert (scene.origin_x_m, scene.end_x_m) == (-4.5 - 5.0, 0.0 + 5.0)
    assert (scene.origin_y_m, scene.end_y_m) == (0.0 - 5.0, 13.0 + 5.0)


def test_only_some_worlds_are_read_and_absent_ones_are_named(tmp_path):
    path = write_worlds(tmp_path / "w.npz", w6=free(), w7=one_ahead(), w9=free())
    assert [world.number for world in load_worlds(path, (9, 7))] == [7, 9]
    assert [world.number for world in setup_of(path, sample=True).worlds] == [6]
    with pytest.raises(InputError, match="no world 8; expected numbers of its 3 worlds"):
        load_worlds(path, (6, 8))


@pytest.mark.parametrize(
    "arrays, problem",
    [
        ({}, "no array index"),
        (
            {"index": np.array([0.5]), "occupied": np.zeros((1, 64, 30))},
            "expected a row of integers",
        ),
        ({"index": np.array([3, 3]), "occupied": np.zeros((2, 64, 30))}, "duplicate numbers"),
        (
            {"index": np.array([3]), "occupied": np.zeros((1, 30, 64))},
            r"numbers \(1, 64, 30\)",
        ),
        (
            {"index": np.array([3]), "occupied": np.zeros((1, 64, 30))},
            r"path_3: .* expected numbers \(any, 2\)",
        ),
    ],
)
def test_files_that_are_no_worlds_are_refused(tmp_path, arrays, problem):
    np.savez(tmp_path / "w.npz", **arrays)
    with pytest.raises(InputError, match=problem):
        load_worlds(tmp_path / "w.npz")
    (tmp_path / "w.npz").write_bytes(b"PK\x03\x04 no archive")
    with pytest.raises(InputError, match="expected an .npz"):
        load_worlds(tmp_path / "w.npz")


def test_everything_that_cannot_be_flown_is_listed_at_once(tmp_path):
    cells = free()
    cells[20, 14] = 1  # its axis is 0.106 m from the start
    with pytest.raises(InputError) as error:
        setup_of(
            write_worlds(tmp_path / "w.npz", w1=cells),
            config="tutorial",
            parameters=(
                ("local_costmap/base_scan/data_type", "PointCloud2"),
                ("global_costmap/height", 12),
            ),
        )
    start, sensor, goal = error.value.problems
    assert "world 1: a cylinder is 0.03 m from the start" in start
    assert "data_type PointCloud2; expected LaserScan" in sensor
    assert "(-2.25, 13) is off the global costmap, x -4.5 to 0.5 m, y 0 to 12 m" in goal


def test_the_global_costmap_covers_the_field(tmp_path):
    path = write_worlds(tmp_path / "w.npz", w1=free())
    costmap = setup_of(path, config="tutorial").contestant.configuration.global_costmap
    assert (costmap.origin_x_m, costmap.width_m) == (-4.5, 5.0)  # whole metres
    assert (costmap.origin_y_m, costmap.height_m) == (2.0, 12.0)
    own = setup_of(path).contestant.configuration.global_costmap  # config/barn covers it already
    assert (own.origin_x_m, own.origin_y_m, own.width_m) == (-8.25, 2.0, 12.0)


def test_static_maps_are_refused_because_the_worlds_are_unknown(tmp_path):
    path = write_worlds(tmp_path / "w.npz", w1=free())
    with pytest.raises(InputError, match="the worlds have no map"):
        setup_of(path, parameters=(("global_costmap/static_map", True),))


def test_the_body_keeps_to_the_parameters_velocities_and_frames_may_have_any_name(tmp_path):
    path = write_worlds(tmp_path / "w.npz", w1=free())
    setup = setup_of(
        path,
        parameters=(
            ("TrajectoryPlannerROS/max_vel_x", 0.5),
            ("TrajectoryPlannerROS/max_vel_theta", 1.57),
            ("global_costmap/global_frame", "odom"),
            ("global_costmap/robot_base_frame", "base_link"),
            ("local_costmap/base_scan/sensor_frame", "front_laser"),
        ),
    )
    flight = setup.contestant.simulation.flight
    assert (flight.max_speed_mps, flight.max_yaw_rate_radps) == (0.5, 1.57)
    backwards = setup_of(path, parameters=(("TrajectoryPlannerROS/escape_vel", -1.3),))
    assert backwards.contestant.simulation.flight.max_speed_mps == 1.3
    told = Results(setup.contestant, (), 1, 0.0).differences()
    assert "radius 0.20 m" in told and "0.50 m/s and 1.57 rad/s" in told
    assert max(map(len, told.splitlines())) <= 100


def test_a_free_world_is_flown_and_scored(tmp_path):
    setup = setup_of(write_worlds(tmp_path / "w.npz", w1=free()), parameters=SLOW)
    run = fly_world(setup.contestant, setup.worlds[0], 0)
    assert run.outcome is Outcome.SUCCESS
    # 9 m at 0.3 m/s take 30 s, and a little more to get going.
    assert 30.0 < run.time_s < 32.0 and run.path_length_m == pytest.approx(9.0, abs=0.1)
    assert run.metric == pytest.approx(5.0 / run.time_s)
    # At y = 12 it is there, the wall at y = 18 is the nearest thing, and the hull has 0.2 m.
    assert run.min_clearance_m == pytest.approx(5.8, abs=0.03)


def test_two_workers_give_what_one_gives_a_contact_is_a_collision_and_the_seed_counts(tmp_path):
    path = write_worlds(tmp_path / "w.npz", w1=one_ahead(), w2=free())
    setup = setup_of(path, parameters=(*BLIND, *SLOW), runs=2, only=(1,), seed=7)
    alone, together = (
        sorted(fly_all(setup, workers), key=lambda run: run.run) for workers in (1, 2)
    )
    assert alone == together and [run.seed for run in alone] == [7, 8]
    for run in alone:
        assert (run.outcome, run.metric, run.touched) == (
            Outcome.COLLISION,
            0.0,
            "cylinder [30, 14]",
        )
        # It touches when its hull gets there, 0.275 m before the cylinder's axis.
        assert 1.2 / 0.3 < run.time_s < 1.6 / 0.3 and run.min_clearance_m < 0.01


def leg(reached: bool, time_s: float, reason: str = "") -> Leg:
    return Leg(0, 1, Goal(-2.25, 13.0), reached, reason, 1, time_s, 9.0, 10.0)


@pytest.mark.parametrize(
    "flown, contacts, expected, time_s, gave_up",
    [
        (leg(True, 25.0), (), Outcome.SUCCESS, 25.0, ""),
        (
            leg(True, 25.0),
            (Contact(25.0, "quad0", "cylinder", 1.0, 2.0),),
            Outcome.COLLISION,
            25.0,
            "",
        ),
        (leg(False, 12.0, "aborted: no plan"), (), Outcome.TIME_OUT, 100.0, "aborted: no plan"),
        (leg(False, 100.0, "not reached in 100 s"), (), Outcome.TIME_OUT, 100.0, ""),
    ],
)
def test_what_a_flight_counts_for(flown, contacts, expected, time_s, gave_up):
    robot = RobotSummary("quad0", (flown,), 9.0, 0.1)
    run = judge(MissionSummary((robot,), contacts, seed=3), BarnWorld(5, free(), 10.0), 0)
    assert (run.outcome, run.time_s, run.gave_up, run.seed) == (expected, time_s, gave_up, 3)


def test_the_command_prints_statistics_and_differences_and_writes_files(tmp_path):
    path = write_worlds(tmp_path / "w.npz", w6=one_ahead())
    sets = [word for name, value in BLIND for word in ("--set", f"{name}={value}")]
    files = ["--csv", str(tmp_path / "runs.csv"), "--json", str(tmp_path / "figures.json")]
    given = ["--worlds", str(path), "--workers", "1", "--per-world", *sets, *files]
    done = CliRunner().invoke(barn, given)
    assert done.exit_code == 0, done.output
    rows = [line.split() for line in done.output.splitlines()]
    assert ["official", "sample", "1", "1", "0.0", "0.0-79.3", "100.0", "0.0", "-", "0.000"] in rows
    assert ["world", "6", "1", "1", "0.0", "0.0-79.3", "100.0", "0.0", "-", "0.000"] in rows
    assert "Differences from the challenge:" in done.output and "seed 0" in done.output
    assert "touches cylinder [30, 14]" in done.output
    told = json.loads((tmp_path / "figures.json").read_text())
    assert told["figures"]["official sample"]["collisions"] == 1
    assert told["versions"]["numpy"] == np.__version__
    with (tmp_path / "runs.csv").open() as file:
        (line,) = csv.DictReader(file)
    assert line["outcome"] == "collision" and line == {
        key: "" if value is None else str(value) for key, value in told["runs"][0].items()
    }


def test_bad_input_ends_with_2_and_ctrl_c_with_130_and_what_was_flown(tmp_path, monkeypatch):
    path = write_worlds(tmp_path / "w.npz", w6=free(), w12=free())
    bad = CliRunner().invoke(barn, ["--worlds", str(path), "--only", "1,x"])
    assert bad.exit_code == 2 and "expected numbers of worlds" in bad.output

    def two_flights(setup, workers):
        yield RUN
        raise KeyboardInterrupt

    monkeypatch.setattr("quad_bench.cli.barn_benchmarks.fly_all", two_flights)
    cut = CliRunner().invoke(barn, ["--worlds", str(path)])
    assert cut.exit_code == 130
    assert "Interrupted after 1 of 2 flights." in cut.output
    assert "official sample" in cut.output


def test_without_a_flight_there_are_no_statistics(tmp_path):
    setup = setup_of(write_worlds(tmp_path / "w.npz", w6=free()))
    results = Results(setup.contestant, (), 1, 0.0)
    assert results.rows == []
    assert results.to_csv().startswith("world,run,seed,outcome,time_s,")
    with pytest.raises(ValueError, match="no runs"):
        barn_statistics([])


def test_what_is_read_and_written_is_checked_as_everywhere(tmp_path):
    assert missing_numbers("BARN worlds (`.npz`)", [arrays.MAX_BYTES]) == []
    assert_reads_files_alone(load_worlds, tmp_path / "w.npz")
    quad("barn", "--worlds", tmp_path / NAME)
    quad("barn", "--worlds", "x.npz", "--only", NAME)
    (tmp_path / "empty").mkdir()
    assert_output_is_checked_first(tmp_path / "empty", "barn --worlds w.npz", "--csv", "x.csv")
