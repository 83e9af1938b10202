"""Evasion of moving obstacles: predictions, threats, and the commands that are taken."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_nav.control.evasion import evade, predicted_discs, prediction_times
from quad_nav.control.evasion_commands import Body, command_costs
from quad_nav.control.space_time import SpaceTime, fill_costs, haste_per_s, threat
from quad_nav.control.standing_obstacles import (
    StandingObstacles,
    fill_gaps,
    overlap_cost,
    overlap_costs,
)
from quad_nav.control.surroundings import EvasionParams, Surroundings
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import INSCRIBED, LETHAL, GridSpec
from quad_nav.tracking.tracks import Tracks

ON = EvasionParams(True, clearance_m=0.1)
ORIGIN = Pose2D(0.0, 0.0)
STILL = (0.0, 0.0)
HOVER = np.zeros((1, 2))
TIMES_S = prediction_times(0.5)
SEARCH = SpaceTime(0.125, 0.5, 0.5, 0.5, 1.3, 50.0, 0.0, 100.0, 0.05)


def around(pose=ORIGIN, costs=None, is_following=False, max_speed_mps=0.5):
    spec = GridSpec(160, 160, 0.05, -4.0, -4.0)
    costs = np.zeros(spec.shape, np.uint8) if costs is None else costs
    return Surroundings(spec, costs, pose, Twist2D(), 0.25, max_speed_mps, 0.5, is_following, 0.1)


def tracks(*states):
    n = len(states)
    return Tracks(
        10.0, np.arange(n), np.array(states).reshape(n, 4), np.zeros((n, 4, 4)), np.full(n, 0.5)
    )


def test_discs_move_on_with_their_velocity_and_uncertainty():
    discs = predicted_discs(ON, around(), tracks([3.0, 1.0, -1.0, 0.0]), 10.5, TIMES_S)
    assert discs.shape == (61, 1, 4)  # 6 s, five times in each step of 0.5 s
    np.testing.assert_allclose(discs[0, 0, :3], [2.5, 1.0, 0.85])
    np.testing.assert_allclose(discs[20, 0, :3], [0.5, 1.0, 0.85])
    np.testing.assert_allclose(discs[[0, 20], 0, 3], [0.08, 0.08 + 2.0 * 0.05])


def test_obstacles_out_of_reach_have_no_discs():
    # within 6 s: 0.85 m of radii, 6 m of its own way and 3 m of the robot's
    near, far = [9.8, 0.0, -1.0, 0.0], [9.9, 0.0, -1.0, 0.0]
    found = predicted_discs(ON, around(), tracks(near, far), 10.0, TIMES_S)
    assert found.shape[1] == 1


def test_threat_grows_inside_and_falls_off_outside():
    discs = np.array([[[1.0, 0.0, 0.5, 0.2]]])
    assert threat(discs, 0, 1.0, 0.5) == 1.0
    assert threat(discs, 0, 1.0, 0.3) == pytest.approx(3.0)  # 0.2 m deep
    assert threat(discs, 0, 1.0, 0.7) == pytest.approx(math.exp(-0.5))
    assert threat(discs, 0, 1.0, 1.2) == 0.0


def test_a_command_into_an_obstacle_costs_its_time_inside():
    discs = np.tile([0.57, 0.0, 0.2, 1e-6], (11, 1, 1))
    standing = StandingObstacles(np.ones((1, 1)), 0.0, 0.0, 1.0)
    costs, commands = np.zeros((3, 15, 15)), np.array([[0.5, 0.0], [-0.5, 0.0]])
    start, hover = (0.5, 0.0, 0.0, 0.0), np.zeros((1, 2))
    body = Body(0.01, 1e3, 2.0)  # keeps its velocity
    found = command_costs(SEARCH, body, discs, standing, costs, start, commands, hover)
    # After 0.8, 0.9 and 1 s, 0.1 s each, the robot is 0.03, 0.08 and 0.13 m deep.
    np.testing.assert_allclose(found, 50.0 * 0.1 * (1.3 + 1.8 + 2.3), rtol=1e-3)


def test_commands_last_as_long_for_a_fast_robot():
    """At 2 m/s it is at 2 m after 1 s, the end of the second command, and 0.03 m deep."""
    fast = SEARCH._replace(cell_m=0.2, step_s=0.2, max_speed_mps=2.0, usual_speed_mps=2.0)
    discs = np.tile([2.17, 0.0, 0.2, 1e-6], (31, 1, 1))
    standing = StandingObstacles(np.ones((1, 1)), 0.0, 0.0, 1.0)
    costs, ahead = np.zeros((7, 31, 31)), np.array([[2.0, 0.0]])
    body, start = Body(0.01, 1e3, 2.0), (2.0, 0.0, 0.0, 0.0)
    found = command_costs(fast, body, discs, standing, costs, start, ahead, ahead)
    assert found[0] == pytest.approx(50.0 * 0.04 * 1.3, rel=1e-3)


def test_the_best_second_command_counts():
    """A robot that goes on for a second is at 0.5 m; one that turns back stays before 0.42 m."""
    discs = np.tile([0.67, 0.0, 0.25, 1e-6], (11, 1, 1))
    standing = StandingObstacles(np.ones((1, 1)), 0.0, 0.0, 1.0)
    ahead, back = np.array([[0.5, 0.0]]), np.array([[-0.5, 0.0]])
    costs, start, body = np.zeros((3, 15, 15)), (0.5, 0.0, 0.0, 0.0), Body(3.125, 0.08, 2.0)
    on, turned = (
        command_costs(SEARCH, body, discs, standing, costs, start, ahead, second)[0]
        for second in (ahead, back)
    )
    # After 0.9 and 1 s, 0.1 s each, it is 0.03 and 0.08 m deep.
    assert on == pytest.approx(50.0 * 0.1 * (1.3 + 1.8))
    assert turned == 0.0


def test_the_body_approaches_a_command_as_in_flight():
    """Its position runs 0.32 s after the integral of the command, and its stop takes as long."""
    far = np.tile(np.arange(15.0), (15, 1))  # costs 1 for each cell in x
    costs = np.stack([far, far, far])
    standing = StandingObstacles(np.ones((1, 1)), 0.0, 0.0, 1.0)
    none, body = np.zeros((11, 0, 4)), Body(25.0 / 8.0, 2.0 / 25.0, 2.0)
    commands, start = np.array([[0.5, 0.0]]), (0.0, 0.0, 0.0, 0.0)
    found = command_costs(SEARCH, body, none, standing, costs, start, commands, commands)
    assert found[0] - 7.0 == pytest.approx(0.5 / 0.125, abs=0.1)  # within 0.1 cells, 1.3 cm


def test_a_command_leaves_room_to_stop_before_a_standing_obstacle():
    """After 1 s at 0.5 m/s the robot is at 0.5 m, and stops at 0.5 + 0.5 / 2 = 0.75 m."""
    costs, none = np.zeros((3, 15, 15)), np.zeros((11, 0, 4))
    rim, body = np.zeros((1, 1)), Body(2.0, 1e3, 2.0)
    ahead, start = np.array([[0.5, 0.0]]), (0.5, 0.0, 0.0, 0.0)

    def found(wall_x_m):
        wall = StandingObstacles(rim, wall_x_m, -5.0, 10.0)
        return command_costs(SEARCH, body, none, wall, costs, start, ahead, ahead)[0]

    assert found(0.76) == 0.0
    # Of five places on the way to the stop, 0.7 m and 0.75 m are behind the wall.
    assert found(0.68) == pytest.approx(100.0 * 0.1 * 2)


def test_overlap_costs_more_the_deeper_it_is():
    """A lethal cell with its centre at 0, and a robot of 0.30 m: the rim is at 0.30 m."""
    costs, gaps = np.zeros((21, 21), np.uint8), np.empty((21, 21))
    costs[10, 10] = LETHAL
    fill_gaps(costs, 0.05, 0.3, gaps)
    standing = StandingObstacles(gaps, -0.525, -0.525, 0.05)
    assert overlap_cost(standing, 0.36, 0.0) == pytest.approx(0.0)
    assert overlap_cost(standing, 0.325, 0.0) == pytest.approx(0.25)  # half of the margin is left
    assert overlap_cost(standing, 0.3, 0.0) == pytest.approx(1.0)
    assert overlap_cost(standing, 0.0, -0.2) == pytest.approx(3.0)  # 0.1 m deep
    assert overlap_cost(standing, -0.18, 0.24) == pytest.approx(1.0, abs=0.05)  # hypot is 0.30
    assert overlap_cost(standing, 0.6, 0.0) == 0.0  # outside of the grid
    grid = overlap_costs(standing, np.array([-0.2, 0.0, 0.3]))
    assert grid[1].tolist() == pytest.approx([3.0, 7.0, 1.0])
    assert grid[:, 1].tolist() == pytest.approx([3.0, 7.0, 1.0])


def test_inscribed_cells_without_a_lethal_one_are_at_the_rim():
    costs, gaps = np.full((3, 3), INSCRIBED, np.uint8), np.empty((3, 3))
    fill_gaps(costs, 0.05, 0.3, gaps)
    assert gaps.tolist() == np.zeros((3, 3)).tolist()


def test_the_best_motion_goes_on_from_where_and_when_the_body_rests():
    """At 0.5 m/s it rests 0.25 m and half a second later: half a step of each of two costs."""
    columns = np.arange(33) - 16.0
    costs = np.stack([factor * np.tile(columns, (33, 1)) for factor in (0.0, 0.0, 1.0, 3.0, 7.0)])
    slow = SEARCH._replace(step_s=1.0, cell_m=0.25, max_speed_mps=0.5)
    open_air = StandingObstacles(np.ones((1, 1)), 0.0, 0.0, 1.0)
    none, ahead, start = np.zeros((26, 0, 4)), np.array([[0.5, 0.0]]), (0.5, 0.0, 0.0, 0.0)
    found = command_costs(slow, Body(2.0, 1e3, 2.0), none, open_air, costs, start, ahead, ahead)
    # After 1 s it is at 0.5 m, and rests at 0.75 m, cell 3, at 1.5 s.
    assert found[0] == pytest.approx(3.0 * (0.0 + 1.0) / 2.0)


def test_speed_above_the_usual_costs_what_it_gains():
    """At 2 m/s instead of 0.5 m/s, a second costs three quarters of the haste."""
    fast = SEARCH._replace(cell_m=0.2, step_s=0.2, max_speed_mps=2.0)
    assert haste_per_s(fast, 2.0) == pytest.approx(1.3 * 0.75)
    assert haste_per_s(fast, 0.5) == haste_per_s(fast, 0.2) == 0.0
    to_go = np.tile(np.abs(np.arange(-15, 16) * 0.2 - 2.0) / 2.0, (31, 1))  # 2 m ahead
    costs = np.full((7, 31, 31), np.inf)
    fill_costs(fast, np.zeros((31, 0, 4)), np.zeros((31, 31)), to_go, costs)
    # Five steps at 1 m/s: half of the way is left, each step costs 0.2 s * 1.3 * 0.25 for its
    # haste, and 0.2 s * 0.05 of the way that is left then.
    assert costs[1, 15, 15] == pytest.approx(0.5 + 5 * 0.065 + 0.01 * (1.0 + 0.9 + 0.8 + 0.7 + 0.6))


def test_waiting_costs_less_than_the_way_through():
    """The least cost of a cell is that of the best motion, here around a standing disc."""
    discs = np.tile([0.25, 0.0, 0.2, 1e-6], (11, 1, 1))
    away = np.abs(np.arange(-7, 8) * 0.125 - 0.5) / 0.5
    to_go = np.tile(away, (15, 1))
    costs = np.full((3, 15, 15), np.inf)
    fill_costs(SEARCH, discs, np.zeros((15, 15)), to_go, costs)
    # From the middle one step of 0.25 m to the left of the disc, 0.5 s of way left after it.
    assert costs[1, 7, 7] == pytest.approx(0.05 * 1.0 * 0.5 + 0.5)
    assert costs[1, 7, 9] == pytest.approx((50.0 * 3.0 + 0.05 * 0.5) * 0.5)


def test_a_fast_obstacle_threatens_between_the_steps():
    """At 2 m/s it is 0.4 m away from a cell at the step, and on it 0.2 s later, half as much."""
    discs = np.array([[[-0.4 + 0.2 * (k - 5), 0.0, 0.2, 1e-6]] for k in range(11)])
    costs, to_go = np.full((3, 15, 15), np.inf), np.zeros((15, 15))
    fill_costs(SEARCH, discs, np.zeros((15, 15)), to_go, costs)
    assert costs[1, 7, 7] == pytest.approx(0.5 * 50.0 * 3.0 * 0.5)


def test_a_hovering_robot_evades_sideways():
    command = evade(ON, around(), tracks([2.0, 0.2, -1.0, 0.0]), 10.0, HOVER, Twist2D(), STILL)
    assert command.vy_mps < -0.3  # to the side that the disc's centre is not on
    assert math.hypot(command.vx_mps, command.vy_mps) <= 0.5 + 1e-9


def test_the_command_is_in_the_robots_frame():
    turned = around(Pose2D(0.0, 0.0, math.pi / 2))
    command = evade(ON, turned, tracks([2.0, 0.2, -1.0, 0.0]), 10.0, HOVER, Twist2D(), STILL)
    assert command.vx_mps < -0.3


def test_two_obstacles_are_evaded_together():
    """The side that one leaves free is closed by the other."""
    both = tracks([2.0, 0.2, -1.0, 0.0], [2.0, -1.3, -1.0, 0.0])
    command = evade(ON, around(), both, 10.0, HOVER, Twist2D(), STILL)
    assert command.vy_mps > 0.3 or command.vx_mps < -0.3


def test_a_wall_closes_a_side():
    wall = np.zeros((160, 160), np.uint8)
    wall[:78] = LETHAL  # y below -0.1 m
    command = evade(
        ON, around(costs=wall), tracks([3.0, 0.2, -1.0, 0.0]), 10.0, HOVER, Twist2D(), STILL
    )
    assert command.vy_mps > 0.3


def test_an_obstacle_that_passes_leaves_the_wish_as_it_is():
    wish = Twist2D(0.0, 0.0, 0.3)
    assert evade(ON, around(), tracks([3.0, 2.5, -1.0, 0.0]), 10.0, HOVER, wish, STILL) is wish


@pytest.fixture
def found(monkeypatch):
    """Costs of the commands of each evasion, the wish first."""
    costs = []

    def recorded(*arguments):
        costs.append(command_costs(*arguments))
        return costs[-1]

    monkeypatch.setattr("quad_nav.control.evasion.command_costs", recorded)
    return costs


def test_a_robot_that_nothing_threatens_any_more_slows_down(found):
    """After an evasion at 1.5 m/s no faster command is better than the usual 0.5 m/s."""
    wish, ahead = Twist2D(0.5), np.array([[15.0, 0.0]])
    fast = around(is_following=True, max_speed_mps=2.0)
    flying = replace(fast, velocity=Twist2D(1.5))
    passed = tracks([-3.0, 2.0, -1.0, 0.0])
    assert evade(ON, flying, passed, 10.0, ahead, wish, (1.5, 0.0)) is wish
    assert found[0][0] == pytest.approx(found[0].min())


@pytest.mark.parametrize("speed_mps", [0.5, 2.0, 4.0, 6.0])
def test_every_command_has_a_cost(speed_mps, found):
    """Also at the greatest speed, from where the robot rests far away."""
    ahead, one, wish = np.array([[4.0, 0.0]]), tracks([2.0, 0.2, -1.0, 0.0]), Twist2D(speed_mps)
    flying = replace(around(is_following=True, max_speed_mps=speed_mps), velocity=wish)
    evade(ON, flying, one, 10.0, ahead, wish, (speed_mps, 0.0))
    assert np.isfinite(found[0]).all()


def test_no_obstacle_leaves_the_wish_as_it_is():
    wish = Twist2D(0.5, 0.0, 0.1)
    ahead = np.array([[3.0, 0.0]])
    following = around(is_following=True)
    assert evade(ON, following, Tracks.none(10.0), 10.0, ahead, wish, (0.5, 0.0)) is wish


def test_a_robot_that_crosses_goes_behind():
    """An obstacle crosses 1 m ahead from the left; the robot lets it pass."""
    wish, ahead = Twist2D(0.5), np.array([[4.0, 0.0]])
    crossing = tracks([1.0, 1.0, 0.0, -0.8])
    command = evade(ON, around(is_following=True), crossing, 10.0, ahead, wish, (0.5, 0.0))
    assert command.vx_mps < 0.3
    assert command.vy_mps >= 0.0
