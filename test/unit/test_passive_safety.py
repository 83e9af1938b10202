"""Passive safety: the robot rests before an obstacle reaches it that leaves its prediction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quad_nav.control.evasion import EvasionParams, Surroundings, evade
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import GridSpec
from quad_nav.kernels.body_response import Body
from quad_nav.kernels.passive_safety import rest_in_time
from quad_nav.kernels.standing_obstacles import MARGIN_M, StandingObstacles
from quad_nav.tracking.motion_memory import MotionMemory, Recalled
from quad_nav.tracking.tracks import Tracks

PERIOD_S = 0.02
BODY = Body(20.0, 1e-3, 2.0)  # it brakes with 2 m/s^2 down to 0.05 m/s
OPEN = StandingObstacles(np.full((1, 1), MARGIN_M), -50.0, -50.0, 100.0)
AHEAD, HOVER = [1.0, 0.0], [0.0, 0.0]
PEOPLE = EvasionParams(True, clearance_m=0.1, speed_mps=2.0, deviation_mps=0.5)


def rests(gap_m, command, vx_mps=0.0, deviation_mps=0.5, standing=OPEN, speed_mps=1.0, early=0):
    """An obstacle of 0.5 m, with the robot's radius, before a robot that holds 0.2 s."""
    times_s = PERIOD_S * np.arange(101)
    discs = np.tile([gap_m + 0.5, 0.0, 0.5, 0.1], (101, 1, 1))
    discs[:, 0, 0] += vx_mps * times_s
    start, commands = (speed_mps, 0.0, 0.0, 0.0), np.array([command])
    found = rest_in_time(BODY, discs, PERIOD_S, deviation_mps, standing, start, commands, 10, early)
    return bool(found[0])


@pytest.mark.parametrize(
    "obstacle_mps, deviation_mps, needed_m",
    [
        # 0.2 m until it brakes and 0.25 m until it rests, 0.2 and 0.475 s
        (0.0, 0.0, 0.45),
        (0.0, 0.5, 0.45 + 0.5 * 0.675),
        (-1.0, 0.5, 0.45 + 1.5 * 0.675),
    ],
)
def test_a_command_needs_the_way_to_rest_and_what_the_obstacle_may_do(
    obstacle_mps, deviation_mps, needed_m
):
    assert rests(needed_m + 0.04, AHEAD, obstacle_mps, deviation_mps)
    assert not rests(needed_m - 0.04, AHEAD, obstacle_mps, deviation_mps)


def test_a_robot_rests_some_time_before_an_obstacle_reaches_it():
    """An obstacle that comes at 1 m/s may be 1.5 times 0.2 m nearer by then, one that leaves not.

    Behind an obstacle that is as fast, the robot is nearest 0.25 s after it begins to brake.
    """
    needed_m = 0.45 + 1.5 * 0.675
    assert rests(needed_m + 0.3 + 0.04, AHEAD, -1.0, early=10)
    assert not rests(needed_m + 0.3 - 0.04, AHEAD, -1.0, early=10)
    behind_m = 0.5 * 0.45 - 0.25**2
    for early in (0, 10):
        assert rests(behind_m + 0.02, AHEAD, 1.0, early=early)
        assert not rests(behind_m - 0.02, AHEAD, 1.0, early=early)


def test_a_robot_at_rest_may_be_touched():
    assert rests(0.1, HOVER, -1.0, speed_mps=0.0)
    assert not rests(0.1, AHEAD, -1.0, speed_mps=0.0)


def test_a_robot_may_fly_away_from_an_obstacle_that_is_slower():
    assert rests(0.4, [-1.0, 0.0], -0.2, speed_mps=-1.0)
    assert not rests(0.4, [-1.0, 0.0], -2.0, speed_mps=-1.0)


def test_a_command_comes_into_no_standing_obstacle_before_the_robot_rests():
    """Its rim is at 0.5 m: the robot rests 0.05 m before it, or 0.05 m inside."""
    gaps = np.clip(0.5 - (0.05 * np.arange(80) - 2.0 + 0.025), -0.3, MARGIN_M)
    for nearer_m, is_safe in ((0.0, True), (0.1, False)):
        wall = StandingObstacles(np.tile(gaps, (80, 1)), -2.0 - nearer_m, -2.0, 0.05)
        assert rests(3.0, AHEAD, standing=wall) is is_safe


