"""Plugins: the examples of docs/plugins.md fly, and unfit classes are refused."""

from __future__ import annotations

import importlib
import re
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
import yaml

from quad_nav import config
from quad_nav.config.fixes import GROUPS
from quad_nav.config.plugins import Plugin, plugin_name
from quad_nav.costmap.scan_filter import ScanSituation
from quad_nav.errors import GoalOutsideMap, InputError, NoPath, PluginError
from quad_nav.geometry import Pose2D, Pose3D, Scan, Twist2D
from quad_nav.grid import INSCRIBED, LETHAL
from quad_nav.navigator.command_filter import StopReason
from quad_nav.navigator.tick import RobotPoses, State, Trigger
from quad_nav.scenario.assembly import apply_configuration, build_navigator, build_scan_filters

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "plugins.md").read_text()
COSTMAP = {
    "width": 10.0,
    "height": 10.0,
    "resolution": 0.1,
    "robot_radius": 0.2,
    "plugins": [{"name": "inflation_layer", "type": "costmap_2d::InflationLayer"}],
}
HERE, GOAL = Pose2D(1.0, 2.0, 0.0), Pose2D(3.0, 5.0, 1.0)


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Writes modules of a package that exists for one test."""
    folder = tmp_path / "my_package"
    folder.mkdir()
    (folder / "__init__.py").touch()
    monkeypatch.syspath_prepend(str(tmp_path))

    def write(name: str, text: str) -> None:
        (folder / name).write_text(textwrap.dedent(text))
        importlib.invalidate_caches()

    yield write
    for name in [name for name in sys.modules if name.split(".")[0] == "my_package"]:
        del sys.modules[name]


@pytest.fixture
def tree(package):
    """The page's package is written; its YAML on costmaps without obstacles."""
    for source in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL):
        package(re.match(r"# my_package/(\w+\.py)\n", source).group(1), source)
    tree = {"global_costmap": dict(COSTMAP), "local_costmap": dict(COSTMAP)}
    for text in re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL):
        for key, value in yaml.safe_load(text).items():
            tree[key] = {**tree[key], **value} if key in tree else value
    return tree


def problems(tree):
    with pytest.raises(InputError) as caught:
        config.load(tree, "/nav")
    return caught.value.problems


def fly(navigator, pose: Pose2D, goal: Pose2D, end_s: float):
    """Ticks of a robot that follows its commands until the goal ends."""
    ticks = [navigator.tick(0.0, RobotPoses(pose, pose), Twist2D())]
    navigator.set_goal(goal, 0.0)
    command, now_s = Twist2D(), 0.0
    while now_s < end_s and not ticks[-1].outcome:
        ticks.append(navigator.tick(now_s, RobotPoses(pose, pose), command))
        command = ticks[-1].command or command
        step_s = max(min(navigator.next_due_s - now_s, 0.1), 1e-3)
        pose = Pose2D(
            pose.x_m + step_s * command.vx_mps * np.cos(pose.yaw_rad),
            pose.y_m + step_s * command.vx_mps * np.sin(pose.yaw_rad),
            pose.yaw_rad + step_s * command.vyaw_radps,
        )
        now_s += step_s
    return ticks, pose


def test_examples_load_with_remarks_on_empty_costmaps_only(tree):
    configuration = config.load(tree, "/nav")

    assert [remark.place for remark in configuration.remarks] == ["/nav/local_costmap"]
    assert configuration.global_planner.parameters == {"max_cost": 50}
    assert configuration.local_planner.parameters == {"speed": 0.4, "xy_goal_tolerance": 0.2}
    assert configuration.local_planner_period_s == 0.1
    layers = dict(configuration.global_costmap.layers)
    assert list(layers) == ["pond", "inflation_layer"]
    assert layers["pond"]["radius"] == 0.5
    [(name, recovery)] = configuration.recoveries
    assert name == "back_off" and isinstance(recovery, Plugin)
    again = config.load(configuration.to_tree(), "/nav")
    assert again.global_planner == configuration.global_planner
    assert again.recoveries == configuration.recoveries


def test_examples_fly_to_the_goal_with_limited_accelerations(tree):
    """At 10 Hz, 0.4 m/s^2 is 0.04 m/s from one command to the next; a stop is not limited."""
    navigator = build_navigator(config.load(tree))

    ticks, pose = fly(navigator, HERE, GOAL, 30.0)

    assert ticks[-1].outcome.succeeded
    assert pose.distance_to(GOAL) <= 0.2
    plans = [tick.plan for tick in ticks if tick.plan is not None]
    np.testing.assert_allclose(plans[0][[0, -1]], [[1.0, 2.0, 1.0], [3.0, 5.0, 1.0]])
    commands = [tick.command.vx_mps for tick in ticks if tick.command]
    assert commands[:4] == pytest.approx([0.04, 0.08, 0.12, 0.16])
    assert np.diff(commands[:-1]).max() <= 0.04 + 1e-9 and max(commands) == pytest.approx(0.4)
    assert ticks[-1].stop is StopReason.GOAL_ENDED and commands[-1] == 0.0


