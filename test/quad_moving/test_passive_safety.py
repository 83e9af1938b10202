"""Passive safety: the robot rests before an obstacle can reach it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quad_nav.control.body_response import Body
from quad_nav.control.evasion import evade
from quad_nav.control.passive_safety import reachable_places
from quad_nav.control.passive_safety_kernel import Reachable, rest_in_time
from quad_nav.control.standing_obstacles import MARGIN_M, StandingObstacles
from quad_nav.control.surroundings import BODY, EvasionParams, Surroundings
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import GridSpec
from quad_nav.tracking.tracks import Tracks

PERIOD_S = 0.02
STIFF = Body(20.0, 1e-3, 2.0)  # it brakes with 2 m/s^2 almost until it rests
OPEN = StandingObstacles(np.full((1, 1), MARGIN_M), -50.0, -50.0, 100.0)
AHEAD, HOVER = [1.0, 0.0], [0.0, 0.0]
PEOPLE = EvasionParams(True, speed_mps=2.0, max_acceleration_mps2=6.0)


def rests(
    gap_m,
    command,
    vx_mps=0.0,
    acceleration_mps2=0.0,
    standing=OPEN,
    speed_mps=1.0,
    body=STIFF,
    periods=100,
):
    """An obstacle of 0.5 m, with the robot's radius, before a robot that holds 0.2 s."""
    times_s = PERIOD_S * np.arange(periods + 1)
    x_m = gap_m + 0.5 + vx_mps * times_s
    radii = 0.5 + 0.5 * acceleration_mps2 * times_s**2
    predicted = np.column_stack([x_m, np.zeros_like(x_m), radii])[:, np.newaxis]
    walked = 0.5 + 1.6 * times_s[:, np.newaxis]
    reachable = Reachable(np.ascontiguousarray(predicted), np.array([[x_m[0], 0.0]]), walked)
    start, commands = (speed_mps, 0.0, 0.0, 0.0), np.array([command])
    return bool(rest_in_time(body, reachable, PERIOD_S, standing, start, commands, 10)[0])


@pytest.mark.parametrize(
    "obstacle_mps, acceleration_mps2, needed_m",
    [
        # 0.2 m until it brakes and 0.25 m until it rests, 0.2 and 0.48 s
        (0.0, 0.0, 0.45),
        (0.0, 2.0, 0.45 + 0.68**2),
        (-1.0, 1.0, 0.45 + 0.68 + 0.5 * 0.68**2),
        (-1.0, 4.0, 0.45 + 1.6 * 0.68),  # by its acceleration alone 0.91 m more than it walks
    ],
)
def test_a_command_needs_the_way_to_rest_and_what_the_obstacle_may_do(
    obstacle_mps, acceleration_mps2, needed_m
):
    assert rests(needed_m + 0.04, AHEAD, obstacle_mps, acceleration_mps2)
    assert not rests(needed_m - 0.04, AHEAD, obstacle_mps, acceleration_mps2)


def test_a_robot_at_rest_may_be_touched():
    assert rests(0.1, HOVER, -1.0, speed_mps=0.0)
    assert not rests(0.1, AHEAD, -1.0, speed_mps=0.0)


def test_a_robot_does_not_creep_while_somebody_can_reach_it():
    """The body would be slower than 0.03 m/s in the 0.2 s of a command of 0.06 m/s."""
    assert not rests(0.1, [0.06, 0.0], -1.0, speed_mps=0.0, body=BODY)
    assert rests(0.1, [0.02, 0.0], -1.0, speed_mps=0.0, body=BODY)


def test_a_robot_that_does_not_rest_by_the_last_time_is_not_safe():
    """It needs 0.68 s."""
    assert rests(5.0, AHEAD, periods=36)
    assert not rests(5.0, AHEAD, periods=30)


def test_a_robot_may_fly_away_from_an_obstacle_that_is_slower():
    assert rests(0.1, [-1.0, 0.0], -0.2, speed_mps=-1.0)
    assert not rests(0.1, [-1.0, 0.0], -1.6, speed_mps=-1.0)


def test_a_command_comes_into_no_standing_obstacle_before_the_robot_rests():
    """Its rim is at 0.5 m: the robot rests 0.05 m before it, or 0.05 m inside."""
    gaps = np.clip(0.5 - (0.05 * np.arange(80) - 2.0 + 0.025), -0.3, MARGIN_M)
    for nearer_m, is_safe in ((0.0, True), (0.1, False)):
        wall = StandingObstacles(np.tile(gaps, (80, 1)), -2.0 - nearer_m, -2.0, 0.05)
        assert rests(3.0, AHEAD, standing=wall) is is_safe


def surroundings(velocity=None, period_s=0.1):
    spec = GridSpec(160, 160, 0.05, -4.0, -4.0)
    velocity, costs = velocity or Twist2D(), np.zeros(spec.shape, np.uint8)
    here = Pose2D(0.0, 0.0)
    return Surroundings(spec, costs, here, velocity, 0.35, 2.0, 0.5, True, period_s)


