"""The little mission that compiles the kernels."""

from __future__ import annotations

import pytest

from quad_nav.config import load
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.voxel import VoxelLayer
from quad_nav.plan.global_planner import SearchPlanner
from quad_nav.scenario import warm_up
from quad_nav.scenario.assembly import GLOBAL_PLANNERS, LOCAL_PLANNERS
from quad_nav.sim import casters


@pytest.fixture
def missions(monkeypatch):
    """(navigator, its ticks) of each mission that ``main`` flies."""
    flown = []
    build = warm_up.build_navigator

    def recording(configuration):
        navigator, ticks = build(configuration), []
        tick = navigator.tick
        navigator.tick = lambda *arguments: ticks.append(tick(*arguments)) or ticks[-1]
        flown.append((navigator, ticks))
        return navigator

    monkeypatch.setattr(warm_up, "build_navigator", recording)
    warm_up.main()
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


def test_the_simulator_scans_once(monkeypatch):
    seen = []
    monkeypatch.setattr(casters, "cast_scans", lambda *arguments: seen.append(arguments))
    warm_up.simulate()
    assert len(seen) == 1
