"""Missions from a seed: room for everybody, and the same mission again."""

from __future__ import annotations

import itertools

import pytest

from quad_nav.errors import InputError
from quad_nav.mission.robot_goals import goal_paths, last_goal_conflicts, load_robot_goals
from quad_nav.scenario.goal_checks import scene_check
from quad_nav.scenario.random_mission import default_size_m, random_mission
from quad_nav.sim.scene import BODY_RADIUS_M
from quad_nav.sim.scene_file import load_scene


def test_the_files_are_read_back_as_the_mission_and_can_be_flown(tmp_path):
    mission = random_mission(16, seed=3)
    mission.write(tmp_path / "scene.yaml", tmp_path / "goals")
    scene = load_scene(tmp_path / "scene.yaml")
    assert scene == mission.scene
    paths, missing = goal_paths(tmp_path / "goals", 16)
    robots, faults = load_robot_goals(
        paths, dict.fromkeys(paths, scene_check(scene, BODY_RADIUS_M))
    )
    assert missing == faults == last_goal_conflicts(robots, BODY_RADIUS_M) == []
    assert [
        tuple((goal.x_m, goal.y_m) for goal in robot.sequence.goals) for robot in robots
    ] == list(mission.goals)


def test_starts_are_apart_and_obstacles_leave_passages():
    scene = random_mission(16, seed=3).scene
    assert len(scene.starts) == 16 and scene.size_x_m == default_size_m(16) == 24.0
    for a, b in itertools.combinations(scene.starts, 2):
        assert a.distance_to(b) >= 1.5
    for start in scene.starts:
        assert scene.flight_surface_distance_m(start.x_m, start.y_m) >= BODY_RADIUS_M + 0.4
    for a, b in itertools.combinations(scene.obstacles, 2):
        assert b.surface_distance_m(a.x_m, a.y_m, 1.0) >= 1.6


def test_equal_seeds_give_equal_missions_and_others_do_not():
    assert random_mission(4, seed=1) == random_mission(4, seed=1)
    assert random_mission(4, seed=1) != random_mission(4, seed=2)


def test_too_many_in_too_small_an_arena():
    with pytest.raises(InputError, match="no room for start .* in an arena of 12 m"):
        random_mission(100, seed=1, size_m=12.0)
