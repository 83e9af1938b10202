"""Global plans behind tracked obstacles, in an empty room of 10 m.

The robot flies along y = 5 m from x = 2 m at 0.5 m/s. Its radius is 0.35 m, the obstacle's 0.25 m:
it keeps 0.35 + 0.25 + 0.1 = 0.7 m from where the obstacle is.
"""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.config import load
from quad_nav.geometry import Pose2D
from quad_nav.scenario.assembly import build_navigator
from quad_nav.tracking.tracks import Tracks

TREE = {
    "robot": 0,
    "global_costmap": {"width": 10.0, "height": 10.0, "robot_radius": 0.35, "resolution": 0.1},
    "local_costmap": {"width": 3.0, "height": 3.0, "robot_radius": 0.35, "rolling_window": True},
}
POSE, MAP = Pose2D(2.0, 5.0), Pose2D(0.0, 0.0)


def navigator(is_on: bool):
    return build_navigator(load({**TREE, "peers": {"plan_behind_moving_obstacles": is_on}}))


def crossing(y_m: float, vy_mps: float, x_m: float = 3.5) -> Tracks:
    states = np.array([[x_m, y_m, 0.0, vy_mps]])
    return Tracks(10.0, np.array([1]), states, np.eye(4)[None] * 1e-4, np.array([0.25]))


def costs(robot, tracks, local_from_map=MAP):
    """Return the global costs, uint8[100, 100], after the robot has seen obstacles."""
    robot.peers.observe(10.0, POSE, local_from_map, (), 0.5, tracks)
    robot.global_costmap.update(10.0, POSE)
    return robot.global_costmap.costs


def y_at(plan, x_m: float) -> float:
    return float(plan[np.argmin(np.abs(plan[:, 0] - x_m)), 1])


def test_only_places_ahead_of_an_obstacle_cost_that_the_robot_reaches_in_time():
    """At 0.8 m/s it is at y = 4.2 m after 0.25 s and at 4.4 m after 0.5 s.

    The robot is 1.7 m and 1.62 m from there, so it comes within 0.7 m in 2.0 s and 1.83 s. It
    counts as in time up to 1.5 s after the obstacle: until 1.75 s and 2.0 s. So costs begin 0.7 m
    below 4.4 m.
    """
    found = costs(navigator(True), crossing(4.0, 0.8))[:, 35]
    assert (found[:37] == 0).all()
    assert (found[38:77] == 100).all()  # to 0.7 m beyond 7.0 m, where it is after 3.75 s
    assert (found[79:] == 0).all()


@pytest.mark.parametrize("y_m, vy_mps, side", [(4.0, 0.8, -1), (6.0, -0.8, 1)])
def test_a_plan_passes_behind(y_m, vy_mps, side):
    robot = navigator(True)
    found = costs(robot, crossing(y_m, vy_mps))
    plan = robot.planner.make_plan(robot.global_costmap.spec, found, POSE, Pose2D(8.0, 5.0))
    assert 1.2 < side * (y_at(plan, 3.5) - 5.0) < 1.6


def test_a_plan_ignores_what_has_passed():
    robot = navigator(True)
    found = costs(robot, crossing(6.5, 0.8))
    plan = robot.planner.make_plan(robot.global_costmap.spec, found, POSE, Pose2D(8.0, 5.0))
    assert abs(y_at(plan, 3.5) - 5.0) < 0.1


def test_costs_end_with_the_track():
    robot = navigator(True)
    assert costs(robot, crossing(4.0, 0.8)).any()
    assert not costs(robot, Tracks.none(10.0)).any()


def test_tracks_are_in_the_local_frame():
    in_map, in_local = crossing(4.0, 0.8), crossing(2.0, 0.8, x_m=2.5)
    expected = costs(navigator(True), in_map)
    np.testing.assert_array_equal(costs(navigator(True), in_local, Pose2D(-1.0, -2.0)), expected)


def test_without_the_switch_nothing_costs():
    assert not costs(navigator(False), crossing(4.0, 0.8)).any()
