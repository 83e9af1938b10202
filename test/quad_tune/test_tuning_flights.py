"""Studies that really fly: courses, workers, the commands and what they write."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from small_mission import write_mission
from study_flights import (
    FAST,
    SPACE,
    mission_options,
    mortal_tasks,
    searched,
    tune_setup,
)
from test_report_page import assert_loads_nothing

from quad_nav import config
from quad_nav.errors import InputError
from quad_nav.offline.workers import MAX_DEATHS, LocalWorkers, WorkersLost, fly_all
from quad_tune.cli.sweep import sweep
from quad_tune.cli.tune import tune
from quad_tune.courses import HELD_OUT_SEED, Case, Mission, MissionCourse, check_missions
from quad_tune.evaluation import task_of
from quad_tune.flight_result import fly_task
from quad_tune.sweep import read_points

ROOT = Path(__file__).resolve().parents[2]
SETS = [word for path, value in FAST for word in ("--set", f"{path}={value}")]


def test_the_number_of_workers_does_not_change_the_study(tmp_path):
    one = searched(tune_setup(tmp_path, tmp_path / "one"), LocalWorkers(1))
    two = searched(tune_setup(tmp_path, tmp_path / "two"), LocalWorkers(2))
    assert one == two
    assert [trial[0] for trial in one] == [0, 1, 2]
    assert one[0][3]["TrajectoryPlannerROS/max_vel_x"] == 0.3  # the base's own


def test_flights_of_a_worker_that_dies_are_flown_again(tmp_path):
    flown = dict(fly_all(LocalWorkers(2), fly_task, mortal_tasks(tmp_path / "deaths", 1)))
    assert {number: flight.reason for number, flight in flown.items()} == dict.fromkeys(
        range(6), "flown"
    )
    assert (tmp_path / "deaths").read_text() == "xx"


def test_workers_that_die_again_and_again_end_it(tmp_path):
    tasks = mortal_tasks(tmp_path / "deaths", 1000)[3:4]
    with pytest.raises(WorkersLost, match=f"died {MAX_DEATHS} times .* of 1 flights"):
        list(fly_all(LocalWorkers(2), fly_task, tasks))


def test_what_is_held_out_is_never_searched(tmp_path):
    mission = Mission(*write_mission(tmp_path))
    options = replace(
        mission_options(tmp_path), missions=(mission, Mission()), robots=1, parameters=()
    )
    course = MissionCourse(options)
    searched_cases, held_out = course.search_cases(200), course.held_out_cases(100)
    assert not {case.seed for case in searched_cases} & {case.seed for case in held_out}
    assert searched_cases[:4] == (
        Case(0, mission.name, 0),
        Case(1, "random", 0),
        Case(0, mission.name, 1),
        Case(1, "random", 1),
    )
    assert held_out[0] == Case(0, mission.name, HELD_OUT_SEED)
    # A random mission's scene is its seed's, so those that are held out are others too.
    scenes = [course.setup(case, ()).scene for case in (searched_cases[1], held_out[1])]
    assert scenes[0].obstacles != scenes[1].obstacles

    other = Mission(*write_mission(tmp_path / "other"))
    named = MissionCourse(replace(options, held_out=(other,)))
    assert {case.name for case in named.held_out_cases(5)} == {other.name}
    with pytest.raises(InputError, match="is also a mission of the search"):
        check_missions(replace(options, held_out=(mission,)))
    with pytest.raises(InputError, match="expected less than 1000000"):
        check_missions(replace(options, seed=HELD_OUT_SEED))


def test_a_flight_needs_no_files_where_it_is_flown(tmp_path):
    course = MissionCourse(mission_options(tmp_path))
    task = task_of(course, course.search_cases(1)[0], (("TrajectoryPlannerROS/max_vel_x", 0.6),))
    for path in (tmp_path / "goals").iterdir():
        path.unlink()
    flight = fly_task(task)
    assert flight.succeeded and flight.goals == 1
    assert flight.straight_m == 3.0
    # To 0.4 m before the goal at no more than 0.6 m/s, and a way round a pillar.
    assert 2.6 / 0.6 < flight.time_s < 10.0
    assert flight.gap_m == flight.clearance_m > 0.0
    assert flight.roughness_mps2 > 0.0


def test_parameters_that_cannot_be_flown_with_reach_no_goal(tmp_path):
    course = MissionCourse(mission_options(tmp_path))
    task = task_of(course, course.search_cases(1)[0], (("TrajectoryPlannerROS/sim_time", -1.0),))
    flight = fly_task(task)
    assert not flight.completed
    assert "sim_time" in flight.reason


def test_the_lidar_can_be_another_one(tmp_path):
    course = MissionCourse(mission_options(tmp_path))
    case = course.search_cases(1)[0]
    lidar = course.setup(case, (("lidar/range", 3), ("lidar/beams", 90))).simulation.lidar
    assert (lidar.range_max_m, lidar.beam_count) == (3.0, 90)
    assert "lidar/rnge: unknown" in task_of(course, case, (("lidar/rnge", 3),)).refused
    assert "expected more than 0" in task_of(course, case, (("lidar/beams", 0),)).refused


def files_of(folder):
    """Options with the files of a short mission."""
    mission = write_mission(folder)
    return [*("--scene", str(mission.scene), "--goals", str(mission.goals)), *SETS]


def tune_arguments(folder):
    """A study of two candidates that flies in a few seconds."""
    (folder / "space.yaml").write_text(SPACE)
    sizes = "--candidates 2 --flights 2 --finalists 1 --final-flights 2 --held-out 1 --workers 1"
    outputs = ["--output", str(folder / "out"), "--pictures", str(folder / "pictures")]
    more = ["--space", str(folder / "space.yaml"), "--free-speed", "--against", "tutorial"]
    return [*files_of(folder), *sizes.split(), *more, *outputs]


def test_tune_from_the_command_line_and_again(tmp_path):
    arguments = tune_arguments(tmp_path)
    first = CliRunner().invoke(tune, arguments)
    assert first.exit_code == 0, first.output
    found = json.loads((tmp_path / "out" / "results.json").read_text())
    assert set(found["held_out"]) == {"tutorial", "default", "tuned"}
    written = config.load(config.load_files(tmp_path / "out" / "config", {"i": "0"})).to_tree()
    speed = found["parameters"].get("TrajectoryPlannerROS/max_vel_x", 0.3)
    assert written["TrajectoryPlannerROS"]["max_vel_x"] == speed
    assert written["TrajectoryPlannerROS"]["vtheta_samples"] == 8  # the value of --set
    assert "quad" in (tmp_path / "out" / "config" / "STUDY.md").read_text()
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.count("data:image/png;base64,") >= 4
    for name in ("held_out", "history", "pareto", "slices"):
        assert f'id="figure-plot-{name}"' in page
        assert (tmp_path / "pictures" / f"{name}.svg").exists()
    assert "Not distinguishable from chance with 1 flight" in page or "Base kept" in page
    assert_loads_nothing(page)

    again = CliRunner().invoke(tune, arguments)
    assert again.exit_code == 0
    assert "0 flights in" in again.output  # everything was there already
    assert (
        json.loads((tmp_path / "out" / "results.json").read_text())["held_out"]
        == (found["held_out"])
    )
    other = CliRunner().invoke(tune, [*arguments, "--seed", "1"])
    assert other.exit_code == 2
    assert "seed was 0 and is 1" in other.output


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["--set", "a"], "expected PATH=VALUE"),
        (
            ["--config", "nowhere"],
            "or the name of a shipped one",
        ),
        (["--scene", "a.yaml", "--scene", "b.yaml", "--goals", "g"], "a folder of goals for each"),
        (["--space", "none.yaml"], "none.yaml: cannot be read"),
    ],
)
def test_tune_refuses_what_it_cannot_use(arguments, words, tmp_path):
    result = CliRunner().invoke(tune, [*arguments, "--output", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert words in result.output
    assert not (tmp_path / "out").exists()


def test_sweep_from_the_command_line(tmp_path):
    names = {"cache": "f.db", "csv": "s.csv", "json": "s.json", "report": "s.html"}
    outputs = [word for name in names for word in (f"--{name}", str(tmp_path / names[name]))]
    outputs += ["--pictures", str(tmp_path / "png"), "--flights", "1", "--workers", "1"]
    speeds = ["--over", "TrajectoryPlannerROS/max_vel_x=0.4,0.8"]
    radii = ["--over", "*_costmap/inflation_radius=0.4,0.6"]
    done = CliRunner().invoke(sweep, [*speeds, *radii, *files_of(tmp_path), *outputs])
    assert done.exit_code == 0, done.output
    with (tmp_path / "s.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [
        (row["TrajectoryPlannerROS/max_vel_x"], row["*_costmap/inflation_radius"]) for row in rows
    ] == [("0.4", "0.4"), ("0.4", "0.6"), ("0.8", "0.4"), ("0.8", "0.6")]
    assert float(rows[2]["mean_time_s"]) < float(rows[0]["mean_time_s"])
    found = json.loads((tmp_path / "s.json").read_text())
    assert [len(row["flights"]) for row in found["rows"]] == [1, 1, 1, 1]
    assert (tmp_path / "png" / "sweep.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "png" / "sweep.svg").read_bytes().startswith(b"<?xml")
    page = (tmp_path / "s.html").read_text()
    assert 'id="figure-plot-sweep"' in page and "<b>Roughness</b>: mean change" in page


@pytest.mark.parametrize(
    "arguments, words",
    [
        ([], "expected --over"),
        (["--over", "a"], "expected PATH=A,B"),
        (["--over", "a=1,1"], "duplicate value"),
        (["--over", "a=1,2", "--over", "a=3"], "duplicate path"),
        (["--over", "TrajectoryPlannerROS/max_vell_x=1,2"], "did you mean max_vel_x?"),
        (["--over", "TrajectoryPlannerROS/sim_time=1,-2"], "sim_time=-2"),
    ],
)
def test_sweep_refuses_what_it_cannot_use(arguments, words):
    result = CliRunner().invoke(sweep, arguments)
    assert result.exit_code == 2
    assert words in result.output


def test_points_from_a_file(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("a/b, c\n0.5, true\n1, x\n")
    assert read_points(path) == ({"a/b": 0.5, "c": True}, {"a/b": 1, "c": "x"})
    path.write_text("a,b\n1\n")
    with pytest.raises(InputError, match="row 2: 1 values, expected 2"):
        read_points(path)
    path.write_text("a,b\n")
    with pytest.raises(InputError, match="a row for each point"):
        read_points(path)


def test_flying_does_not_wait_for_optuna():
    code = (
        "import sys, quad_nav.cli.fly; "
        "sys.exit(sorted({'optuna', 'joblib', 'sqlalchemy'} & set(sys.modules)) != [])"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    assert subprocess.run([sys.executable, "-c", code], env=environment).returncode == 0
