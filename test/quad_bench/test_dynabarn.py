"""DynaBARN on worlds made here: what is read, flown, counted and printed."""

from __future__ import annotations

import importlib.util
import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from quad_bench.barn.dynamic import (
    PHASE_S,
    DynamicRun,
    ProtocolClock,
    flight_setup,
    fly_world,
    phase_of,
    read_dynamic_setup,
)
from quad_bench.barn.dynamic_results import DynamicResults
from quad_bench.barn.dynamic_worlds import load_dynamic_worlds
from quad_bench.barn.protocol import Outcome
from quad_bench.barn.setup import BarnOptions
from quad_bench.cli.dynabarn import dynabarn
from quad_nav.errors import InputError
from quad_nav.sim.movers import Movers

WALL = [[-10.0, 0.0, 0.5, 20.0, 0.0]]
needs_moving = pytest.mark.skipif(
    importlib.util.find_spec("quad_moving") is None, reason="flies with config/moving"
)
ASIDE = ([0.0, 10.0], [[0.0, 8.0], [2.0, 8.0]])  # far from the straight way


def write_worlds(path: Path, **motions) -> Path:
    """Write worlds by name, as ``w3``: each is (difficulty, (times, points), ...)."""
    arrays = {
        "index": np.array([int(name[1:]) for name in motions], np.int32),
        "difficulty": np.array([world[0] for world in motions.values()], np.int8),
    }
    for name, (_, *obstacles) in motions.items():
        most = max(len(times) for times, _ in obstacles)
        times, points = (np.full((len(obstacles), most, *end), np.nan) for end in ((), (2,)))
        for row, (stamps, places) in enumerate(obstacles):
            times[row, : len(stamps)], points[row, : len(stamps)] = stamps, places
        number = name[1:]
        arrays[f"radius_{number}"] = np.full(len(obstacles), 0.5)
        arrays[f"times_{number}"], arrays[f"xy_{number}"] = times, points
        arrays[f"walls_{number}"] = np.array(WALL)
    np.savez(path, **arrays)
    return path


@pytest.fixture
def worlds(tmp_path: Path) -> Path:
    standing_ahead = ([0.0, 5.0], [[8.0, 0.0], [8.0, 0.0]])
    return write_worlds(
        tmp_path / "worlds.npz",
        w3=(0, ASIDE),
        w45=(2, ASIDE, ([0.0, 4.0, 6.0], [[5.0, 5.0], [5.0, -5.0], [0.0, -5.0]])),
        w50=(2, standing_ahead),
    )


def options(worlds: Path, **given) -> BarnOptions:
    return BarnOptions(**{"worlds": worlds, "strict": False, **given})


def test_worlds_are_read_without_their_padding(worlds):
    easy, hard, _ = load_dynamic_worlds(worlds)
    assert (easy.number, easy.difficulty, hard.number, hard.difficulty) == (3, 0, 45, 2)
    assert hard.times_s == ((0.0, 10.0), (0.0, 4.0, 6.0))
    assert hard.points_m[0] == ((0.0, 8.0), (2.0, 8.0))
    assert [world.number for world in load_dynamic_worlds(worlds, [45])] == [45]
    scene = hard.scene("linear", 12.0)
    assert [solid.name for solid in scene.obstacles] == ["wall 0"]
    # 12 s and 1 s of the loop of 6 s: a quarter of the way to the second keyframe.
    assert Movers(scene).poses(1.0)[1].tolist() == pytest.approx([5.0, 2.5, 0.0])


@pytest.mark.parametrize(
    "name, value, problem",
    [
        ("difficulty", np.array([0, 3, 2]), "difficulty: expected 0, 1 or 2 for each of 3 worlds"),
        ("radius_3", np.zeros((1, 1)), "radius_3: float64 (1, 1), expected numbers (any)"),
        ("times_3", np.array([[0.0, 0.0]]), "world 3: expected 1 to 200 obstacles with radii"),
        ("xy_3", np.full((1, 2, 2), np.inf), "world 3: expected 1 to 200 obstacles with radii"),
        ("walls_3", np.zeros((1, 4)), "walls_3: float64 (1, 4), expected numbers (any, 5)"),
    ],
)
def test_faults_of_a_file(worlds, tmp_path, name, value, problem):
    with np.load(worlds) as file:
        arrays = dict(file)
    np.savez(tmp_path / "bad.npz", **{**arrays, name: value})
    with pytest.raises(InputError) as error:
        load_dynamic_worlds(tmp_path / "bad.npz")
    assert any(problem in line for line in error.value.problems)


def test_the_phase_follows_from_seed_and_world_alone(worlds):
    drawn = [phase_of(seed, world) for seed in range(20) for world in (3, 45)]
    assert len(set(drawn)) == 40 and 0.0 <= min(drawn) and max(drawn) < PHASE_S
    setup = read_dynamic_setup(options(worlds, seed=7), "linear", 0.5)
    for run in (0, 1):
        flight = flight_setup(setup.contestant, setup.worlds[0], "linear", run)
        assert flight.scene.motion_phase_s == phase_of(7 + run, 3)
        assert flight.seed == 7 + run


def test_a_flight_starts_later_where_an_obstacle_is_at_the_start(tmp_path):
    """It is at the start for the first 90 s of 100 s; a second later until it has gone."""
    there = ([0.0, 90.0, 90.1, 100.0], [[11.0, 0.0], [11.0, 0.0], [0.0, 8.0], [0.0, 8.0]])
    path = write_worlds(tmp_path / "w.npz", w0=(0, there))
    setup = read_dynamic_setup(options(path), "linear", 0.5)
    flight = flight_setup(setup.contestant, setup.worlds[0], "linear", 0)
    drawn = phase_of(0, 0)
    assert drawn < 90.0  # of this seed
    assert flight.scene.motion_phase_s == pytest.approx(drawn + math.ceil(90.0 - drawn), abs=1.01)


