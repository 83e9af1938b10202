"""Content of the topics, before it becomes messages."""

from __future__ import annotations

import json
import math

import pytest

from quad_nav.costmap.cost_grid import NO_CELLS, Window
from quad_nav.costmap.layered import CostmapParams, LayeredCostmap
from quad_nav.files.shipped import shipped
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.mission.sequencer import Sequencer
from quad_nav.sim.obstacles import Box, Cylinder, Sphere
from quad_nav.sim.scene import BODY_RADIUS_M, Scene, Walls
from quad_nav.sim.scene_file import load_scene, scene_from_document
from quad_nav.sim.scene_writer import scene_document
from quad_nav.topics.goal_routing import GoalRouter, Route, selection_markers
from quad_nav.topics.markers import (
    ARROW,
    CUBE,
    CUBE_LIST,
    CYLINDER,
    SPHERE,
    goal_markers,
    number_markers,
    quadcopter_markers,
    scene_markers,
)
from quad_nav.topics.publishing import CostmapSchedule, FlownPath

SCENE = Scene(
    "yard",
    10.0,
    8.0,
    1.25,
    Walls(1.5, 0.2),
    (
        Box("crate", 4.0, 2.0, 0.5, 0.7, 0.9, 0.4, 0.125),
        Cylinder("pole", 3.0, 3.0, 0.25, 2.0),
        Sphere("ball", 1.0, -1.0, 0.75, 0.5),
    ),
    (Pose2D(-3.0, -2.0, 0.5),),
    -5.0,
    -4.0,
)


# Scenes.


@pytest.mark.parametrize(
    "scene", [SCENE, load_scene(shipped("scenes", "arena.yaml"))], ids=lambda scene: scene.name
)
def test_a_scene_s_document_makes_the_same_scene(scene):
    document = json.loads(json.dumps(scene_document(scene)))
    assert scene_from_document(document, "it") == scene


def test_solids_are_markers_of_their_shape_and_size():
    walls, solids = scene_markers(SCENE)[:4], scene_markers(SCENE)[4:]
    assert {marker.namespace for marker in walls} == {"walls"}
    crate, pole, ball = solids
    assert (crate.kind, crate.size_m, crate.yaw_rad) == (CUBE, (0.5, 0.7, 0.9), 0.4)
    assert crate.place_m == pytest.approx((4.0, 2.0, 0.125 + 0.45))
    assert (pole.kind, pole.place_m, pole.size_m) == (CYLINDER, (3.0, 3.0, 1.0), (0.5, 0.5, 2.0))
    assert (ball.kind, ball.place_m, ball.size_m) == (SPHERE, (1.0, -1.0, 0.75), (1.0, 1.0, 1.0))


def test_thousands_of_boxes_are_one_list():
    quarter = math.pi / 2
    boxes = [Box(f"b{k}", float(k), 5.0, 0.1, 0.1, 2.0, quarter) for k in range(1000)]
    shown = scene_markers(Scene("map", 9.0, 9.0, 1.0, Walls(), tuple(boxes), ()))
    assert [marker.kind for marker in shown] == [CUBE] * 4 + [CUBE_LIST]
    # In axes turned by a quarter to the left, what lies at (x, y) has coordinates (y, -x).
    assert shown[-1].points_m[3] == pytest.approx((5.0, -3.0, 1.0))


def test_quadcopters_move_with_their_frames_and_their_numbers_grow_with_the_arena():
    small, large = (
        number_markers(2, Scene("it", side_m, side_m, 1.0, Walls(), (), ()))
        for side_m in (12.0, 40.0)
    )
    parts = [*quadcopter_markers(2), *small]
    assert {(part.frame, part.frame_locked) for part in parts} == {
        ("base_link0", True),
        ("base_link1", True),
    }
    assert len({(part.namespace, part.number) for part in parts}) == len(parts)
    assert [one.text for one in small] == ["0", "1"]
    assert [one.size_m[2] for one in (small[0], large[0])] == pytest.approx([0.4, 1.0])
    assert small[0].place_m[1] >= BODY_RADIUS_M + 0.5 * small[0].size_m[2]


def test_the_active_goal_is_large_the_reached_one_dim_and_a_yaw_has_an_arrow():
    sequencer = Sequencer(GoalSequence((Goal(1.0, 0.0), Goal(2.0, 0.0, -0.5), Goal(3.0, 0.0))))
    sequencer.tick(0.0, Pose2D(0.0, 0.0))
    sequencer.tick(1.0, Pose2D(1.0, 0.0))  # the first is reached, the second sent
    markers = goal_markers([sequencer], 1.5)
    spheres = [m for m in markers if m.kind == SPHERE]
    assert [m.size_m[0] for m in spheres] == [0.30, 0.45, 0.30]
    assert [m.rgba[3] for m in spheres] == [0.2, 1.0, 0.75]
    (arrow,) = [m for m in markers if m.kind == ARROW]
    assert (arrow.namespace, arrow.number, arrow.yaw_rad) == ("goal0_yaw", 1, -0.5)
    assert arrow.place_m == (2.0, 0.0, 1.5) and arrow.size_m[0] > 0.45


# Paths and costmaps.