def test_the_example_scan_filter_masks_beams(tree):
    filters = build_scan_filters(config.load(tree))
    ranges_m = np.array([0.1, 3.0], np.float32)
    scan = Scan(0.0, 0.0, 1.0, 0.02, 60.0, ranges_m)
    situation = ScanSituation(
        0.0, "scan", Pose3D(0.0, 0.0, 1.0), True, 0.5, (0.0, 2.0), np.empty((0, 3))
    )
    filtered = filters.filter(scan, situation)
    assert filtered.masked.tolist() == [True, False] and not filtered.rejected


def test_a_filter_that_returns_no_command_is_a_mistake(package):
    package(
        "wrong.py",
        """
        from quad_nav.navigator.command_filter import CommandFilter

        class Forgets(CommandFilter):
            def __init__(self, params): ...
            def filter(self, command, situation): ...
        """,
    )
    tree = {"command_filters": [{"name": "a", "type": "my_package.wrong.Forgets"}]}
    navigator = build_navigator(config.load(tree))
    navigator.set_goal(GOAL, 0.0)
    with pytest.raises(PluginError, match="Forgets.filter returned .*; expected the Command"):
        navigator.tick(0.0, RobotPoses(HERE, HERE), Twist2D())


def test_example_layer_is_in_the_costmap_and_inflated(tree):
    navigator = build_navigator(config.load(tree))
    navigator.tick(0.0, RobotPoses(HERE, HERE), Twist2D())

    costs, spec = navigator.global_costmap.costs, navigator.global_costmap.spec
    centre, beside = spec.cell_of(4.0, 2.0), spec.cell_of(4.65, 2.05)
    assert costs[centre[1], centre[0]] == LETHAL
    assert costs[beside[1], beside[0]] == INSCRIBED
    assert (costs == LETHAL).sum() == pytest.approx(np.pi * 0.5**2 / 0.1**2, rel=0.1)
    tree["global_costmap"]["pond"] = {**tree["global_costmap"]["pond"], "enabled": False}
    navigator = build_navigator(config.load(tree))
    navigator.tick(0.0, RobotPoses(HERE, HERE), Twist2D())
    assert not navigator.global_costmap.costs.any()


def test_example_planner_fails_and_example_recovery_backs_off(tree):
    tree["planner_patience"] = 0.5
    navigator = build_navigator(config.load(tree))

    ticks, pose = fly(navigator, HERE, Pose2D(7.0, 2.0), 10.0)

    assert any(
        re.match(r"there is an obstacle at \(3\.\d\d, 2\.00\) m", tick.planning_failed)
        for tick in ticks
    )
    assert [tick.recovery.name for tick in ticks if tick.recovery] == ["back_off"]
    assert pose.x_m == pytest.approx(HERE.x_m - 0.3, abs=0.02)
    assert ticks[-1].outcome.text == Trigger.PLANNING.value
    with pytest.raises(GoalOutsideMap):
        navigator.make_plan(HERE, Pose2D(1.0, -1.0))
    with pytest.raises(NoPath):
        navigator.make_plan(HERE, Pose2D(4.0, 2.0))


def test_planner_is_kept_until_the_footprint_changes(tree):
    configuration = config.load(tree)
    navigator = build_navigator(configuration)
    planner = navigator.planner

    configuration = config.updated(configuration, "", {"planner_frequency": 1.0})
    apply_configuration(navigator, configuration)
    assert navigator.planner is planner
    assert navigator.state is State.IDLE
    apply_configuration(
        navigator, config.updated(configuration, "global_costmap", {"robot_radius": 0.3})
    )
    assert navigator.planner is not planner


def test_nothing_of_a_plugin_is_reconfigurable(tree):
    namespaces = set(config.reconfigurable(config.load(tree)))
    costmaps = ("global_costmap", "local_costmap")
    inflation = {f"{name}/inflation_layer" for name in costmaps}
    assert namespaces == {"", *costmaps, *inflation, *GROUPS}


def test_errors_in_parameters_name_their_place(tree):
    tree["global_costmap"]["pond"] = {"enabled": "no"}
    assert problems(tree) == [
        "/nav/global_costmap/pond/enabled: 'no' is not a boolean; expected true or false"
    ]
    del tree["back_off"]
    tree["global_costmap"]["pond"] = {"x": 1.0}
    configuration = config.load(tree)
    with pytest.raises(InputError, match="^global_costmap/pond/y: missing; expected a value$"):
        build_navigator(configuration)
    tree["global_costmap"] = COSTMAP
    with pytest.raises(InputError, match="^back_off/distance: missing; expected a value$"):
        build_navigator(config.load(tree))


def test_namespace_of_a_plugin():
    names = ("navfn/NavfnROS", "costmap_2d::NavfnROS", "my_package.planners.NavfnROS", "NavfnROS")
    assert {plugin_name(name) for name in names} == {"NavfnROS"}


