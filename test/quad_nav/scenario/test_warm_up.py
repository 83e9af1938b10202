"""The little mission that compiles the kernels."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any, Dict, Iterator

import numba
import pytest

from quad_nav.config import load
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.voxel import VoxelLayer
from quad_nav.files import kernel_cache
from quad_nav.plan.global_planner import SearchPlanner
from quad_nav.scenario import warm_up
from quad_nav.scenario.assembly import GLOBAL_PLANNERS, LOCAL_PLANNERS
from quad_nav.sim import casters


@pytest.fixture(scope="module")
def missions():
    """(navigator, its ticks) of each mission that ``fly_missions`` flies."""
    flown = []
    build = warm_up.NavigatorHost

    def recording(configuration):
        host, ticks = build(configuration), []
        tick = host.tick
        host.tick = lambda *arguments: ticks.append(tick(*arguments)) or ticks[-1]
        flown.append((host.navigator, ticks))
        return host

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(warm_up, "NavigatorHost", recording)
        warm_up.fly_missions()
    return flown


def test_every_kernel_of_a_cycle_has_run(missions):
    """Each mission goes through scans, costmaps, a plan and a control cycle."""
    for _, ticks in missions:
        assert any(tick.plan is not None for tick in ticks)
        assert any(tick.control is not None for tick in ticks)
        assert set(ticks[0].windows) == {"global", "local"}
        assert not ticks[0].windows["local"].is_empty


def test_each_mission_makes_room_for_a_peer_and_removes_its_points(missions):
    for navigator, ticks in missions:
        assert ticks[-1].yielding is not None and ticks[-1].yielding.holding_point is not None
        layers = [
            layer
            for layer in navigator.local_costmap.layers.values()
            if isinstance(layer, ObstacleLayer)
        ]
        assert layers and all(len(layer.excluded_circles) == 1 for layer in layers)


def test_every_planner_and_obstacle_layer_flies(missions):
    navigators = [navigator for navigator, _ in missions]
    assert {type(navigator.planner.params) for navigator in navigators} == set(GLOBAL_PLANNERS)
    assert {type(navigator.controller.params) for navigator in navigators} == set(LOCAL_PLANNERS)
    layers = {type(navigator.local_costmap.layers["obstacle_layer"]) for navigator in navigators}
    assert layers == {ObstacleLayer, VoxelLayer}
    planners = [one.planner for one in navigators if isinstance(one.planner, SearchPlanner)]
    assert {one.params.use_dijkstra for one in planners} == {True, False}
    assert {one.params.use_grid_path for one in planners} == {True, False}


def test_any_configuration_can_be_warmed_up():
    warm_up.warm_up(load({"global_costmap": {"static_map": True}}))


def test_every_kernel_that_python_calls_is_compiled(missions):
    """A kernel that is compiled in flight stops the robot."""
    if numba.config.DISABLE_JIT or kernel_cache.FOLDER is None:
        pytest.skip("nothing is compiled, or nothing is kept")
    called = kernels_called_in_python()
    assert len(called) > 50
    assert sorted(name for name, kernel in called.items() if not is_compiled(kernel)) == []


def is_compiled(kernel: Any) -> bool:
    """True for a kernel that is compiled in this process, or cached as a part of another one."""
    source = Path(kernel.py_func.__code__.co_filename)
    folder = kernel_cache.FOLDER / kernel_cache.folder_name(source)
    cached = folder.glob(f"*/{source.stem}.{kernel.__name__}-*.nbi")
    return bool(kernel.signatures) or any(cached)


def kernels_called_in_python() -> Dict[str, Any]:
    """The kernels that code calls which is no kernel, by their names."""
    found = {}
    for name, module in sorted(sys.modules.items()):
        if name.startswith("quad_nav.") and getattr(module, "__file__", None):
            for used in used_outside_kernels(ast.parse(Path(module.__file__).read_text()), module):
                if hasattr(used, "signatures"):
                    found[f"{used.__module__}.{used.__name__}"] = used
    return found


def used_outside_kernels(node: ast.AST, module: ModuleType) -> Iterator[object]:
    """Yield what a module names outside of its kernels."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef):
            if any("njit" in ast.dump(decorator) for decorator in child.decorator_list):
                continue
            for statement in ast.walk(child):  # an import in a function
                if isinstance(statement, ast.ImportFrom) and statement.module in sys.modules:
                    for alias in statement.names:
                        yield getattr(sys.modules[statement.module], alias.name, None)
        elif isinstance(child, ast.Name):
            yield getattr(module, child.id, None)
        elif isinstance(child, ast.Attribute) and isinstance(child.value, ast.Name):
            yield getattr(getattr(module, child.value.id, None), child.attr, None)
        yield from used_outside_kernels(child, module)


def test_lidars_scan_in_each_scene(monkeypatch):
    seen = []
    monkeypatch.setattr(casters, "cast_scans", lambda *arguments: seen.append(arguments))
    warm_up.simulate()
    assert len(seen) == 4


TYPES_OF_A_FLIGHT = """
import sys
from dataclasses import replace

from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.scenario.warm_up import fly_missions


def compiled():
    modules = [module for name, module in sys.modules.items() if name.startswith("quad_nav.")]
    kernels = [one for module in modules for one in vars(module).values()]
    return {
        (kernel.__name__, types)
        for kernel in kernels
        for types in getattr(kernel, "signatures", ())
    }


fly_missions()
warm = compiled()
for config in ("default", "tutorial"):
    setup = read_setup(FlightOptions(None, None, config, robots=3))
    fly(replace(setup, time_limit_s=5.0))
assert warm
print(sorted(map(str, compiled() - warm)))
"""


def test_a_flight_calls_no_kernel_with_types_that_the_warm_up_does_not():
    """A type that is missing is compiled in flight, which stops the robot."""
    run = subprocess.run(
        [sys.executable, "-c", TYPES_OF_A_FLIGHT],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    )
    assert run.stdout.strip() == "[]"
