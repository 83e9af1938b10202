"""Evasion: which command replaces one that leads into a moving obstacle, by hand-made numbers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from quad_moving.evasion import BODY, Evasion, usual_speed_mps
from quad_moving.reachable import Body, Flight, Obstacles, Standing, overlaps
from quad_nav.config.plugins import Parameters
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import LETHAL, GridSpec
from quad_nav.navigator.command_filter import Command, Situation, StopReason

HERE = Pose2D(0.0, 0.0)
AHEAD = Twist2D(vx_mps=0.5)
HOVER = Command(Twist2D(), StopReason.IDLE)
PLANNER = TrajectoryPlannerParams(holonomic_robot=True, max_vel_x_mps=0.5)
PLAIN = {"max_speed": 1.0, "horizon": 3.0, "max_acceleration": 0.0}
PEOPLE = {"max_speed": 1.0, "horizon": 0.0, "max_acceleration": 6.0}


def peers_that(limit):
    """Peers whose Voronoi cell limits velocities in a way."""
    return SimpleNamespace(cell=lambda *_: SimpleNamespace(limit_velocities=limit))


ALONE = peers_that(lambda velocities: velocities)
SPEC = GridSpec(160, 160, 0.05, -4.0, -4.0)


def tracks(*states, suspects=()):
    n = len(states)
    return Tracks(
        10.0,
        np.arange(n),
        np.array(states, float).reshape(n, 4),
        np.zeros((n, 4, 4)),
        np.full(n, 0.25),
        np.zeros(n),
        np.array(suspects, float).reshape(-1, 5),
    )


def situation(seen, pose=HERE, velocity=None, costs=None, now_s=10.0, peers=ALONE):
    costs = np.zeros(SPEC.shape, np.uint8) if costs is None else costs
    costmap = SimpleNamespace(layers={}, spec=SPEC, costs=costs, inscribed_radius_m=0.35)
    velocity = velocity or Twist2D()
    return Situation(
        now_s, 0.1, pose, pose, HERE, velocity, velocity, None, costmap, PLANNER, seen, peers
    )


def evade(command, seen, params=None, **around):
    params = PLAIN if params is None else params
    return Evasion(Parameters(params, "evasion")).filter(command, situation(seen, **around))


def overlap(
    command, state, velocity=(0.0, 0.0), rests=False, hold=2, standing=None, body=None, limit=1.0
):
    """How deep the robot is within 3 s in what an obstacle of 0.5 m, at most 1.6 m/s fast, reaches.

    Steps are of 0.1 s. The body follows a command at once unless another one is given. The
    obstacle's greatest acceleration is ``limit``.
    """
    standing = standing or Standing(np.zeros((1, 1), np.uint8), 0.0, 0.0, 1.0, 253)
    flight, found = Flight(0.1, 30, hold, rests), np.empty(1)
    obstacles = Obstacles(np.array([state], float), np.array([0.5]), np.array([1.6]), limit)
    body = body or Body(10.0, 1e3, 0.05)
    velocity, commands = np.array(velocity), np.array([command], float)
    overlaps(body, standing, obstacles, flight, velocity, commands, found)
    return found[0]


def test_what_an_obstacle_reaches_with_its_greatest_acceleration():
    """It stands 1.5 m away: with 2 * 1 m / (3 s)^2 it is there after 3 s; 1.6 m/s is enough.

    With 0.25 m/s^2 it is 0.051 m too near after 2.9 s and 0.125 m after 3 s.
    """
    stands = [1.5, 0.0, 0.0, 0.0]
    assert overlap([0.0, 0.0], stands, limit=2.0 / 9.0 - 1e-9) == 0.0
    assert overlap([0.0, 0.0], stands, limit=0.25) == pytest.approx(0.1 * (0.05125 + 0.125))


def test_a_robot_at_rest_may_be_touched_if_it_rests():
    coming = [1.5, 0.0, -1.0, 0.0]
    assert overlap([0.0, 0.0], coming, rests=True) == 0.0
    assert overlap([0.0, 0.0], coming) > 0.0


def test_a_robot_that_brakes_in_time_is_clear():
    """It flies 0.2 m in 0.2 s and brakes at 2 m/s^2: 0.24 m more and half a second.

    An obstacle that stands 1.2 m ahead needs 2 (1.2 - 0.44 - 0.5) / 0.6^2 = 1.44 m/s^2.
    """
    body = Body(10.0, 2.0, 0.05)
    ahead = [1.2, 0.0, 0.0, 0.0]
    for limit, is_clear in ((1.4, True), (1.5, False)):
        found = overlap([1.0, 0.0], ahead, (1.0, 0.0), rests=True, body=body, limit=limit)
        assert bool(found == 0.0) is is_clear


def test_a_command_after_which_the_robot_cannot_stop_before_a_wall_is_none():
    """From x = 0.5 m on; it flies 0.2 m and needs 0.25 m to stop."""
    body, far = Body(10.0, 2.0, 0.05), [9.0, 9.0, 0.0, 0.0]
    for wall_x_m, stops in ((0.5, True), (0.4, False)):
        wall = Standing(np.array([[0, 254]], np.uint8), wall_x_m - 1.0, -0.5, 1.0, 253)
        found = overlap([1.0, 0.0], far, (1.0, 0.0), standing=wall, body=body)
        assert bool(found == 0.0) is stops


@pytest.mark.parametrize("speed_mps, stops", [(0.5, True), (1.0, False)])
def test_a_robot_that_flies_keeps_off_what_stands(speed_mps, stops):
    """The limit is 253 exp(-v): 153 at 0.5 m/s and 93 at 1 m/s; the cells ahead cost 100."""
    body, far = Body(10.0, 2.0, 0.05), [9.0, 9.0, 0.0, 0.0]
    wall = Standing(np.array([[0, 100]], np.uint8), -0.9, -0.5, 1.0, 253, 1.0)
    found = overlap([speed_mps, 0.0], far, (speed_mps, 0.0), standing=wall, body=body)
    assert bool(found == 0.0) is stops


def test_nothing_that_moves_leaves_the_command_as_it_is():
    command = Command(AHEAD)
    assert evade(command, tracks()) is command
    assert evade(command, None) is command


def test_a_peer_closes_a_side():
    """Of velocities to the right nothing is left."""
    right = peers_that(lambda velocities: np.where(velocities[:, 1:] < -0.01, 0.0, velocities))
    found = evade(HOVER, tracks([2.0, 0.2, -1.0, 0.0]), peers=right)
    assert found.velocity.vy_mps > -0.01 and not found.velocity.is_zero


def test_a_wall_closes_a_side():
    costs = np.zeros(SPEC.shape, np.uint8)
    costs[:78] = LETHAL  # y below -0.1 m
    coming = tracks([2.0, 0.2, -1.0, 0.0])
    found = evade(HOVER, coming, {**PLAIN, "max_speed": 2.0}, costs=costs)
    assert found.velocity.vy_mps > -0.05 and not found.velocity.is_zero


def test_a_robot_that_is_too_near_to_what_stands_is_left_to_the_navigator():
    costs, command = np.full(SPEC.shape, LETHAL, np.uint8), Command(AHEAD)
    assert evade(command, tracks([2.0, 0.0, -1.0, 0.0]), costs=costs) is command


def test_where_no_velocity_is_clear_the_robot_flees():
    """In a corridor something comes faster than the robot can fly back."""
    costs = np.zeros(SPEC.shape, np.uint8)
    costs[:74] = costs[86:] = LETHAL  # y beyond 0.3 m
    found = evade(
        Command(AHEAD), tracks([2.0, 0.0, -1.5, 0.0]), {**PLAIN, "max_speed": 0.5}, costs=costs
    )
    assert found.velocity.vx_mps < -0.2


def test_a_robot_without_a_goal_returns_to_its_point():
    evasion = Evasion(Parameters(PLAIN, "evasion"))
    evasion.filter(HOVER, situation(tracks([2.0, 0.2, -1.0, 0.0])))
    back = evasion.filter(HOVER, situation(tracks(), Pose2D(0.0, -0.6)))
    assert back.velocity.vy_mps == pytest.approx(0.5) and back.limited_by
    assert evasion.filter(HOVER, situation(tracks(), Pose2D(0.0, -0.1))) is HOVER


def test_a_robot_that_is_fast_from_an_evasion_brakes_before_a_wall():
    costs = np.zeros(SPEC.shape, np.uint8)
    costs[:, 90:] = LETHAL  # x above 0.5 m; it needs 0.56 m to stop at 2 m/s^2
    evasion = Evasion(Parameters({**PLAIN, "max_speed": 2.0}, "evasion"))
    evasion.filter(Command(AHEAD), situation(tracks([-1.0, 0.0, 1.5, 0.0])))
    fast = situation(tracks(), velocity=Twist2D(vx_mps=1.5), costs=costs)
    assert evasion.filter(Command(AHEAD), fast).velocity.vx_mps <= 0.0


def test_a_robot_among_people_stands_while_somebody_can_reach_it():
    command = Command(AHEAD)
    near, far = tracks([1.1, 0.0, -1.0, 0.0]), tracks([3.5, 0.0, -1.0, 0.0])
    assert evade(command, near, PEOPLE, velocity=AHEAD).velocity.vx_mps <= 0.0
    assert evade(command, far, PEOPLE) is command
    assert evade(HOVER, near, PEOPLE) is HOVER


def test_a_robot_among_people_that_cannot_rest_in_time_brakes():
    found = evade(
        Command(AHEAD), tracks([1.0, 0.0, -1.2, 0.0]), PEOPLE, velocity=Twist2D(1.0, -0.3)
    )
    assert (found.velocity.vx_mps, found.velocity.vy_mps) == (-1.0, 0.3)


@pytest.mark.parametrize(
    "params, speed_mps",
    [
        (PLANNER, 0.5),
        (TrajectoryPlannerParams(holonomic_robot=False), None),
        (DwaParams(max_vel_y_mps=0.1, max_vel_trans_mps=0.4), 0.4),
        (DwaParams(max_vel_y_mps=0.1, max_vel_trans_mps=-1.0, max_vel_x_mps=0.3), 0.3),
        (DwaParams(max_vel_y_mps=0.0), None),
        (None, None),
    ],
)
def test_a_robot_that_cannot_fly_sideways_is_left_alone(params, speed_mps):
    assert usual_speed_mps(params) == speed_mps


def test_the_body_is_that_of_the_simulator():
    assert BODY.gain_per_s == 25.0 / 8.0 and BODY.acceleration_mps2 == 2.0
