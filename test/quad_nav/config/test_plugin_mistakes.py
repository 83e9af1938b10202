"""Mistakes in plugins end in the plugin's file and line, with what was flown until then."""

from __future__ import annotations

import importlib
import pickle
import sys
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from quad_nav import config
from quad_nav.cli import main
from quad_nav.errors import InputError, NoPath, PluginError
from quad_nav.files.shipped import shipped
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec
from quad_nav.offline.run import fly
from quad_nav.scenario.assembly import build_global_planner, build_navigator
from quad_nav.scenario.flight_setup import FlightOptions, read_setup

SOURCE = """\
import numpy as np
from quad_nav.control.controller import Control
from quad_nav.costmap.layer import Layer
from quad_nav.errors import NoPath
from quad_nav.geometry import Twist2D
from quad_nav.recovery import Step


class Planner:
    def __init__(self, params, footprint):
        self.params = params

    def make_plan(self, spec, costs, start, goal):  # plan
        return {
            "Divides": lambda: divide(1, 0),
            "InLibrary": lambda: np.reshape(np.zeros(4), (3, 3)),  # reshapes
            "NoPlan": lambda: None,
            "Flat": lambda: np.zeros(6),
            "Nan": lambda: np.full((2, 3), np.nan),
            "Empty": lambda: np.zeros((0, 3)),
            "OnPurpose": on_purpose,
            "Planner": lambda: np.zeros((2, 3)),
        }[type(self).__name__]()


def divide(a, b):
    return a / b  # divides


def on_purpose():
    raise NoPath("there is a wall")


class Constructor(Planner):
    def __init__(self, params, footprint):
        self.speed = params.speed  # no speed


class Missing(Planner):
    def __init__(self, params, footprint):
        self.speed = params["speed"]


class Divides(Planner): ...
class InLibrary(Planner): ...
class NoPlan(Planner): ...
class Flat(Planner): ...
class Nan(Planner): ...
class Empty(Planner): ...
class OnPurpose(Planner): ...


class Pond(Layer):
    def __init__(self, params, spec, rolling_window, default_cost):
        super().__init__(params)

    def update_bounds(self, robot, now_s, bounds):  # bounds
        return bounds if now_s < 1.0 else 7

    def update_costs(self, master, window):
        pass
"""
SPEC = GridSpec(10, 10, 0.1, 0.0, 0.0)


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    """File of the module ``mistakes``."""
    path = tmp_path / "mistakes.py"
    path.write_text(SOURCE)
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    yield path
    sys.modules.pop("mistakes", None)


def located(text, path):
    """Replace {remark} by the file and the line that has the remark."""
    for number, line in enumerate(SOURCE.splitlines(), start=1):
        if "# " in line:
            text = text.replace("{" + line.partition("# ")[2] + "}", f"{path}:{number}")
    return text


def planner(name):
    tree = {"base_global_planner": f"mistakes.{name}", "global_costmap": {}, "local_costmap": {}}
    return build_global_planner(config.load(tree).global_planner, np.zeros((0, 2)))


def plan(name):
    costs = np.zeros((10, 10), dtype=np.uint8)
    return planner(name).make_plan(SPEC, costs, Pose2D(0.0, 0.0), Pose2D(0.5, 0.5))


@pytest.mark.parametrize(
    "name, fault",
    [
        ("Divides", "make_plan: ZeroDivisionError: division by zero ({divides})"),
        ("InLibrary", "cannot reshape array of size 4 into shape (3,3) ({reshapes})"),
        ("NoPlan", "returned None; expected an array float64[n, 3], n >= 1 ({plan})"),
        ("Flat", "returned an array of shape (6,); expected an array float64[n, 3], n >= 1"),
        ("Nan", "returned an array that is not finite"),
        ("Empty", "returned an array of shape (0, 3)"),
        ("Constructor", "'Parameters' object has no attribute 'speed' ({no speed})"),
    ],
)
def test_a_mistake_has_the_plugins_file_and_line(plugin, name, fault):
    with pytest.raises(PluginError) as caught:
        plan(name)
    text = str(caught.value)
    assert text.startswith(f"mistakes.{name}.") and located(fault, plugin) in text
    assert str(pickle.loads(pickle.dumps(caught.value))) == text  # workers send it


def test_errors_on_purpose_and_results_pass(plugin):
    with pytest.raises(NoPath, match="there is a wall"):
        plan("OnPurpose")
    with pytest.raises(InputError, match="Missing/speed: missing"):
        plan("Missing")
    assert plan("Planner").shape == (2, 3)
    made = planner("Planner")
    assert (type(made).__name__, type(made).__module__) == ("Planner", "mistakes")


def options(**changed):
    given = FlightOptions(None, shipped("goals"), time_limit_s=5.0, robots=2)
    return replace(given, **changed)


def test_a_flight_keeps_what_was_flown_before_the_mistake(plugin):
    layers = [{"name": "pond", "type": "mistakes.Pond"}]
    setup = read_setup(options(parameters=(("local_costmap/plugins", layers),)))
    with pytest.raises(PluginError) as caught:
        fly(setup, processes=2)
    summary = caught.value.summary
    assert summary.reason == str(caught.value)
    assert located("expected Bounds ({bounds})", plugin) in summary.reason
    assert 1.0 <= summary.sim_time_s < 1.2
    assert [robot.robot for robot in summary.robots] == ["quad0", "quad1"]
    assert summary.exit_status == 1


@pytest.mark.parametrize("quiet", [[], ["-q"]])
def test_the_command_prints_the_table_and_the_line(plugin, quiet):
    command = ["fly", "--set", "base_global_planner=mistakes.Divides", *quiet]
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 1 and "Traceback" not in done.output
    assert located("division by zero ({divides})", plugin) in done.output
    assert ("Mission FAILED" in done.output) is (not quiet)


def test_a_plugin_that_cannot_be_made_ends_the_command(plugin):
    done = CliRunner().invoke(main, ["fly", "--set", "base_global_planner=mistakes.Constructor"])
    assert done.exit_code == 1
    assert done.output.splitlines()[-1].endswith(located("({no speed})", plugin))


def test_shipped_planners_are_not_guarded():
    setup = read_setup(options())
    navigator = build_navigator(setup.configurations[0])
    assert type(navigator.planner).__module__.startswith("quad_nav.plan.")
