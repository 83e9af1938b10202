"""Limits of the robot stay without --free-speed; what the score cannot see is never searched."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from small_mission import write_mission
from study_flights import FLOWN, PaperWorkers, tune_setup, without_flying

from quad_nav import config
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.costmap.map_params import MapParams
from quad_nav.errors import InputError
from quad_nav.parameter import parameters_of
from quad_nav.recovery import MoveSlowAndClearParams, TurnLimits
from quad_tune.cli.tune import tune
from quad_tune.evaluation import StudyObserver
from quad_tune.parameter_files import write_parameters
from quad_tune.robot_limits import hold_limits, is_limit, is_protected
from quad_tune.space import Dimension, SearchSpace, load_space
from quad_tune.study_text import changes
from quad_tune.tune import run_tune

ROOT = Path(__file__).resolve().parents[2]
PLANNERS = (TrajectoryPlannerParams, DwaParams)
SPEEDS = ("m/s", "rad/s", "m/s^2", "rad/s^2")
LIMITS = """
  max_vel_x: 0.22
  min_vel_x: 0.05
  max_vel_theta: 0.6
  min_vel_theta: -0.6
  min_in_place_vel_theta: 0.3
  max_rotational_vel: 0.5
  acc_lim_x: 1.5
  acc_lim_theta: 2.5
  escape_vel: -0.07
"""


def parameters(*owners) -> list:
    """Parameters of dataclasses."""
    return [parameter for owner in owners for parameter in parameters_of(owner)]


def test_every_speed_of_both_planners_and_the_recoveries_is_held():
    """Their units tell which parameters are speeds and accelerations."""
    speeds = [
        one.name
        for one in parameters(*PLANNERS, MoveSlowAndClearParams, TurnLimits)
        if one.unit in SPEEDS
    ]
    assert len(speeds) > 20
    assert [name for name in speeds if not is_limit(f"P/{name}") and not is_protected(name)] == []
    old = ("y_vels", "backup_vel", "max_trans_vel", "max_rot_vel", "acc_lim_th", "acc_limit_trans")
    assert [name for name in (*old, "holonomic_robot") if not is_limit(f"P/{name}")] == []


def test_footprint_tolerances_and_checks_are_protected():
    found = {one.name for one in parameters(MapParams, *PLANNERS)}
    names = {name for name in found if not name.endswith("_topic")}  # no numbers
    kept = ("footprint", "radius", "tolerance", "stopped_vel", "scaling", "respect_meter")
    assert {name for name in names if is_protected(f"x/{name}")} == {
        name for name in names if any(word in name for word in kept) and name != "cost_scaling"
    }
    assert all(map(is_protected, ("peers/margin", "sensor_timeout", "/peers/avoid_peers")))
    assert not is_limit("TrajectoryPlannerROS/trans_stopped_velocity")


@pytest.mark.parametrize("name, held", [("default", 6), ("barn", 5), ("dwa", 4)])
def test_shipped_spaces_without_their_limits(name, held):
    """The rest has no parameter with the unit of a speed."""
    space = load_space(ROOT / "spaces" / f"{name}.yaml")
    kept = hold_limits(space)
    assert len(kept.held) == held
    changed = [path for path, _ in kept.space.assignments(kept.space.corners()[0])]
    speeds = {one.name for one in parameters(*PLANNERS) if one.unit in SPEEDS}
    assert {path.rpartition("/")[2] for path in changed} & speeds == set()
    assert len(kept.space.dimensions) >= 9
    assert not any(map(is_protected, changed))


def test_a_limit_that_follows_another_parameter_is_held_too():
    space = SearchSpace("s", (Dimension("P/sim_time", 1.0, 2.0, follow=(("P/max_vel_x", 0.2),)),))
    kept = hold_limits(space)
    assert kept.held == ("P/max_vel_x",)
    assert kept.space.assignments({"P/sim_time": 1.5}) == (("P/sim_time", 1.5),)


def robot(folder):
    """A configuration whose speeds are neither the defaults nor within the shipped spaces."""
    shutil.copytree(ROOT / "config" / "default", folder)
    path = folder / "base_local_planner_params.yaml"
    kept = [
        line
        for line in path.read_text().splitlines()
        if not any(line.strip().startswith(word.split(":")[0]) for word in LIMITS.split("\n  ")[1:])
    ]
    assert kept[0] == "TrajectoryPlannerROS:"
    path.write_text("\n".join([kept[0] + LIMITS.rstrip(), *kept[1:]]) + "\n")
    return folder


def tree_of(task):
    """The parameters that a task flies with."""
    return task.setup.configurations[0].to_tree()


def with_samples(task):
    """The fewer samples the faster, on paper; speeds have no say."""
    samples = tree_of(task)["TrajectoryPlannerROS"]["vx_samples"]
    return replace(FLOWN, time_s=20.0 + samples)


def study(folder, **given):
    """A study of the shipped space with a robot's own limits."""
    setup = tune_setup(folder, folder / "out", 12, config=str(robot(folder / "robot")), **given)
    return setup, run_tune(setup, PaperWorkers(with_samples), StudyObserver())


