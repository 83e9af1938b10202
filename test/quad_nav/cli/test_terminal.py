"""No text of files and arguments reaches the terminal as a control sequence or a line."""

from __future__ import annotations

import json
import shutil
import unicodedata
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image
from small_mission import SCENE, write_mission

from quad_nav.cli import main
from quad_nav.errors import printable
from quad_nav.files.shipped import shipped
from quad_nav.mission.flight_log import Leg
from quad_nav.mission.goal import Goal
from quad_nav.mission.summary import MissionSummary, RobotSummary
from quad_nav.mission.summary_table import table
from quad_nav.sim.contacts import Contact

EVIL = "\x1b]0;owned\x07\x1b[2J\x9b31m\r\x08\x7f\u202ecod\u2066\u200e\nforged: all goals reached"
NAME = EVIL.replace("/", "")
QUOTED = json.dumps(EVIL)  # as JSON and as YAML


def assert_harmless(text, *, shown=True):
    """Fail if a terminal would obey the text, or if it has a line from a file."""
    bad = {c for c in text if c != "\n" and unicodedata.category(c) in ("Cc", "Cf", "Zl", "Zp")}
    assert bad == set(), repr(text)
    assert not any(line.lstrip().startswith("forged") for line in text.splitlines()), text
    assert not shown or "forged" in text, text  # otherwise the case says nothing


def quad(*arguments, status=2, shown=True):
    """Run a command and look at all that it prints."""
    done = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    assert done.exit_code == status, done.output
    assert_harmless(done.output, shown=shown)
    return done.output


@pytest.fixture
def mission(tmp_path):
    """The files of a small mission."""
    return write_mission(tmp_path)


@pytest.fixture
def folder(tmp_path):
    """A configuration that can be changed."""
    return Path(shutil.copytree(shipped("config", "default"), tmp_path / "config"))


YAML = {
    "key": f"TrajectoryPlannerROS: {{{QUOTED}: 1}}\n",
    "value": f"TrajectoryPlannerROS: {{max_vel_x: {QUOTED}}}\n",
    "planner": f"base_local_planner: {QUOTED}\nmax_vel_x: 1.0\n",
    "frame": f"local_costmap: {{global_frame: {QUOTED}, footprint: {QUOTED}}}\n",
    "twice": f"{{? {QUOTED} : 1, ? {QUOTED} : 2}}\n",
    "not YAML": "a: [\x1b[2J\n",
    "tag": "a: !forged\u202e x\n",
}


@pytest.mark.parametrize("how", YAML)
def test_parameters(folder, mission, how):
    (folder / "base_local_planner_params.yaml").write_text(YAML[how], encoding="utf-8")
    names_it = how not in ("not YAML", "tag")
    done = CliRunner().invoke(main, ["check", str(folder)])
    assert_harmless(done.output, shown=names_it)
    if how in ("key", "value"):
        files = ["--scene", str(mission.scene), "--goals", str(mission.goals)]
        arguments = ["fly", "--time-limit", "0.1", *files, "--config", str(folder)]
        done = CliRunner().invoke(main, arguments)
        assert done.exit_code == (2 if how == "value" else 1), done.output
        assert_harmless(done.output)


def test_names_of_files_and_folders(tmp_path):
    named = tmp_path / NAME
    quad("check", named)
    quad("fly", "--scene", named)
    quad("fly", "--goals", named)
    quad("fly", "--config", named)
    quad("fly", "--record", named)
    quad("report", named)
    named.mkdir()
    (named / "costmap_common_params.yaml").write_text("local_costmap: {width: 3.0}\n")
    quad("check", named, status=0)


def test_arguments(tmp_path):
    for arguments in (
        [f"--{NAME}"],
        [f"mission{NAME}"],  # click before 8.2 takes a first ESC for the dash of an option
        ["fly", f"--{NAME}"],
        ["fly", NAME],
        ["fly", "--seed", NAME],
        ["fly", "--set", NAME],
        ["fly", "--set", f"global_costmap/width=[{NAME}"],
    ):
        quad(*arguments)


