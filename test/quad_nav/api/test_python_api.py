"""Flights from Python: the names of ``quad_nav``, ``fly`` and flights that the caller advances."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

import quad_nav
from quad_nav import api
from quad_nav.recording.trace import TraceObserver
from quad_nav.sim.obstacles import SHAPES

ROOT = Path(__file__).resolve().parents[3]
# Near the start poses (1.5, 1.5) and (10.0, 2.0) of the arena.
GOALS = [[[2.1, 1.9], [2.6, 2.3]], [[9.4, 2.3]]]


@pytest.fixture(scope="module")
def setup():
    return quad_nav.prepare(
        goals=GOALS, seed=3, simulation=quad_nav.lidar_simulation(beams=128, jitter_m=0.1)
    )


@pytest.fixture(scope="module")
def trace():
    return TraceObserver()


@pytest.fixture(scope="module")
def flown(setup, trace):
    return quad_nav.fly(setup, [trace])


def test_importing_the_package_loads_no_engine():
    code = "import sys, quad_nav; assert not {'numpy', 'numba', 'pybullet'} & set(sys.modules)"
    environment = {"PYTHONPATH": str(ROOT / "src")}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)


def test_every_name_is_there_and_typed():
    stub = ast.parse((ROOT / "src" / "quad_nav" / "__init__.pyi").read_text())
    typed = {alias.asname for node in stub.body if hasattr(node, "names") for alias in node.names}
    assert typed == set(api.__all__) == set(quad_nav._API)
    assert all(getattr(quad_nav, name) is getattr(api, name) for name in typed)
    assert typed < set(dir(quad_nav))
    assert typed > {shape.__name__ for shape in SHAPES.values()}


def test_unknown_names_are_refused():
    with pytest.raises(AttributeError, match="'quad_nav' has no attribute 'flie'"):
        quad_nav.flie  # noqa: B018


def test_goals_keep_their_settings():
    goals = (
        quad_nav.Goal(2.1, 1.9, 0.5, wait_s=3.0, tolerance_m=0.2, yaw_tolerance_rad=0.3),
        quad_nav.Goal(2.6, 2.3),
    )
    settings = quad_nav.SequenceSettings(retries=0, yaw_tolerance_rad=0.15)
    whole = quad_nav.prepare(goals=[quad_nav.GoalSequence(goals, settings), list(goals)])
    assert [robot.sequence.goals for robot in whole.robots] == [goals, goals]
    assert whole.robots[0].sequence.settings == settings


def test_result_has_summary_and_trajectories(flown, setup):
    assert flown.success
    assert [len(robot.legs) for robot in flown.summary.robots] == [2, 1]
    rows = flown.trajectories[1]
    assert rows.shape == (len(rows), len(quad_nav.TRAJECTORY_COLUMNS))
    assert np.array_equal(flown.column(0, "time_s"), np.arange(len(rows)) / 40)
    assert flown.column(1, "x_m")[-1] == pytest.approx(9.4, abs=0.4)
    assert flown.to_json()["seed"] == 3


def test_trajectories_are_those_of_a_trace(flown, trace):
    """Yaw and body velocities are computed from the state by two pieces of code."""
    for rows, robot in zip(flown.trajectories, trace.trace().robots):
        assert np.array_equal(rows[:, 1:4], robot.positions_m)
        assert np.array_equal(rows[:, 4:8], robot.quaternions)
        assert np.allclose(rows[:, [9, 10, 12]], robot.velocities, rtol=0, atol=1e-12)
        yaws = 2 * np.arctan2(robot.quaternions[:, 2], robot.quaternions[:, 3])  # level enough
        assert np.allclose(np.cos(rows[:, 8] - yaws), 1.0, atol=1e-3)


def test_trajectories_make_a_data_frame(flown):
    frame = flown.to_frame()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame.columns) == ["robot", *quad_nav.TRAJECTORY_COLUMNS]
    assert frame.groupby("robot").size().tolist() == [len(rows) for rows in flown.trajectories]


def test_navigators_commands_given_back_fly_the_same_flight(flown, setup):
    """Robot 0 flies on what the caller hands back, robot 1 on its navigator."""
    with quad_nav.Flight(setup) as flight:
        while not flight.is_done:
            flight.step({0: flight.navigator_command(0)})
        result = flight.result()
    for one, other in zip(flown.trajectories, result.trajectories):
        assert np.array_equal(one, other)
    assert result.summary.robots == flown.summary.robots


def test_recorded_commands_replayed_without_navigators_fly_the_same_flight(flown, setup, trace):
    robots = trace.trace().robots
    with quad_nav.Flight(setup, navigators=False) as flight:
        for _ in range(len(flown.trajectories[0]) - 1):
            now = [robot.commands[robot.command_times_s == flight.now_s] for robot in robots]
            flight.step({k: quad_nav.Command(*row[0]) for k, row in enumerate(now) if len(row)})
        result = flight.result()
    for one, other in zip(flown.trajectories, result.trajectories):
        assert np.array_equal(one, other)


def test_steps_observe_poses_goals_scans_and_contacts(setup):
    with quad_nav.Flight(setup, period_s=0.1, navigators=False) as flight:
        assert flight.observe(0).goal is None
        for _ in range(60):
            flight.step({0: quad_nav.Command(-1.0, 0.0, 0.0)})
        seen, other = flight.observe(0), flight.observe(1)
    assert flight.now_s == 6.0
    assert (seen.goal.x_m, seen.goal.y_m) == (2.1, 1.9)
    assert seen.scan.ranges_m.shape == (128,) and seen.scan.stamp_s == 6.0
    assert [contact.other for contact in seen.contacts] == ["wall_west"]
    assert other.contacts == ()
    assert flight.contacts == list(seen.contacts)
    assert seen.pose.distance_to(other.pose) == pytest.approx(
        np.hypot(*(flight.positions_m[0] - flight.positions_m[1])[:2])
    )


def test_goals_scenes_and_configurations_may_be_objects(flown, setup, tmp_path):
    file = tmp_path / "goals.json"
    file.write_text(json.dumps({"goals": GOALS[0], "goal_timeout": 50.0}))
    goals = quad_nav.load_goals(file)
    again = quad_nav.prepare(
        scene=quad_nav.load_scene(ROOT / "scenes" / "arena.yaml"),
        goals=[goals, {"goals": GOALS[1]}],
        config=[quad_nav.load_configuration("tutorial", robot=number) for number in range(2)],
    )
    assert again.scene == setup.scene
    assert again.robots[0].sequence.goals == goals.goals
    assert again.robots[0].sequence.settings.goal_timeout_s == 50.0
    assert again.configurations == quad_nav.prepare(goals=GOALS, config="tutorial").configurations


def test_faults_name_what_the_caller_gave():
    with pytest.raises(quad_nav.InputError) as caught:
        quad_nav.prepare(goals=[[[2.0, 2.0], [50.0, 2.0]], [[9.4, "2"]]])
    first, second = sorted(caught.value.problems)
    assert first.startswith("quad0_goals.json: goals[1] (goal 2): (50, 2) ")
    assert second.startswith('quad1_goals.json: goals[0] (goal 1): y is "2"; expected ')


@pytest.mark.parametrize(
    "commands, message",
    [
        ({2: None}, "commands for robots .2.; expected 0 to 1"),
        ({0: quad_nav.Command(float("nan"), 0.0, 0.0)}, "quad0: command is not finite"),
    ],
)
def test_steps_that_cannot_be_flown_are_refused(commands, message, setup):
    with quad_nav.Flight(setup, navigators=False) as flight:
        with pytest.raises(ValueError, match=message):
            flight.step(commands)
    with pytest.raises(ValueError, match="the flight is closed"):
        flight.step()
    flight.close()  # a second time


@pytest.mark.parametrize("period_s", [0.0, 0.03, 0.6])
def test_periods_that_do_not_fit_are_refused(period_s, setup):
    with pytest.raises(ValueError, match="expected a multiple of 0.025 s, at most 0.5 s"):
        quad_nav.Flight(setup, period_s=period_s)
