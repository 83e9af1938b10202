"""Scenes: distances computed by hand, the shipped arena, and messages on faulty files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.sim.obstacles import Box, Cylinder, Sphere
from quad_nav.sim.scene import BODY_RADIUS_M, Scene, Walls
from quad_nav.sim.scene_file import load_scene, scene_from_document
from quad_nav.sim.scene_writer import write_scene

ARENA = Path(__file__).parents[3] / "scenes" / "arena.yaml"
GOALS = [(3.0, 6.5), (9.0, 5.5), (1.5, 9.0), (4.0, 3.5), (2.0, 9.0), (8.5, 5.0)]


def faults_of(document) -> list:
    with pytest.raises(InputError) as caught:
        scene_from_document(document, "s.yaml")
    return caught.value.problems


def small_document(**changes):
    return {"size": [4.0, 6.0], "starts": [[1.0, 1.0, 0.5]], **changes}


def pillar(name, x_m):
    return {"name": name, "shape": "cylinder", "centre": [x_m, 3.0], "radius": 0.5, "height": 2.0}


def test_distance_to_a_box_from_face_edge_corner_top_and_inside():
    box = Box("b", 2.0, 1.0, 2.0, 1.0, 1.0)
    assert box.surface_distance_m(4.0, 1.0, 0.5) == pytest.approx(1.0)
    assert box.surface_distance_m(6.0, 5.5, 0.5) == pytest.approx(5.0)
    assert box.surface_distance_m(2.0, 1.0, 1.25) == pytest.approx(0.25)
    assert box.surface_distance_m(5.0, 2.5, 3.0) == pytest.approx(3.0)
    assert box.surface_distance_m(2.0, 1.4, 0.5) == pytest.approx(-0.1)
    turned = Box("b", 0.0, 0.0, 2.0, 2.0, 2.0, yaw_rad=math.pi / 4)
    assert turned.surface_distance_m(2.0, 2.0, 1.0) == pytest.approx(2.0 * math.sqrt(2.0) - 1.0)


def test_distance_to_a_lifted_cylinder_from_beside_above_and_below():
    cylinder = Cylinder("c", 1.0, 1.0, 0.5, 1.0, bottom_m=2.0)
    assert cylinder.surface_distance_m(4.0, 5.0, 2.5) == pytest.approx(4.5)
    assert cylinder.surface_distance_m(1.0, 1.0, 3.2) == pytest.approx(0.2)
    assert cylinder.surface_distance_m(1.0, 1.0, 1.0) == pytest.approx(1.0)
    assert cylinder.surface_distance_m(1.1, 1.0, 2.5) == pytest.approx(-0.4)


def test_distance_to_a_sphere():
    sphere = Sphere("s", 1.0, 1.0, 2.0, 0.5)
    assert sphere.surface_distance_m(1.0, 4.0, 6.0) == pytest.approx(4.5)
    assert sphere.surface_distance_m(1.0, 1.2, 2.0) == pytest.approx(-0.3)
    assert (sphere.bottom_m, sphere.height_m) == (1.5, 1.0)


def test_the_nearest_of_many_solids_has_the_smallest_distance():
    random = np.random.default_rng(0)
    boxes = [
        Box(
            f"b{k}",
            *random.uniform(0.0, 10.0, 2),
            *random.uniform(0.1, 2.0, 3),
            random.uniform(-4.0, 4.0),
            random.uniform(0.0, 1.0),
        )
        for k in range(50)
    ]
    round_ = (Sphere("ball", 5.0, 5.0, 1.0, 0.5), Cylinder("pillar", 2.0, 8.0, 0.3, 2.0))
    scene = Scene("s", 10.0, 10.0, 1.0, Walls(), (*boxes, *round_), ())
    solids = [*scene.wall_boxes(), *scene.obstacles]
    for x, y, z in random.uniform(0.0, 10.0, (200, 3)):
        nearest = scene.nearest(x, y, z)
        assert nearest.surface_distance_m(x, y, z) == min(
            s.surface_distance_m(x, y, z) for s in solids
        )
        assert scene.surface_distance_m(x, y, z) == nearest.surface_distance_m(x, y, z)


def test_distances_of_many_points_equal_those_of_each():
    random = np.random.default_rng(2)
    boxes = tuple(Box(f"b{k}", *random.uniform(0.0, 40.0, 2), 0.5, 0.8, 2.0) for k in range(300))
    scene = Scene("s", 40.0, 40.0, 1.0, Walls(), (*boxes, Sphere("ball", 9.0, 9.0, 1.0, 0.5)), ())
    for centre in random.uniform(1.0, 39.0, (20, 2)):
        points = centre + random.uniform(-1.0, 1.0, (3, 4, 2))
        expected = [[scene.flight_surface_distance_m(x, y) for x, y in row] for row in points]
        assert scene.flight_surface_distances_m(points).tolist() == expected


def test_a_written_scene_reads_the_same(tmp_path):
    solids = (
        Box("b", 1.0, 1.0, 0.5, 0.8, 2.0, 0.3, 0.5),
        Cylinder("c", 0.5, -1.0, 0.3, 2.0),
        Sphere("s", -3.0, 1.0, 0.25, 0.5),
    )
    starts = (Pose2D(-1.0, 0.0, 0.5),)
    scene = Scene("hall", 8.0, 6.0, 1.2, Walls(2.5, 0.2), solids, starts, -4.0, -3.0)
    path = tmp_path / "s.yaml"
    write_scene(scene, path)
    assert load_scene(path) == scene


def test_an_arena_may_lie_anywhere():
    scene = scene_from_document(small_document(origin=[-3.0, 10.0], starts=[[-1.0, 12.0]]), "s")
    assert scene.contains(-2.9, 15.9) and not scene.contains(0.5, 0.5)
    assert scene.centre == (-1.0, 13.0)
    assert scene.surface_distance_m(-2.5, 13.0, 1.0) == pytest.approx(0.5)
    assert scene.surface_distance_m(0.75, 13.0, 1.0) == pytest.approx(0.25)
    assert scene.surface_distance_m(-1.0, 10.1, 1.0) == pytest.approx(0.1)
    assert scene.surface_distance_m(-1.0, 15.8, 1.0) == pytest.approx(0.2)


def test_walls_have_their_inner_faces_on_the_border():
    scene = Scene("s", 4.0, 6.0, 1.0, Walls(2.0, 0.1), (), (Pose2D(1.0, 1.0),))
    assert scene.surface_distance_m(0.5, 3.0, 1.0) == pytest.approx(0.5)
    assert scene.surface_distance_m(3.75, 3.0, 1.0) == pytest.approx(0.25)
    assert scene.surface_distance_m(2.0, 5.9, 1.0) == pytest.approx(0.1)
    assert scene.surface_distance_m(-0.05, 3.0, 1.0) == pytest.approx(-0.05)
    assert scene.nearest(2.0, 0.3, 1.0).name == "wall_south"
    assert scene.contains(3.9, 5.9) and not scene.contains(4.0, 3.0)


def test_arena_leaves_the_tutorial_goals_free():
    scene = load_scene(ARENA)
    assert (scene.size_x_m, scene.size_y_m, scene.altitude_m) == (12.0, 12.0, 1.0)
    assert len(scene.obstacles) == 8
    assert scene.starts[0] == Pose2D(1.5, 1.5, 0.0)
    assert scene.starts[1] == Pose2D(10.0, 2.0, math.pi)
    for x, y in GOALS:
        assert scene.surface_distance_m(x, y, 1.0) > 0.8
    for start in scene.starts:
        assert scene.surface_distance_m(start.x_m, start.y_m, 1.0) > 0.8


def test_arena_passages_let_an_inflated_quadcopter_through():
    scene = load_scene(ARENA)
    standing = [solid for solid in scene.obstacles if solid.top_m > scene.altitude_m]
    x, y = np.meshgrid(*2 * [0.025 + 0.05 * np.arange(240)])
    walls = [wall.surface_distance_m(x, y, 1.0) for wall in scene.wall_boxes()]
    solids = [solid.surface_distance_m(x, y, 1.0) for solid in standing]
    first, second = np.sort([np.min(walls, axis=0), *solids], axis=0)[:2]
    assert (first + second)[first > 0.0].min() > 1.2


def test_all_faults_are_listed_at_once():
    box = {"shape": "box", "centre": [1.0, float("nan")], "size": [1.0, -1.0], "height": 2.0}
    pillar = {"shape": "cylinder", "centre": [2.0, 3.0], "radius": True}
    obstacles = [box, {"shape": "cone"}, {**pillar, "height": "high", "bottom": -1.0}]
    starts = [[9.0, 1.0], [1.0]]
    problems = faults_of(small_document(altitud=1.0, obstacles=obstacles, starts=starts))
    assert problems == [
        "s.yaml: altitud: unknown key; did you mean altitude?",
        "s.yaml: obstacles[0].centre[1]: nan, expected a finite number",
        "s.yaml: obstacles[0].size[1]: -1.0, expected a number above 0",
        "s.yaml: obstacles[1].shape: 'cone', expected box, cylinder or sphere",
        "s.yaml: obstacles[2].radius: True, expected a number above 0",
        "s.yaml: obstacles[2].height: 'high', expected a number above 0",
        "s.yaml: obstacles[2].bottom: -1 m is below the floor, expected 0 or more",
        "s.yaml: starts[1]: a list of 1, expected [x, y] or [x, y, yaw]",
        "s.yaml: starts[0]: (9, 1) is outside the arena, expected 0 < x < 4 and 0 < y < 6",
    ]


def test_start_outside_inside_an_obstacle_and_too_close_to_another():
    starts = [[1.0, 1.0], [4.5, 1.0], [2.2, 3.0], [1.4, 1.0]]
    problems = faults_of(small_document(obstacles=[pillar("pillar", 2.0)], starts=starts))
    assert problems == [
        "s.yaml: starts[1]: (4.5, 1) is outside the arena, expected 0 < x < 4 and 0 < y < 6",
        (
            "s.yaml: starts[2]: (2.2, 3) is -0.30 m from pillar, expected more than a quadcopter's "
            f"radius, {BODY_RADIUS_M:g} m"
        ),
        "s.yaml: starts[3]: is 0.40 m from starts[0], expected more than two body radii, 0.6 m",
    ]


@pytest.mark.parametrize(
    "document, problem",
    [
        (
            None,
            "missing, expected a mapping with name, size, origin, altitude, walls, obstacles, "
            "starts, world, map, unknown, motion_phase, walkers",
        ),
        ({"size": [4.0, 4.0]}, "starts: missing, expected a list"),
        (small_document(starts=[]), "starts: no start pose, expected at least one [x, y, yaw]"),
        (small_document(size=[4.0, math.inf]), "size[1]: inf, expected a number above 0"),
        (small_document(walls={"height": 0}), "walls.height: 0, expected a number above 0"),
        (
            small_document(obstacles=[3]),
            "obstacles[0]: 3, expected a mapping that describes an obstacle",
        ),
        (
            small_document(obstacles=[pillar("floor", 3.0)]),
            "obstacles: name 'floor' is taken, expected unique names",
        ),
    ],
)
def test_single_faults(document, problem):
    assert faults_of(document) == [f"s.yaml: {problem}"]
