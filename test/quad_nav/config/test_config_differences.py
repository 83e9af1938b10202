"""Differences from move_base's defaults, and their rows in the report."""

from __future__ import annotations

import pytest
import yaml

from quad_nav import config
from quad_nav.config.differences import (
    Difference,
    ParameterRow,
    difference_list,
    differences,
    parameter_rows,
)
from quad_nav.files.shipped import shipped


def tree_of(number: int, **changes):
    tree = config.load_files(shipped("config", "tutorial"), {"i": str(number)})
    return config.load({**tree, **changes}).to_tree()


@pytest.mark.parametrize(
    "text, expected",
    [
        ("{}", []),
        ("controller_patience: 15.0", []),  # the default in force at the start
        ("controller_frequency: 10.0", ["controller_frequency", 10.0, 20.0, "Hz"]),
        (
            "TrajectoryPlannerROS: {max_vel_x: 0.3}",
            ["TrajectoryPlannerROS/max_vel_x", 0.3, 0.55, "m/s"],
        ),
        (
            "TrajectoryPlannerROS: {holonomic_robot: false}",
            ["TrajectoryPlannerROS/holonomic_robot", False, True],
        ),
        (
            "local_costmap: {inflation_radius: 0.8}",
            ["local_costmap/inflation_layer/inflation_radius", 0.8, 0.55, "metres"],
        ),
        (
            "{recovery_behaviors: [{name: r, type: RotateRecovery}], r: {sim_granularity: 1}}",
            ["r/sim_granularity", 1.0, 0.017, "radians"],
        ),
    ],
)
def test_each_namespace(text, expected):
    found = differences(config.load(yaml.safe_load(text)).to_tree())
    assert found == ((Difference(*expected),) if expected else ())


def test_every_difference_of_the_tutorial_is_found():
    found = {one.path: (one.value, one.default) for one in differences(tree_of(0))}
    assert found["controller_frequency"] == (1.0, 20.0)
    assert found["global_costmap/obstacle_layer/base_scan/topic"] == ("scan0", "")
    assert found["local_costmap/obstacle_layer/base_scan/expected_update_rate"] == (21.0, 0.0)
    assert "TrajectoryPlannerROS/sim_time" not in found


def test_costmaps_and_robots_share_rows():
    rows = parameter_rows({f"quad{k}": tree_of(k) for k in range(2)})
    assert ParameterRow("*_costmap/robot_base_frame", "base_link{i}", "base_link", "") in rows
    assert ParameterRow("*_costmap/robot_radius", "0.35", "0.46", "metres") in rows
    assert ParameterRow("global_costmap/width", "12", "10", "metres") in rows
    assert not any(row.robots for row in rows)
    assert len(rows) == len(set(row.path for row in rows))


def test_rows_of_one_robot_name_it():
    rows = parameter_rows({"quad0": tree_of(0), "quad1": tree_of(1, controller_frequency=5.0)})
    assert [(row.value, row.robots) for row in rows if row.path == "controller_frequency"] == [
        ("1", "quad0"),
        ("5", "quad1"),
    ]
    assert parameter_rows({"quad0": {}}) == ()  # unknown parameters


def test_differences_as_json_have_exact_values_and_robots():
    trees = {"quad0": tree_of(0), "quad1": tree_of(1, controller_frequency=1 / 3)}
    found = {(one["parameter"], one["value"]): one for one in difference_list(trees)}
    assert found["controller_frequency", 1 / 3] == {
        "parameter": "controller_frequency",
        "value": 1 / 3,
        "default": 20.0,
        "unit": "Hz",
        "robots": ["quad1"],
    }
    frames = found["local_costmap/robot_base_frame", "base_link{i}"]
    assert frames["robots"] is None  # all