@pytest.mark.parametrize(
    "name, complaint",
    [
        (
            "no_such_package.planners.Mine",
            r"no module no_such_package; expected package\.module\.Class with the package's folder"
            " in PYTHONPATH",
        ),
        ("my_package.nowhere.Mine", r"no module my_package\.nowhere; .*"),
        (
            "my_package.planners.Mine",
            r"my_package\.planners \(.*planners\.py\) has no class Mine; expected a global planner"
            r" as package\.module\.Class",
        ),
        ("my_package.planners.limit", ".* has limit, not a class; .*"),
    ],
)
def test_missing_module_or_class(package, name, complaint):
    package("planners.py", "limit = 3\n")
    [line] = problems({"base_global_planner": name})
    assert re.fullmatch(f"/nav/base_global_planner: {complaint}", line)


@pytest.mark.parametrize(
    "source, complaint",
    [
        ("import no_such_thing", "ModuleNotFoundError: No module named 'no_such_thing'"),
        ("x = 1\ny = undefined", r"NameError: name 'undefined' is not defined \(.*broken\.py:2\)"),
        ("def f(:", "SyntaxError"),
    ],
)
def test_module_that_cannot_be_imported(package, source, complaint):
    package("broken.py", source)
    [line] = problems({"base_global_planner": "my_package.broken.Mine"})
    assert line.startswith("/nav/base_global_planner: cannot import my_package.broken: ")
    assert re.search(complaint, line)


MISFITS = """
class Plan:
    def __init__(self, params):
        pass

    def make_plan(self, spec, costs):
        return None


class Inherits(GlobalPlanner):  # a method of the interface does not count
    def __init__(self, params, footprint):
        pass


class Control:
    def __init__(self, params, footprint, control_period_s):
        pass

    def set_plan(self, plan):
        pass

    def compute_velocity(self, spec, costs, pose, velocity):
        pass


class Plain:
    pass


class Mine(Layer):
    def update_bounds(self, robot, bounds):
        return bounds


class Recover:
    def __init__(self, params):
        self.period_s = 0.1

    def step(self, context):
        pass


class Anything:
    def __init__(self, *arguments, **options):
        pass

    @staticmethod
    def make_plan(spec, costs, start, goal, hurry=False):
        return None
"""
PLAN = "make_plan(self, spec, costs, start, goal)"
CONTROL = "compute_velocity(self, spec, costs, pose, velocity"


@pytest.mark.parametrize(
    "kind, tree, lacks",
    [
        (
            "a global planner",
            {"base_global_planner": "my_package.misfits.Plan"},
            [
                "__init__(self, params) cannot take its arguments; expected"
                " __init__(self, params, footprint)",
                f"make_plan(self, spec, costs) cannot take its arguments; expected {PLAN}",
            ],
        ),
        (
            "a global planner",
            {"base_global_planner": "my_package.misfits.Inherits"},
            [f"it has no method make_plan; expected {PLAN}"],
        ),
        (
            "a local planner",
            {"base_local_planner": "my_package.misfits.Control"},
            [
                "it has no method set_footprint; expected set_footprint(self, footprint)",
                f"{CONTROL}) cannot take its arguments; expected {CONTROL}, local_from_plan)",
                "it has no method is_goal_reached; expected is_goal_reached(self)",
                "it has no method cost_cloud; expected cost_cloud(self)",
            ],
        ),
        (
            "a costmap layer",
            {"local_costmap": {"plugins": [{"name": "x", "type": "my_package.misfits.Plain"}]}},
            ["it is not derived from Layer; expected class Plain(quad_nav.costmap.layer.Layer)"],
        ),
        (
            "a costmap layer",
            {"local_costmap": {"plugins": [{"name": "x", "type": "my_package.misfits.Mine"}]}},
            [
                "__init__(self, params) cannot take its arguments; expected __init__(self, params,"
                " spec, rolling_window, default_cost)",
                "update_bounds(self, robot, bounds) cannot take its arguments; expected"
                " update_bounds(self, robot, now_s, bounds)",
            ],
        ),
        (
            "a recovery behaviour",
            {"recovery_behaviors": [{"name": "x", "type": "my_package.misfits.Recover"}]},
            [
                "it has no period_s; expected a class attribute or a property of that name",
                "it has no method start; expected start(self, context)",
            ],
        ),
    ],
    ids=["plan", "inherited", "control", "plain", "layer", "recovery"],
)
def test_a_class_that_lacks_something(package, kind, tree, lacks):
    imports = "from quad_nav.costmap.layer import Layer\n"
    imports += "from quad_nav.plan.planner import GlobalPlanner\n"
    package("misfits.py", imports + MISFITS)
    told = problems(tree)
    assert [line.partition(f" is not {kind}: ")[2] for line in told] == lacks
    assert all(re.match(r"/nav/\S+: my_package\.misfits\.\w+ is not ", line) for line in told)
    # Any signature that can take the arguments will do.
    assert config.load({"base_global_planner": "my_package.misfits.Anything"})