class RecallsATurn(MotionMemory):
    """It recalls that an obstacle like this turned, and went away along x at 1 m/s."""

    def recall(self, number, times_s):
        return Recalled(np.column_stack([times_s, 0.0 * times_s]), len(times_s))


def command_of(params, tracks, velocity=None, wish=None, period_s=0.1, memory=None):
    spec = GridSpec(160, 160, 0.05, -4.0, -4.0)
    velocity, costs = velocity or Twist2D(), np.zeros(spec.shape, np.uint8)
    here, memory = Pose2D(0.0, 0.0), memory or MotionMemory()
    around = Surroundings(spec, costs, here, velocity, 0.35, 2.0, 0.5, True, memory, period_s)
    last = velocity.vx_mps, velocity.vy_mps
    end = np.array([[4.0, 0.0]])
    return evade(params, around, tracks, 0.0, end, wish or Twist2D(vx_mps=0.5), last)


def person(x_m, y_m, vx_mps, vy_mps):
    states = np.array([[x_m, y_m, vx_mps, vy_mps]])
    return Tracks(0.0, np.array([1]), states, 1e-4 * np.eye(4)[np.newaxis], np.array([0.25]))


def test_a_robot_at_rest_stays_when_a_person_is_too_near_to_evade():
    """Without the limit it flees at its greatest speed."""
    passing = person(0.8, 0.5, -1.0, -0.2)
    assert command_of(PEOPLE, passing) == Twist2D()
    evasion = command_of(replace(PEOPLE, deviation_mps=0.0), passing)
    assert np.hypot(evasion.vx_mps, evasion.vy_mps) == pytest.approx(2.0)


def test_a_robot_that_cannot_rest_in_time_brakes():
    velocity = Twist2D(vx_mps=1.5, vy_mps=-0.5)
    command = command_of(PEOPLE, person(1.2, 0.0, -1.2, 0.0), velocity)
    assert (command.vx_mps, command.vy_mps) == (-1.5, 0.5)


def test_a_robot_brakes_rather_than_evade_at_the_last_moment():
    """A person comes at 1 m/s, 0.9 m from the hull of a robot at 0.5 m/s.

    After an evasion backwards it would rest just in time, but not 0.25 s before.
    """
    wish = Twist2D(vx_mps=0.5)
    command = command_of(PEOPLE, person(1.5, 0.0, -1.0, 0.0), wish, wish)
    assert (command.vx_mps, command.vy_mps) == (-0.5, 0.0)


def test_a_slower_control_cycle_needs_more_room():
    """A person stands 0.8 m ahead of the hull, the robot flies at 0.5 m/s.

    At 10 Hz it rests 0.2 m further on after 0.6 s, and the person may have come 0.3 m nearer. At
    1 Hz it flies on for 1 m before it brakes.
    """
    wish, ahead = Twist2D(vx_mps=0.5), person(1.4, 0.0, 0.0, 0.0)
    assert command_of(PEOPLE, ahead, wish, wish) is wish
    assert command_of(PEOPLE, ahead, wish, wish, period_s=1.0).vx_mps < 0.0


def test_a_person_far_away_leaves_the_wish_as_it_is():
    wish = Twist2D(vx_mps=0.5)
    assert command_of(PEOPLE, person(4.0, 3.0, 0.0, 1.0), wish=wish) is wish


def test_a_person_who_turned_here_before_may_come_on():
    """The robot is at rest, the person 0.5 m from its hull comes nearer at 1 m/s."""
    coming, wish = person(1.1, 0.0, -1.0, 0.0), Twist2D(vx_mps=0.5)
    trusting = replace(PEOPLE, deviation_mps=0.0)
    assert command_of(trusting, coming, wish=wish, memory=RecallsATurn()).vx_mps > 0.0
    assert command_of(PEOPLE, coming, wish=wish, memory=RecallsATurn()).vx_mps <= 0.0