def command_of(params, tracks, wish=None, **around):
    around = surroundings(**around)
    last, end = (around.velocity.vx_mps, around.velocity.vy_mps), np.array([[4.0, 0.0]])
    return evade(params, around, tracks, 0.0, end, wish or Twist2D(vx_mps=0.5), last)


def person(x_m, y_m, vx_mps, vy_mps):
    states = np.array([[x_m, y_m, vx_mps, vy_mps]])
    return Tracks(0.0, np.array([1]), states, 1e-4 * np.eye(4)[np.newaxis], np.array([0.25]))


def test_where_obstacles_can_be():
    """After 0.5 s: 6 m/s^2 is 0.75 m, half of it for who stands; 1.6 m/s is 0.8 m.

    At 0.8 m/s it is 4.5 m/s^2. Who runs at 2 m/s is no slower later. 0.05 m are for errors.
    """
    around, times_s = surroundings(), np.array([0.0, 0.5])
    stands = np.array([[1.0, 1.0, 0.0, 0.0, 0.3]])
    for tracks, place, radius_m, walked_m in (
        (person(2.0, 0.0, -0.8, 0.0), (1.6, 0.0), 0.5 * 4.5 * 0.25, 0.8),
        (person(0.0, 1.5, 0.0, -2.0), (0.0, 0.5), 0.75, 1.0),
    ):
        found = reachable_places(PEOPLE, around, replace(tracks, suspects=stands), times_s)
        np.testing.assert_allclose(found.places, [tracks.states[0, :2], [1.0, 1.0]])
        np.testing.assert_allclose(found.predicted[1, 0], [*place, 0.65 + radius_m])
        np.testing.assert_allclose(found.predicted[1, 1], [1.0, 1.0, 0.7 + 0.375])
        np.testing.assert_allclose(found.walked, [[0.65, 0.7], [0.65 + walked_m, 0.7 + 0.8]])


def test_obstacles_out_of_reach_do_not_count():
    """In 0.5 s: 0.65 m of radii and errors, 0.8 m of a walk and 1 m of the robot's way."""
    for x_m, count in ((2.44, 1), (2.46, 0)):
        times_s = np.array([0.0, 0.5])
        found = reachable_places(PEOPLE, surroundings(), person(x_m, 0.0, 0.0, 0.0), times_s)
        assert found.predicted.shape == (2, count, 3)


def test_a_robot_at_rest_stays_when_a_person_is_too_near_to_evade():
    """Without passive safety it flees at its greatest speed."""
    passing = person(0.8, 0.5, -1.0, -0.2)
    command = command_of(PEOPLE, passing)
    assert np.hypot(command.vx_mps, command.vy_mps) < 0.03
    evasion = command_of(replace(PEOPLE, max_acceleration_mps2=0.0), passing)
    assert np.hypot(evasion.vx_mps, evasion.vy_mps) == pytest.approx(2.0)


def test_a_robot_that_cannot_rest_in_time_brakes():
    velocity = Twist2D(vx_mps=1.5, vy_mps=-0.5)
    command = command_of(PEOPLE, person(1.2, 0.0, -1.2, 0.0), velocity=velocity)
    assert (command.vx_mps, command.vy_mps) == (-1.5, 0.5)


def test_a_robot_does_not_fly_off_beside_a_person_who_may_turn_back():
    """The person is 0.15 m from the hull and walks away at 0.9 m/s, the robot is at rest.

    With 6 m/s^2 the robot gets away in time, with 10 m/s^2 the person can come back faster.
    """
    beside, wish = person(-0.75, 0.0, -0.9, 0.0), Twist2D(vx_mps=0.5)
    assert command_of(PEOPLE, beside, wish) is wish
    assert command_of(replace(PEOPLE, max_acceleration_mps2=10.0), beside, wish) == Twist2D()


def test_a_slower_control_cycle_needs_more_room():
    """A person stands 1.3 m ahead of the hull, the robot flies at 0.5 m/s.

    At 10 Hz it rests 0.25 m further on after 0.6 s, and the person may have come 0.55 m nearer. At
    1 Hz it flies on for 0.75 m before it brakes.
    """
    wish, ahead = Twist2D(vx_mps=0.5), person(1.9, 0.0, 0.0, 0.0)
    assert command_of(PEOPLE, ahead, wish, velocity=wish) is wish
    assert command_of(PEOPLE, ahead, wish, velocity=wish, period_s=1.0).vx_mps <= 0.0


def test_a_person_far_away_leaves_the_wish_as_it_is():
    wish = Twist2D(vx_mps=0.5)
    assert command_of(PEOPLE, person(4.0, 3.0, 0.0, 1.0), wish) is wish


def test_who_has_stopped_may_walk_on():
    """Nothing is tracked: 0.1 m ahead of the hull somebody has stopped, or 0.8 m ahead."""
    nobody, wish = Tracks.none(0.0), Twist2D(vx_mps=0.5)
    for gap_m, flies in ((0.1, False), (0.8, True)):
        ahead = replace(nobody, suspects=np.array([[0.6 + gap_m, 0.0, 0.0, 0.0, 0.25]]))
        assert (command_of(PEOPLE, ahead, wish) is wish) is flies
    assert command_of(PEOPLE, nobody, wish) is wish
