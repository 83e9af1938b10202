"""Faults: each has its place and what was expected; all are reported at once."""

from __future__ import annotations

import pytest

from quad_nav.config import load
from quad_nav.errors import InputError


def problems(tree):
    with pytest.raises(InputError) as caught:
        load(tree, "/move_base0")
    return caught.value.problems


@pytest.mark.parametrize(
    "tree, complaint",
    [
        (
            {"local_costmap": {"width": "three"}},
            "local_costmap/width: 'three' is not a number; expected a positive number of metres",
        ),
        (
            {"local_costmap": {"resolution": 0}},
            "local_costmap/resolution: 0 is out of range; expected a positive number of metres",
        ),
        (
            {"local_costmap": {"robot_radius": -0.1}},
            "local_costmap/robot_radius: -0.1 is out of range; expected a number of metres, 0"
            " or more",
        ),
        (
            {"global_costmap": {"update_frequency": float("nan")}},
            "global_costmap/update_frequency: nan is not finite; expected a number of Hz, 0 or"
            " more",
        ),
        (
            {"global_costmap": {"origin_x": float("inf")}},
            "global_costmap/origin_x: inf is not finite; expected a number of metres",
        ),
        (
            {"global_costmap": {"inflation_radius": True}},
            "global_costmap/inflation_radius: True is not a number; expected a number of metres, 0"
            " or"
            " more",
        ),
        (
            {"global_costmap": {"inflation_radius": "1e-1"}},
            "global_costmap/inflation_radius: '1e-1' is not a number but a string (write 0.1);"
            " expected a number of metres, 0 or more",
        ),
        (
            {"local_costmap": {"rolling_window": 1}},
            "local_costmap/rolling_window: 1 is not a boolean; expected true or false",
        ),
        (
            {"local_costmap": {"static_map": "yes"}},
            "local_costmap/static_map: 'yes' is not a boolean; expected true or false",
        ),
        (
            {"local_costmap": {"global_frame": 3}},
            "local_costmap/global_frame: 3 is not a string; expected a frame's name",
        ),
        ({"local_costmap": 3}, "local_costmap: 3 is a value; expected a namespace of parameters"),
        (
            {"controller_frequency": 0},
            "controller_frequency: 0 is out of range; expected a positive number of Hz",
        ),
        (
            {"max_planning_retries": "many"},
            "max_planning_retries: 'many' is not a number; expected a whole number",
        ),
        (
            {"TrajectoryPlannerROS": {"pdist_scale": "high"}},
            "TrajectoryPlannerROS/pdist_scale: 'high' is not a number; expected a number, 0 or"
            " more",
        ),
        (
            {
                "base_local_planner": "dwa_local_planner/DWAPlannerROS",
                "latch_xy_goal_tolerance": "yes",
            },
            "latch_xy_goal_tolerance: 'yes' is not a boolean; expected true or false",
        ),
        (
            {"local_costmap": {"obstacle_layer": {"combination_method": 2}}},
            "local_costmap/obstacle_layer/combination_method: 2 is not a valid choice;"
            " expected one of 0 (Overwrite), 1 (Maximum), 99 (Nothing)",
        ),
        (
            {"local_costmap": {"observation_sources": "scan", "scan": {"data_type": "Laser"}}},
            "local_costmap/scan/data_type: 'Laser' is not a type of sensor; expected"
            " LaserScan, PointCloud or PointCloud2",
        ),
        (
            {"local_costmap": {"plugins": [{"name": "obstacles"}]}},
            "local_costmap/plugins: {'name': 'obstacles'} is not a layer; expected {name: ,"
            " type: }",
        ),
        (
            {"local_costmap": {"footprint": [[0, 1], [1, 0]]}},
            "local_costmap/footprint: [[0, 1], [1, 0]]: fewer than three points; expected a list"
            " [[x1,"
            " y1], [x2, y2], [x3, y3], ...] of metres",
        ),
        (
            {"local_costmap": {"footprint": "[[0, 1], [1, 0], [x, 1]]"}},
            "local_costmap/footprint: '[[0, 1], [1, 0], [x, 1]]': 'x' is not a number; expected a"
            " list"
            " [[x1, y1], [x2, y2], [x3, y3], ...] of metres",
        ),
        (
            {"recovery_behaviors": "none"},
            "recovery_behaviors: 'none' is not a list; expected a list of {name: , type: }",
        ),
        (
            {
                "recovery_behaviors": [{"name": "clear", "type": "ClearCostmapRecovery"}],
                "clear": {"layer_names": "obstacle_layer"},
            },
            "clear/layer_names: 'obstacle_layer' is not a list of names; expected names of"
            " layers, as in [obstacle_layer]",
        ),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else "",
)
def test_fault_is_named_with_place_and_expectation(tree, complaint):
    assert problems(tree) == ["/move_base0/" + complaint]


def test_all_faults_are_reported_at_once():
    told = problems(
        {
            "conservative_reset_dist": "far",
            "recovery_behaviors": 1,
            "TrajectoryPlannerROS": {"sim_time": 0},
            "NavfnROS": {"allow_unknown": "no"},
            "global_costmap": {"width": None},
            "local_costmap": {"circumscribed_radius": "wide", "cost_scaling_factor": [1]},
        }
    )
    assert [line.split(":")[0] for line in told] == [
        "/move_base0/conservative_reset_dist",
        "/move_base0/TrajectoryPlannerROS/sim_time",
        "/move_base0/NavfnROS/allow_unknown",
        "/move_base0/global_costmap/width",
        "/move_base0/local_costmap/cost_scaling_factor",  # where it was written, not where it goes
        "/move_base0/local_costmap/circumscribed_radius",
        "/move_base0/recovery_behaviors",
    ]


def test_tree_that_is_not_a_mapping():
    assert problems([1, 2]) == [
        "/move_base0: [1, 2] is not a parameter tree; expected names with values"
    ]


def test_whole_numbers_are_taken_for_doubles_and_the_other_way_round():
    configuration = load({"local_costmap": {"update_frequency": 10, "width": 3.0}}, "")
    assert configuration.local_costmap.update_frequency_hz == 10.0
    assert configuration.local_costmap.width_m == 3.0
    assert isinstance(configuration.to_tree()["local_costmap"]["width"], int)
