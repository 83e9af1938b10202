"""The little mission that compiles the kernels."""

from __future__ import annotations

import ast
import importlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Dict, Set

import pytest
from numba.core.dispatcher import Dispatcher

from quad_nav.config import load
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.voxel import VoxelLayer
from quad_nav.kernels import jit
from quad_nav.kernels.numba_cache import compiled_overloads
from quad_nav.plan.global_planner import SearchPlanner
from quad_nav.scenario import warm_up
from quad_nav.scenario.assembly import GLOBAL_PLANNERS, LOCAL_PLANNERS
from quad_nav.sim import casters


@pytest.fixture
def missions(monkeypatch):
    """(navigator, its ticks) of each mission that ``fly_missions`` flies."""
    flown = []
    build = warm_up.build_navigator

    def recording(configuration):
        navigator, ticks = build(configuration), []
        tick = navigator.tick
        navigator.tick = lambda *arguments: ticks.append(tick(*arguments)) or ticks[-1]
        flown.append((navigator, ticks))
        return navigator

    monkeypatch.setattr(warm_up, "build_navigator", recording)
    warm_up.fly_missions()
    return flown


def test_every_kernel_of_a_cycle_has_run(missions):
    """Each mission goes through scans, costmaps, a plan and a control cycle."""
    for _, ticks in missions:
        assert any(tick.plan is not None for tick in ticks)
        assert any(tick.control is not None for tick in ticks)
        assert set(ticks[0].windows) == {"global", "local"}
        assert not ticks[0].windows["local"].is_empty


def test_a_peers_points_are_removed_from_the_last_scans(missions):
    for navigator, _ in missions:
        layers = [
            layer
            for layer in navigator.local_costmap.layers.values()
            if isinstance(layer, ObstacleLayer)
        ]
        assert layers and all(len(layer.excluded_circles) == 1 for layer in layers)


def test_each_mission_makes_room_for_a_peer(missions):
    for _, ticks in missions:
        assert ticks[-1].yielding is not None and ticks[-1].yielding.holding_point is not None


def test_every_planner_and_obstacle_layer_flies(missions):
    navigators = [navigator for navigator, _ in missions]
    assert {type(navigator.planner.params) for navigator in navigators} == set(GLOBAL_PLANNERS)
    assert {type(navigator.controller.params) for navigator in navigators} == set(LOCAL_PLANNERS)
    layers = {type(navigator.local_costmap.layers["obstacle_layer"]) for navigator in navigators}
    assert layers == {ObstacleLayer, VoxelLayer}


def test_both_searches_and_both_paths_of_the_global_planner(missions):
    params = [
        navigator.planner.params
        for navigator, _ in missions
        if isinstance(navigator.planner, SearchPlanner)
    ]
    assert {one.use_dijkstra for one in params} == {True, False}
    assert {one.use_grid_path for one in params} == {True, False}


def test_any_configuration_can_be_warmed_up():
    warm_up.warm_up(load({"global_costmap": {"static_map": True}}))


def test_every_kernel_that_python_calls_is_compiled():
    """A kernel that is compiled in flight, or for which numba is imported, stops the robot."""
    if jit._IS_DISABLED:
        pytest.skip("nothing is compiled")
    warm_up.fly_missions()
    assert {name for name, kernel in kernels_called_in_python().items() if is_cold(kernel)} == set()


def is_cold(kernel: object) -> bool:
    """True for a kernel that neither the library holds nor numba has compiled."""
    if isinstance(kernel, jit._LazyKernel):
        kernel = vars(kernel).get("_kernel")  # made at the first call
    return kernel is None or (isinstance(kernel, Dispatcher) and not compiled_overloads(kernel))


def kernels_called_in_python() -> Dict[str, object]:
    """The kernels that modules outside of ``kernels/`` call."""
    package = Path(jit.__file__).parents[1]
    kernels = {}
    for path in (package / "kernels").glob("*.py"):
        module = importlib.import_module(f"quad_nav.kernels.{path.stem}")
        for name, value in vars(module).items():
            if getattr(getattr(value, "py_func", None), "__module__", "") == module.__name__:
                kernels[path.stem, name] = value
    found = {}
    for path in package.rglob("*.py"):
        if path.parent.name != "kernels":
            names = called_names(path)
            found.update(
                {
                    f"{stem}.{name}": kernel
                    for (stem, name), kernel in kernels.items()
                    if (stem, name) in names
                }
            )
    return found


def called_names(path: Path) -> Set[object]:
    """(module of ``kernels``, name) of everything that a module may call there."""
    tree = ast.parse(path.read_text())
    modules, names = {}, set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == "quad_nav.kernels":
            modules.update({one.asname or one.name: one.name for one in node.names})
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith(
            "quad_nav.kernels."
        ):
            names.update((str(node.module).rsplit(".", 1)[1], one.name) for one in node.names)
            modules.update({one.asname or one.name: one.name for one in node.names})
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            names.add((modules.get(node.value.id), node.attr))
    return names


def test_lidars_scan_in_each_scene(monkeypatch):
    seen = []
    monkeypatch.setattr(casters, "cast_scans", lambda *arguments: seen.append(arguments))
    warm_up.simulate()
    assert len(seen) == 4


TYPES_OF_A_FLIGHT = """
from dataclasses import replace

from quad_nav.kernels import jit
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.scenario.warm_up import fly_missions


def compiled():
    kernels = jit.numba_kernels()
    return {(kernel.__name__, types) for kernel in kernels for types in kernel.overloads}


fly_missions()
warm = compiled()
for config in ("default", "tutorial"):
    setup = read_setup(FlightOptions(None, None, config, robots=3))
    fly(replace(setup, time_limit_s=5.0))
assert warm
print(sorted(map(str, compiled() - warm)))
"""


def test_a_flight_calls_no_kernel_with_types_that_the_warm_up_does_not():
    """A type that is missing in the library of kernels makes each node load numba."""
    run = subprocess.run(
        [sys.executable, "-c", TYPES_OF_A_FLIGHT],
        env={**os.environ, "QUAD_KERNELS": "numba", "PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    )
    assert run.stdout.strip() == "[]"
