"""What `quad tune` and `quad sweep` are given: words without effect, and words that do harm."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import pytest
from small_mission import write_mission
from study_flights import FLOWN, SPACE
from test_command_line import WITHOUT_EFFECT, assert_refused
from test_terminal import EVIL, NAME, QUOTED, quad

from quad_nav.files.shipped import shipped
from quad_tune.courses import Mission, MissionCourse, MissionOptions
from quad_tune.flight_cache import FlightCache

OVER = ("--over", "TrajectoryPlannerROS/max_vel_x=0.4")


@pytest.mark.parametrize("command", ["tune", "sweep --over TrajectoryPlannerROS/vx_samples=3"])
@pytest.mark.parametrize("parameter, fault", WITHOUT_EFFECT)
def test_parameters_without_effect_are_refused(command, parameter, fault):
    assert_refused(command, parameter, fault)


def test_candidates_may_set_parameters_of_planners_that_others_choose():
    """A study may search the planner and the parameters of each."""
    course = MissionCourse(MissionOptions((Mission(None, shipped("goals")),), robots=1))
    (case,) = course.search_cases(1)
    setup = course.setup(case, (("DWAPlannerROS/max_vel_x", 0.3),))
    assert len(setup.robots) == 1


def test_names_reach_the_terminal_without_control_sequences(tmp_path):
    named, out = tmp_path / NAME, tmp_path / "out"
    quad("tune", "--space", named, "--output", out)
    quad("tune", "--against", NAME, "--output", out)
    quad("sweep", "--points", named)
    quad("sweep", "--over", NAME)
    quad("sweep", "--over", f"TrajectoryPlannerROS/{NAME}=1,2")
    scene, goals = write_mission(tmp_path)
    cache = ("--cache", named / "nowhere" / "f.db")
    quad("sweep", "--scene", scene, "--goals", goals, *OVER, *cache)


def test_files_reach_the_terminal_without_control_sequences(tmp_path):
    scene, goals = write_mission(tmp_path)
    files = ["--scene", scene, "--goals", goals]
    (tmp_path / "space.yaml").write_text(f"{SPACE}{QUOTED}: {{range: [0, 1]}}\n")
    quad("tune", *files, "--space", tmp_path / "space.yaml", "--output", tmp_path / "out")
    (tmp_path / "p.csv").write_text(f'TrajectoryPlannerROS/max_vel_x,"{EVIL}"\n0.3,1\n')
    quad("sweep", *files, "--points", tmp_path / "p.csv")
    (tmp_path / "p.csv").write_text(f'TrajectoryPlannerROS/max_vel_x\n"{EVIL}"\n')
    quad("sweep", *files, "--points", tmp_path / "p.csv", shown=False)
    cache = FlightCache(tmp_path / "f.db")
    cache.add(("{}", "m", 0), replace(FLOWN, reached=7, goals=2, reason=EVIL))
    quad("sweep", *files, *OVER, "--cache", tmp_path / "f.db", shown=False)
    (tmp_path / "f.db").write_text(f"{EVIL}" * 50)
    quad("sweep", *files, *OVER, "--cache", tmp_path / "f.db", shown=False)


@pytest.mark.parametrize("command", ["tune", "sweep"])
def test_a_study_without_optuna_says_how_to_get_it(command):
    script = (
        "import sys; sys.modules['optuna'] = None\n"
        f"from quad_nav.cli import main; main(['{command}'])"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    refused = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True
    )
    assert (refused.returncode, refused.stderr) == (
        1,
        f"Error: quad {command}: optuna is not installed; "
        "expected it from pip install 'quad-nav[tune]', or in a checkout from make venv\n",
    )