def test_a_path_has_poses_5_cm_apart_and_is_published_twice_a_second():
    path = FlownPath(lambda stamp_s, pose: pose.x_m)
    published = [k for k in range(41) if path.add(k / 40, Pose3D(k * 0.0126, 0.0, 1.0))]
    assert list(path.poses) == pytest.approx([0.0504 * k for k in range(11)])
    assert published == [0, 20, 40]


def test_a_path_that_does_not_grow_is_not_published_until_it_is_cleared():
    path, here = FlownPath(lambda stamp_s, pose: stamp_s), Pose3D(0.0, 0.0, 1.0)
    assert [path.add(stamp_s, here) for stamp_s in (7.0, 8.0, 9.0)] == [True, False, False]
    path.clear()
    assert path.add(1.0, here) and list(path.poses) == [1.0]


def costmap(**params):
    return LayeredCostmap(
        CostmapParams(width_m=2.0, height_m=1.0, resolution_m=0.1, layers=(), **params)
    )


def test_windows_add_up_between_two_publications():
    schedule = CostmapSchedule(costmap(publish_frequency_hz=1.0))
    assert not schedule.add(0.4, Window(0, 2, 0, 2))
    assert not schedule.add(0.8, NO_CELLS)
    assert schedule.add(1.2, Window(4, 5, 1, 3))  # late, which does not delay the next one
    assert schedule.pop() == Window(0, 5, 0, 3)
    assert schedule.pop() == NO_CELLS
    assert not schedule.add(1.9, NO_CELLS)
    assert schedule.add(2.0, NO_CELLS)
    assert not CostmapSchedule(costmap(publish_frequency_hz=0.0)).add(9.0, Window(0, 2, 0, 2))


def test_as_upstream_more_than_a_period_lies_between_two_publications():
    """2 Hz of updates at 4 Hz come every 0.75 s; without an update the last window comes again."""
    schedule = CostmapSchedule(costmap(publish_frequency_hz=2.0, publish_on_time=False))
    assert not schedule.add(0.75, None)  # before the first update
    times = [1.0 + 0.25 * k for k in range(8)]
    assert [now_s for now_s in times if schedule.add(now_s, Window(0, 2, 0, 2))] == [1, 1.75, 2.5]
    schedule.pop()
    assert schedule.add(3.25, None) and schedule.pop() == Window(0, 2, 0, 2)


def test_publishing_is_due_one_period_after_a_clock_jump():
    schedule = CostmapSchedule(costmap(publish_frequency_hz=1.0))
    assert schedule.add(100.0, NO_CELLS)
    schedule.restart(50.5)
    assert not schedule.add(51.0, NO_CELLS)
    assert schedule.add(51.5, NO_CELLS)


def test_a_grid_that_moved_is_published_in_full_and_others_if_that_is_wanted():
    moving = costmap(publish_frequency_hz=1.0, rolling_window=True)
    schedule = CostmapSchedule(moving)
    assert [schedule.pop_full_grid(), schedule.pop_full_grid()] == [True, False]
    moving.update(1.0, Pose2D(3.0, 3.0))
    assert [schedule.pop_full_grid(), schedule.pop_full_grid()] == [True, False]
    schedule = CostmapSchedule(costmap(publish_frequency_hz=1.0, always_send_full_costmap=True))
    assert [schedule.pop_full_grid(), schedule.pop_full_grid()] == [True, True]


# Goals of the fleet.


def test_a_goal_goes_to_the_selected_quadcopter_else_to_the_nearest():
    router, places = GoalRouter(), {0: (0.0, 0.0), 1: (4.0, 0.0)}
    assert router.route(3.0, 0.0, places) == Route(1, "nearest, 1.00 m from it")
    assert router.route(2.0, 1.0, places).robot == 0  # as near: the lower number
    assert router.route(2.0, 1.0, {}) is None
    assert "quad1 selected" in router.click(4.0, 0.9, places)
    assert router.route(0.0, 0.0, places) == Route(1, "selected")
    assert router.route(0.0, 0.0, {0: (0.0, 0.0)}).robot == 1  # also while its place is unknown
    assert [one.frame for one in selection_markers(router.selected)] == ["base_link1"]
    assert "quad1 deselected" in router.click(4.0, 0.0, places)
    assert router.route(0.0, 0.0, places).robot == 0
    assert selection_markers(router.selected) == []
    router.click(0.0, 0.0, places)
    assert "no quadcopter within 1 m" in router.click(1.1, 0.0, places)
    assert router.selected is None


def test_a_pose_goes_to_the_selected_quadcopter_else_to_who_does_not_know_its_place():
    router, places = GoalRouter(), {0: (0.0, 0.0), 2: (4.0, 0.0)}
    assert router.route_pose(0.0, 0.0, places, 3) == Route(1, "the only one without a place")
    assert router.route_pose(0.0, 0.0, places, 4) is None  # 1 or 3
    assert router.route_pose(3.0, 0.0, {**places, 1: (9.0, 9.0)}, 3).robot == 2
    router.click(4.0, 0.0, places)
    assert router.route_pose(0.0, 0.0, places, 4) == Route(2, "selected")
