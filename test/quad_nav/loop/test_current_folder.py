"""Python files in the folder of a mission are data: no program of ours runs them."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import matplotlib
import pytest

from quad_nav.report.style import styled

ROOT = Path(__file__).parents[3]
NAMES = (
    *("argparse", "ast", "base64", "contextlib", "ctypes", "dataclasses", "importlib", "inspect"),
    *("joblib", "json", "logging", "multiprocessing", "nicegui", "numba", "numpy", "pathlib"),
    *("pickle", "pkgutil", "quad_nav", "random", "runpy", "secrets", "selectors", "signal"),
    *("socket", "struct", "subprocess", "tempfile", "threading", "traceback", "types", "typing"),
    *("uvicorn", "warnings", "weakref", "yaml"),
)
STUDY = """
import os
from quad_nav.offline.workers import LocalWorkers

def folder_of(task):
    return task, os.getcwd(), os.environ["PYTHONSAFEPATH"]

if __name__ == "__main__":
    print(sorted(LocalWorkers(2).run(folder_of, [(0, "a"), (1, "b")])))
    print("PYTHONSAFEPATH" in os.environ)
"""
NAVIGATORS = """
import os
from pathlib import Path
from quad_nav.loop import offline_setup
from quad_nav.loop.flight_loop import FlightLoop
from quad_nav.loop.navigator_group import NavigatorGroup
from quad_nav.scenario.flight_setup import FlightOptions, read_setup

class Group(NavigatorGroup):
    def reset(self, *arguments):
        Path("folder").write_text(os.getcwd())

if __name__ == "__main__":
    setup = offline_setup(read_setup(FlightOptions(None, Path({goals!r}), "tutorial")))
    loop = FlightLoop(setup, [(0,), (1,)], Group, start_method="forkserver")
    loop.start()
    loop.workers[0].reset(0.0, 0, False)
    loop.close()
    print(Path("folder").read_text())
"""


@pytest.fixture
def mission(tmp_path):
    """Folder with a Python file for each of many names; none of them may have run."""
    folder = tmp_path / "mission"
    folder.mkdir()
    for name in NAMES:
        code = f"open({str(tmp_path / 'ran')!r}, 'a').write('{name}.py\\n')\n"
        (folder / f"{name}.py").write_text(code)
    yield folder
    ran = tmp_path / "ran"
    assert not ran.exists(), ran.read_text()


def run(folder, *command):
    """Run a program in a folder and return its output."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    done = subprocess.run(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, timeout=200, check=True
    )
    return done.stdout.decode()


def run_script(folder, text):
    """Run a script of another folder, which has that one on its path."""
    script = folder.parent / "script.py"
    script.write_text(text)
    return run(folder, sys.executable, script)


def test_workers_of_a_study(mission):
    expected = [(0, ("a", str(mission), "1")), (1, ("b", str(mission), "1"))]
    assert run_script(mission, STUDY) == f"{expected}\nFalse\n"


def test_navigators_in_other_processes(mission):
    text = NAVIGATORS.format(goals=str(ROOT / "goals"))
    assert run_script(mission, text) == f"{mission}\n"


def test_parameters_for_roslaunch(mission):
    launch = ElementTree.parse(ROOT / "launch" / "quad.launch").getroot()
    defaults = {arg.get("name"): arg.get("default") for arg in launch.iter("arg")}
    words = {**defaults, "i": "0"}
    command = re.sub(
        r"\$\(arg (\w+)\)",
        lambda match: words[match.group(1)],
        next(param.get("command") for param in launch.iter("param")),
    )
    command = shlex.split(command.replace("$(find quad)", str(ROOT)))
    assert "robot_base_frame: base_link0" in run(mission, sys.executable, *command)


def test_supervisor_of_nodes(mission):
    module = (ROOT / "nodes" / "run_module", "quad_nav.mission.respawn")
    assert run(mission, sys.executable, *module, "echo", "node") == "node\n"


@pytest.mark.parametrize(
    "path", [*(ROOT / "launch").iterdir(), *(ROOT / "nodes").iterdir(), ROOT / "scripts" / "fly"]
)
def test_no_program_is_started_from_the_current_folder(path):
    lines = [
        line
        for line in path.read_text().splitlines()
        if re.search(r'python3"?,? "?-m"?,? "?quad', line)
    ]
    assert lines == []


def test_pictures_follow_no_file_of_the_current_folder(tmp_path):
    (tmp_path / "matplotlibrc").write_text("animation.ffmpeg_path: ./ffmpeg\ntext.usetex: true\n")
    with matplotlib.rc_context(fname=tmp_path / "matplotlibrc"):
        assert matplotlib.rcParams["animation.ffmpeg_path"] == "./ffmpeg"
        with styled():
            assert matplotlib.rcParams["animation.ffmpeg_path"] == "ffmpeg"
            assert not matplotlib.rcParams["text.usetex"]