GOALS = [
    f'{{"goals": [[1, 2]], {QUOTED}: 1}}',
    f'{{"goals": [[1, 2]], "goal_tolerance": {QUOTED}}}',
    f'{{"goals": [[1, 2]], {QUOTED}: 1, {QUOTED}: 2}}',
]


@pytest.mark.parametrize("text", GOALS)
def test_goals(mission, text):
    (mission.goals / "quad0_goals.json").write_text(text)
    quad("fly", "--scene", mission.scene, "--goals", mission.goals, shown="tol" not in text)


SCENES = [
    f"{SCENE}{QUOTED}: 1\n",
    SCENE.replace("name: small", f"name: {QUOTED}"),
    SCENE.replace("name: pillar", f"name: {QUOTED}"),
    SCENE.replace("shape: cylinder", f"shape: {QUOTED}"),
    f"world: {QUOTED}\n",
    f"name: x\nmap: {QUOTED}\n",
]


@pytest.mark.parametrize("text", SCENES)
def test_scenes(mission, text):
    mission.scene.write_text(text, encoding="utf-8")
    quad("fly", "--scene", mission.scene, "--goals", mission.goals)


XML_EVIL = "&#x202e;&#x9b;31m&#x85;&#10;forged: all goals reached"
WORLD = "<sdf version='1.6'><world name='w'>{}</world></sdf>"


@pytest.mark.parametrize(
    "parts",
    [
        f"<model name='{XML_EVIL}'><link name='l'><collision name='c'><geometry><box><size>0 1 1"
        "</size></box></geometry></collision></link></model>",
        f"<include><uri>{XML_EVIL}</uri></include>",
        f"<model name='m'><pose>{XML_EVIL}</pose></model>",
        f"<model name='{XML_EVIL}'><pose>nan</pose></model>",
    ],
)
def test_worlds(mission, tmp_path, parts):
    (tmp_path / "a.world").write_text(WORLD.format(parts), encoding="utf-8")
    world = tmp_path / "a.world"
    quad("fly", "--scene", world, "--goals", mission.goals, shown="<pose>&" in parts)


@pytest.mark.parametrize(
    "line", [f"image: {QUOTED}", f"image: m.png\nmode: {QUOTED}", f"{QUOTED}: 1"]
)
def test_maps(mission, tmp_path, line):
    Image.fromarray(np.full((40, 40), 254, np.uint8)).save(tmp_path / "m.png")
    usual = "resolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 2\nfree_thresh: 0.1\n"
    (tmp_path / "m.yaml").write_text(f"{line}\n{usual}")
    shown = line != f"{QUOTED}: 1"  # the faults of the other keys are first
    quad("fly", "--scene", tmp_path / "m.yaml", "--goals", mission.goals, shown=shown)


@pytest.mark.parametrize("name", ["a.bag", f"{NAME}.bag", "a.txt"])
def test_recordings(tmp_path, name):
    path = tmp_path / name
    path.write_text(f"#ROSBAG V2.0\n{EVIL}")
    quad("report", path, shown="forged" in name)


def test_messages_of_move_base_in_the_summary():
    leg = Leg(0, 1, Goal(1.0, 2.0), False, EVIL, 1, 3.0, 1.0, 1.0)
    robots = (RobotSummary("quad0", (leg, replace(leg, time_s=None))),)
    contacts = (Contact(1.0, "quad0", EVIL, 1.0, 2.0),)
    assert_harmless(table(MissionSummary(robots, contacts=contacts, reason=EVIL)))


def test_printable():
    assert printable("a\tb\x1b[0m\x85\u2028\u202e") == "a\\tb\\x1b[0m\\x85\\u2028\\u202e"
    assert printable("quäd 漢字 → 90°") == "quäd 漢字 → 90°"
    assert printable("a\nb") == "a\\nb" and printable("a\nb\r", "\n") == "a\nb\\r"
    assert printable(printable(EVIL)) == printable(EVIL)
    assert printable("\udcff") == "\\udcff"
