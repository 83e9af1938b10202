"""Evasion of moving obstacles: predictions, threats, and the commands that are taken."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.control.evasion import EvasionParams, Surroundings, evade, predicted_discs
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import LETHAL, GridSpec
from quad_nav.kernels.space_time import (
    SpaceTime,
    StandingObstacles,
    command_costs,
    fill_costs,
    threat,
)
from quad_nav.tracking.motion_memory import MotionMemory
from quad_nav.tracking.tracks import Tracks

ON = EvasionParams(True, clearance_m=0.1)
ORIGIN = Pose2D(0.0, 0.0)
STILL = (0.0, 0.0)
HOVER = np.zeros((1, 2))
SEARCH = SpaceTime(0.125, 0.5, 0.5, 3.0, 50.0, 0.0, 100.0, 0.05)


def around(pose=ORIGIN, costs=None, is_following=False):
    spec = GridSpec(160, 160, 0.05, -4.0, -4.0)
    costs = np.zeros(spec.shape, np.uint8) if costs is None else costs
    return Surroundings(spec, costs, pose, Twist2D(), 0.25, 0.5, is_following, MotionMemory())


def tracks(*states):
    n = len(states)
    return Tracks(
        10.0, np.arange(n), np.array(states).reshape(n, 4), np.zeros((n, 4, 4)), np.full(n, 0.5)
    )


def test_discs_move_on_with_their_velocity_and_uncertainty():
    discs = predicted_discs(ON, around(), tracks([3.0, 1.0, -1.0, 0.0]), 10.5, 0.5)
    assert discs.shape == (61, 1, 4)  # 6 s, five times in each step of 0.5 s
    np.testing.assert_allclose(discs[0, 0, :3], [2.5, 1.0, 0.85])
    np.testing.assert_allclose(discs[20, 0, :3], [0.5, 1.0, 0.85])
    np.testing.assert_allclose(discs[[0, 20], 0, 3], [0.08, 0.08 + 2.0 * 0.05])


def test_obstacles_out_of_reach_have_no_discs():
    # within 6 s: 0.85 m of radii, 6 m of its own way and 3 m of the robot's
    near, far = [9.8, 0.0, -1.0, 0.0], [9.9, 0.0, -1.0, 0.0]
    assert predicted_discs(ON, around(), tracks(near, far), 10.0, 0.5).shape[1] == 1


def test_threat_grows_inside_and_falls_off_outside():
    discs = np.array([[[1.0, 0.0, 0.5, 0.2]]])
    assert threat(discs, 0, 1.0, 0.5) == 1.0
    assert threat(discs, 0, 1.0, 0.3) == pytest.approx(3.0)  # 0.2 m deep
    assert threat(discs, 0, 1.0, 0.7) == pytest.approx(math.exp(-0.5))
    assert threat(discs, 0, 1.0, 1.2) == 0.0


def test_a_command_into_an_obstacle_costs_its_time_inside():
    discs = np.tile([0.33, 0.0, 0.2, 1e-6], (6, 1, 1))
    standing = StandingObstacles(np.zeros((1, 1), bool), 0.0, 0.0, 1.0)
    costs = np.zeros((2, 15, 15))
    commands = np.array([[0.5, 0.0], [-0.5, 0.0]])
    found = command_costs(SEARCH, discs, standing, costs, (0.5, 0.0), commands)
    # After 0.3, 0.4 and 0.5 s, 0.1 s each, the robot is 0.02, 0.07 and 0.12 m deep.
    np.testing.assert_allclose(found, [50.0 * 0.1 * (1.2 + 1.7 + 2.2), 0.0])


def test_a_command_leaves_room_to_stop_before_a_standing_obstacle():
    """After 0.5 s at 0.5 m/s the robot is at 0.25 m, and stops at 0.25 + 0.5 / 3 = 0.417 m."""
    costs, none = np.zeros((2, 15, 15)), np.zeros((6, 0, 4))
    commands = np.array([[0.5, 0.0], [-0.5, 0.0]])
    blocked = np.ones((1, 1), bool)

    def found(wall_x_m):
        wall = StandingObstacles(blocked, wall_x_m, -5.0, 10.0)
        return command_costs(SEARCH, none, wall, costs, (0.5, 0.0), commands)

    np.testing.assert_array_equal(found(0.42), [0.0, 0.0])
    # While it stops it is at 0.396 m after 0.7 s, and beyond after 0.8, 0.9 and 1 s.
    np.testing.assert_allclose(found(0.40), [100.0 * 0.1 * 3, 0.0])
    # During the step it is at 0.2 m and 0.25 m; all of the stop is behind the wall, too.
    np.testing.assert_allclose(found(0.18), [100.0 * 0.1 * (2 + 10), 0.0])


def test_waiting_costs_less_than_the_way_through():
    """The least cost of a cell is that of the best motion, here around a standing disc."""
    discs = np.tile([0.25, 0.0, 0.2, 1e-6], (11, 1, 1))
    away = np.abs(np.arange(-7, 8) * 0.125 - 0.5) / 0.5
    to_go = np.tile(away, (15, 1))
    costs = np.full((3, 15, 15), np.inf)
    fill_costs(SEARCH, discs, np.zeros((15, 15), bool), to_go, costs)
    # From the middle one step of 0.25 m to the left of the disc, 0.5 s of way left after it.
    assert costs[1, 7, 7] == pytest.approx(0.05 * 1.0 * 0.5 + 0.5)
    assert costs[1, 7, 9] == pytest.approx((50.0 * 3.0 + 0.05 * 0.5) * 0.5)


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