@pytest.mark.parametrize("given, limit", [(0.3, 0.3), (0.0, 1.2)])
def test_the_speed_limit(worlds, given, limit):
    setup = read_dynamic_setup(options(worlds), "spline", given)
    assert setup.contestant.configuration.local_planner.max_vel_x_mps == limit
    assert setup.contestant.simulation.flight.max_speed_mps == limit


@needs_moving
@pytest.mark.parametrize("given, speed, body", [(None, 0.0, 0.5), (0.4, 0.4, 0.5), (0.9, 0.9, 0.9)])
def test_evasions_keep_to_the_speed_limit_unless_another_one_is_set(worlds, given, speed, body):
    """`config/moving` evades at up to 2 m/s."""
    parameters = () if given is None else (("evasion/max_speed", given),)
    asked = options(worlds, config="moving", parameters=parameters)
    contestant = read_dynamic_setup(asked, "spline", 0.5).contestant
    assert contestant.configuration.tree["evasion"]["max_speed"] == speed
    assert contestant.configuration.local_planner.max_vel_x_mps == 0.5
    assert contestant.simulation.flight.max_speed_mps == body


def test_a_free_way_is_a_success(worlds):
    """19 m to fly at 0.5 m/s: 38 s, and a little for starting."""
    setup = read_dynamic_setup(options(worlds, only=(3,)), "linear", 0.5)
    run = fly_world(setup.contestant, setup.worlds[0], "linear", 0)
    assert run.outcome is Outcome.SUCCESS
    assert run.time_s == pytest.approx(39.5, abs=2.0)
    assert (run.world, run.difficulty, run.touched) == (3, 0, "")
    assert run.min_clearance_m > 0.5


def test_an_obstacle_that_comes_is_a_collision(tmp_path):
    """It crosses the start's side at 5 m/s all the time and minds nobody."""
    to_and_fro = ([0.0, 2.0, 4.0], [[16.0, 0.0], [6.0, 0.0], [16.0, 0.0]])
    path = write_worlds(tmp_path / "w.npz", w1=(1, to_and_fro))
    setup = read_dynamic_setup(options(path), "linear", 0.5)
    run = fly_world(setup.contestant, setup.worlds[0], "linear", 0)
    assert run.outcome is Outcome.COLLISION
    assert run.touched == "obstacle 0" and run.time_s < 4.0
    assert run.touched_at_m == pytest.approx((11.0, 0.0), abs=0.5)


def clock_of(*places):
    """Return a clock that has seen a robot at (time in s, x in m), on y = 0."""
    clock = ProtocolClock()
    for now_s, x_m in places:
        states = SimpleNamespace(poses=np.array([[x_m, 0.0, 0.0]]))
        clock.on_move(SimpleNamespace(now_s=now_s, states=states))
    return clock


def test_the_clock_starts_when_the_robot_leaves_its_start():
    waiting = clock_of((0.5, 11.0), (80.0, 10.95))
    assert (waiting.waited_s, waiting.time_s, waiting.stop_reason) == (80.0, 0.0, "")
    flying = clock_of((0.5, 11.0), (80.0, 10.89), (179.5, 2.0))
    assert (flying.waited_s, flying.time_s, flying.stop_reason) == (80.0, 99.5, "")
    late = clock_of((80.0, 10.89), (180.0, 2.0))
    assert late.stop_reason == "time limit of 100 s"


RUN = DynamicRun(3, 0, 0, Outcome.SUCCESS, 40.0, 0.0, 19.0, 0.3, 0, difficulty=0, phase_s=12.5)
HIT = replace(
    RUN, world=45, outcome=Outcome.COLLISION, time_s=5.0, touched="obstacle 1", difficulty=2
)


def test_results_by_difficulty(worlds):
    setup = read_dynamic_setup(options(worlds), "spline", 0.5)
    results = DynamicResults(setup.contestant, (RUN, HIT, replace(HIT, run=1)), 4, 9.0, "spline")
    assert [(name, row.successes, row.runs) for name, row in results.rows] == [
        ("easy", 1, 1),
        ("hard", 0, 2),
        ("all", 1, 3),
    ]
    shown = results.text(per_world=True)
    assert "Interrupted after 3 of 4 flights." in shown and "world 45" in shown
    figures = results.to_json()
    assert figures["figures"]["all"]["success_rate"] == pytest.approx(1 / 3, abs=1e-4)
    assert figures["runs"][1]["touched"] == "obstacle 1"
    assert figures["runs"][0]["phase_s"] == 12.5
    assert len(results.to_csv().splitlines()) == 4


@needs_moving
def test_the_command(worlds, tmp_path):
    out = tmp_path / "out.json"
    given = ["--worlds", str(worlds), "--only", "3", "--workers", "1", "--json", str(out), "-q"]
    result = CliRunner().invoke(dynabarn, [*given, "--interpolation", "linear"])
    assert result.exit_code == 0, result.output
    figures = json.loads(out.read_text())
    assert figures["config"] == "moving"
    assert figures["figures"]["easy"]["successes"] == 1
    assert figures["interpolation"] == "linear" and figures["max_speed_mps"] == 0.5
    missing = CliRunner().invoke(dynabarn, ["--worlds", str(worlds), "--only", "x"])
    assert missing.exit_code == 2
