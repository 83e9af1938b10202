"""The guard against moving obstacles: when it takes the command, and where the robot returns."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from quad_nav.config import load
from quad_nav.control.surroundings import EvasionParams
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import LETHAL, GridSpec
from quad_nav.navigator.evasion_guard import EvasionGuard, SpeedLimits, speed_limits
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.tracking.tracks import Tracks

LIMITS = SpeedLimits(0.5, 1.0)
AHEAD = Twist2D(vx_mps=0.3)
HERE = Pose2D(0.0, 0.0)


@pytest.fixture
def guard():
    spec = GridSpec(160, 160, 0.05, -4.0, -4.0)
    costs = np.zeros(spec.shape, np.uint8)
    costmap = SimpleNamespace(spec=spec, costs=costs, inscribed_radius_m=0.3)
    return EvasionGuard(EvasionParams(avoid_moving_obstacles=True), costmap, 0.1)


def one_track(x_m, y_m, vx_mps, vy_mps, now_s=0.0):
    states = np.array([[x_m, y_m, vx_mps, vy_mps]])
    return Tracks(now_s, np.array([1]), states, 1e-4 * np.eye(4)[np.newaxis], np.array([0.3]))


def checked(guard, tracks, pose=HERE, plan=None, command=None, now_s=0.0):
    tick = Tick(now_s)
    tick.command = command
    guard.check(tick, RobotPoses(pose, pose), Twist2D(), tracks, plan, LIMITS)
    return tick


def test_without_tracks_the_command_stays(guard):
    tick = checked(guard, Tracks.none(0.0), command=AHEAD)
    assert tick.command is AHEAD and not tick.evades and not guard.is_evading


@pytest.mark.parametrize("speed_mps, brakes", [(0.5, False), (1.5, True)])
def test_a_robot_that_is_still_fast_brakes_before_a_wall(guard, speed_mps, brakes):
    """From 1.5 m/s it rests after 0.56 m at 2 m/s^2, and what it flies until it tilts."""
    guard.params = replace(guard.params, speed_mps=2.0)
    wall_x_m, spec = 0.6, guard._costmap.spec
    guard._costmap.costs[:, int((wall_x_m - spec.origin_x_m) / spec.resolution_m) :] = LETHAL
    tick, plan = Tick(0.0), np.array([[3.0, 0.0, 0.0]])
    tick.command = Twist2D(vx_mps=0.5)
    velocity = Twist2D(vx_mps=speed_mps)
    guard.check(tick, RobotPoses(HERE, HERE), velocity, Tracks.none(0.0), plan, LIMITS)
    assert tick.evades == brakes
    assert (tick.command.vx_mps <= 0.0) == brakes


def test_an_obstacle_that_goes_away_changes_nothing(guard):
    tick = checked(guard, one_track(2.0, 0.0, 1.0, 0.0))
    assert tick.command is None and not tick.evades


def test_a_hovering_robot_leaves_the_way_of_an_obstacle(guard):
    """It comes along the x axis, slightly to the left: the short way out is to the right."""
    tick = checked(guard, one_track(2.0, 0.1, -1.0, 0.0))
    assert tick.evades and tick.command.vy_mps < -0.2
    assert np.hypot(tick.command.vx_mps, tick.command.vy_mps) <= 0.5 + 1e-9
    assert tick.command.vyaw_radps == 0.0


def test_a_robot_that_evaded_returns_to_its_point_and_stops_there(guard):
    checked(guard, one_track(2.0, 0.1, -1.0, 0.0))
    gone = Tracks.none(1.0)
    back = checked(guard, gone, Pose2D(0.0, -0.6), now_s=1.0)
    assert back.evades and back.command.vy_mps > 0.1
    there = checked(guard, gone, Pose2D(0.0, -0.1), now_s=2.0)
    assert there.command == Twist2D() and not there.evades
    assert checked(guard, gone, Pose2D(0.0, -0.1), now_s=2.1).command is None


def test_a_robot_that_follows_a_plan_turns_to_it_while_it_evades(guard):
    plan = np.column_stack([np.zeros(41), np.linspace(0.0, 4.0, 41), np.zeros(41)])
    tick = checked(guard, one_track(1.2, 0.1, -1.0, 0.0), plan=plan, command=Twist2D())
    assert tick.evades and tick.command.vyaw_radps == 1.0  # a quarter turn, at most 1 rad/s


def test_a_robot_that_looks_all_around_turns_steadily_while_it_evades(guard):
    guard.params = replace(guard.params, glance_rad=3.1416)
    plan = np.column_stack([np.linspace(0.0, 4.0, 41), np.zeros(41), np.zeros(41)])
    tick = checked(guard, one_track(1.2, 0.1, -1.0, 0.0), plan=plan, command=Twist2D())
    assert tick.evades and tick.command.vyaw_radps == 1.0  # though it faces the way


@pytest.mark.parametrize(
    "planner, expected",
    [
        ({"TrajectoryPlannerROS": {"holonomic_robot": False}}, None),
        (
            {
                "TrajectoryPlannerROS": {
                    "holonomic_robot": True,
                    "max_vel_x": 0.4,
                    "max_vel_theta": 0.9,
                }
            },
            SpeedLimits(0.4, 0.9),
        ),
        (
            {
                "base_local_planner": "dwa_local_planner/DWAPlannerROS",
                "DWAPlannerROS": {"max_vel_y": 0.0, "min_vel_y": 0.0},
            },
            None,
        ),
    ],
)
def test_only_robots_that_fly_sideways_evade(planner, expected):
    configuration = load({**planner, "global_costmap": {"static_map": True}})
    assert speed_limits(configuration.local_planner) == expected


def test_a_robot_evades_faster_than_it_flies_where_that_is_allowed(guard):
    """Something as fast as 1 m/s comes along the x axis, 1.2 m away: 1 m/s sideways avoids it."""
    track = one_track(1.2, 0.1, -1.0, 0.0)
    slow = checked(guard, track).command
    assert np.hypot(slow.vx_mps, slow.vy_mps) == pytest.approx(0.5)
    guard.params = EvasionParams(avoid_moving_obstacles=True, speed_mps=1.0)
    fast = checked(guard, track).command
    assert np.hypot(fast.vx_mps, fast.vy_mps) == pytest.approx(1.0)
    guard.params = EvasionParams(avoid_moving_obstacles=True, speed_mps=0.2)
    still = checked(guard, track).command
    assert np.hypot(still.vx_mps, still.vy_mps) == pytest.approx(0.5)