def test_the_tuned_files_keep_the_robots_limits(tmp_path):
    space = tmp_path / "space.yaml"
    shutil.copy(ROOT / "spaces" / "default.yaml", space)
    setup, result = study(tmp_path, free_speed=False)
    assert setup.held["TrajectoryPlannerROS/max_vel_x"] == 0.22
    assert "TrajectoryPlannerROS/vx_samples" in result.refined.values
    write_parameters(setup.base_source, tmp_path / "tuned", changes(result))
    before, after = (
        config.load_files(folder, {"i": "0"})["TrajectoryPlannerROS"]
        for folder in (tmp_path / "robot", tmp_path / "tuned")
    )
    assert "vx_samples" not in before and after["vx_samples"] < 20  # the default
    limits = {name: value for name, value in before.items() if is_limit(f"P/{name}")}
    assert len(limits) >= 9
    assert {name: after[name] for name in after if is_limit(f"P/{name}")} == limits
    assert {name for name in after if is_protected(f"P/{name}")} == {
        name for name in before if is_protected(f"P/{name}")
    }


def test_a_study_with_limits_in_its_space_resumes_only_with_free_speed(tmp_path):
    """Studies from before the option searched speeds."""
    old = tune_setup(tmp_path, tmp_path / "out", free_speed=True)
    done = run_tune(old, PaperWorkers(), StudyObserver())
    with pytest.raises(InputError) as raised:
        run_tune(replace(old, **vars_without_speed(tmp_path)), PaperWorkers(), StudyObserver())
    assert raised.value.problems == [
        f"{tmp_path / 'out'}: the folder holds another study: TrajectoryPlannerROS/max_vel_x was "
        "searched and is not (a limit of the robot, searched only with --free-speed); expected the "
        "same options, or another folder with --output"
    ]
    workers = PaperWorkers()
    again = run_tune(old, workers, StudyObserver())
    assert workers.flown == 0
    assert [trial.params for trial in again.trials] == [trial.params for trial in done.trials]


def vars_without_speed(folder):
    """The fields of a set-up without --free-speed."""
    held = tune_setup(folder, folder / "out", free_speed=False)
    return {"space": held.space, "held": held.held, "options": held.options, "base": held.base}


def command(folder, space, *more):
    """Arguments of a short study."""
    mission = write_mission(folder)
    (folder / "mine.yaml").write_text(space)
    return [
        *("--scene", str(mission.scene), "--goals", str(mission.goals), "--workers", "1"),
        *("--space", str(folder / "mine.yaml"), "--output", str(folder / "out"), *more),
    ]


@pytest.mark.parametrize(
    "space, more, words",
    [
        (
            "TrajectoryPlannerROS/xy_goal_tolerance: {range: [0.1, 1]}",
            ["--free-speed"],
            "mine.yaml: TrajectoryPlannerROS/xy_goal_tolerance: never searched, because",
        ),
        (
            "TrajectoryPlannerROS/sim_time:\n  range: [1, 2]\n"
            "  follow: {'*_costmap/robot_radius': 0.1}",
            [],
            "mine.yaml: *_costmap/robot_radius: never searched",
        ),
        (
            "TrajectoryPlannerROS/max_vel_x: {range: [0.2, 1]}",
            [],
            "every parameter is a limit of the robot, which is searched only with --free-speed",
        ),
        (
            "TrajectoryPlannerROS/max_vel_x: {range: [0.2, 1]}",
            ["--free-speed", "--set", "TrajectoryPlannerROS/max_vel_x=0.3"],
            "every parameter is fixed by --set",
        ),
    ],
)
def test_spaces_that_are_refused(tmp_path, space, more, words):
    done = CliRunner().invoke(tune, command(tmp_path, space, *more))
    assert done.exit_code == 2
    assert words in done.output
    assert not (tmp_path / "out").exists()


def test_the_start_names_the_limits_that_stay(tmp_path, monkeypatch):
    without_flying(monkeypatch, "tune_study")
    monkeypatch.setattr("quad_tune.cli.tune_study.write_result", lambda *_: ())
    space = "TrajectoryPlannerROS/max_vel_x: {range: [0.2, 1]}\nplanner_frequency: {range: [1, 2]}"
    sizes = ["--candidates", "2", "--flights", "1", "--held-out", "1", "--final-flights", "1"]
    done = CliRunner().invoke(tune, command(tmp_path, space, *sizes))
    assert done.exit_code == 0, done.output
    assert (
        "tune: the robot's limits stay as in default: TrajectoryPlannerROS/max_vel_x 0.3; "
        "--free-speed searches them" in done.output
    )
    # 1 flight of the base, 2 of candidates, 3 after the selection, 2 held out.
    assert "2 candidates x up to 1 flights, 1 parameters" in done.output
    assert "up to about 8 flights on 1 process\n" in done.output
