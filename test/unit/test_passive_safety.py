"""Passive safety: the robot rests before an obstacle reaches it that leaves its prediction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quad_nav.control.evasion import EvasionParams, Surroundings, evade
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import GridSpec
from quad_nav.kernels.body_response import Body, brake, move_bodies
from quad_nav.kernels.passive_safety import rest_in_time
from quad_nav.kernels.standing_obstacles import MARGIN_M, StandingObstacles
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.simulation import Simulation
from quad_nav.tracking.motion_memory import MotionMemory
from quad_nav.tracking.tracks import Tracks

PERIOD_S = 0.02
BODY = Body(20.0, 1e-3, 2.0)  # it brakes with 2 m/s^2 down to 0.05 m/s
OPEN = StandingObstacles(np.full((1, 1), MARGIN_M), -50.0, -50.0, 100.0)
AHEAD, HOVER = [1.0, 0.0], [0.0, 0.0]
PEOPLE = EvasionParams(True, clearance_m=0.1, speed_mps=2.0, deviation_mps=0.5)


def rests(gap_m, command, vx_mps=0.0, deviation_mps=0.5, standing=OPEN, speed_mps=1.0):
    """An obstacle of 0.5 m, with the robot's radius, before a robot that holds 0.2 s."""
    times_s = PERIOD_S * np.arange(101)
    discs = np.tile([gap_m + 0.5, 0.0, 0.5, 0.1], (101, 1, 1))
    discs[:, 0, 0] += vx_mps * times_s
    start, commands = (speed_mps, 0.0, 0.0, 0.0), np.array([command])
    found = rest_in_time(BODY, discs, PERIOD_S, deviation_mps, standing, start, commands, 10)
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


def command_of(params, tracks, velocity=None, wish=None, period_s=0.1, last_mps=None):
    spec = GridSpec(160, 160, 0.05, -4.0, -4.0)
    velocity, costs = velocity or Twist2D(), np.zeros(spec.shape, np.uint8)
    here, memory = Pose2D(0.0, 0.0), MotionMemory()
    around = Surroundings(spec, costs, here, velocity, 0.35, 2.0, 0.5, True, memory)
    around = replace(around, period_s=period_s)
    last = (velocity.vx_mps if last_mps is None else last_mps), velocity.vy_mps
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
    """With 2 m/s^2: 0.64 m/s below its velocity, at 3.125 /s, and 0.15 m/s for the next 0.15 s."""
    velocity = Twist2D(vx_mps=1.2, vy_mps=-1.6)
    command = command_of(PEOPLE, person(1.2, 0.0, -1.2, 0.0), velocity)
    assert (command.vx_mps, command.vy_mps) == pytest.approx((1.21 * 0.6, -1.21 * 0.8))


def braking(velocity, acceleration):
    """The command, m/s, to a body that brakes with 2 m/s^2 and has a lag of 0.08 s."""
    body, command = Body(3.125, 0.08, 2.0), np.empty((1, 2))
    moving = np.array([0.0, 0.0, *velocity, *acceleration]).reshape(6, 1)
    brake(body, moving, 0.1, command)
    return command[0].tolist()


def test_braking_is_gone_with_the_velocity():
    assert braking((0.6, -0.8), (0.0, 0.0)) == pytest.approx([0.6 * 0.26, -0.8 * 0.26])
    # 1 m/s^2 takes 0.1 m/s in 0.1 s: 0.32 m/s below 0.05 m/s, the mean of that time
    assert braking((0.1, 0.0), (0.0, 0.0)) == pytest.approx([0.05 - 1.0 / 3.125, 0.0])
    # an acceleration of -1.25 m/s^2 that fades takes it too
    assert braking((0.1, 0.0), (-1.25, 0.0)) == pytest.approx([0.1, 0.0])


def test_a_body_that_brakes_at_10_hz_rests_and_does_not_fly_back():
    """From 1 m/s with 2 m/s^2 and a lag of 0.08 s: 0.58 s."""
    body, moving, command = Body(3.125, 0.08, 2.0), np.zeros((6, 1)), np.empty((1, 2))
    moving[2] = 1.0
    speeds_mps = []
    for _ in range(10):
        brake(body, moving, 0.1, command)
        for _ in range(5):
            move_bodies(body, moving, command, 0.02)
            speeds_mps.append(float(moving[2, 0]))
    assert speeds_mps[27] > 0.05
    assert np.abs(speeds_mps[34:]).max() < 0.05
    assert min(speeds_mps) > -0.02


def test_a_slower_control_cycle_needs_more_room():
    """0.8 m to a person who stands: 0.22 m to rest in 0.5 s at 10 Hz; 0.9 m in 1.8 s at 1 Hz."""
    wish, ahead = Twist2D(vx_mps=0.5), person(1.4, 0.0, 0.0, 0.0)
    assert command_of(PEOPLE, ahead, wish, wish) is wish
    assert command_of(PEOPLE, ahead, wish, wish, period_s=1.0).vx_mps < 0.0


@pytest.mark.parametrize("speed_mps, rests_s", [(0.5, 0.38), (1.0, 0.62)])
def test_a_simulated_quadcopter_brakes_without_flying_back(speed_mps, rests_s):
    """Commands at 10 Hz, of velocities that are 25 ms old: rests_s are recorded."""
    scene = Scene("hall", 20.0, 20.0, 1.0, Walls(), (), (Pose2D(5.0, 10.0),))
    simulation, speeds_mps = Simulation(scene, 1), []

    def fly(vx_mps, steps):
        simulation.set_command(0, Twist2D(vx_mps=vx_mps))
        for _ in range(steps):
            simulation.step()
            speeds_mps.append(simulation.state(0).twist.vx_mps)

    for _ in range(12):
        fly(speed_mps, 24)
    command, late, begin = speed_mps, 6, len(speeds_mps)
    for _ in range(10):
        before, moving = command, simulation.state(0).twist.vx_mps
        fly(before, late)
        everywhere = person(0.5, 0.0, -2.0, 0.0)
        velocity = Twist2D(vx_mps=moving)
        command = command_of(PEOPLE, everywhere, velocity, last_mps=before).vx_mps
        fly(command, 24 - late)
    simulation.close()
    late_mps = np.array(speeds_mps[begin:])
    assert np.flatnonzero(late_mps > 0.05)[-1] / 240.0 == pytest.approx(rests_s, abs=0.03)
    assert late_mps.min() > -0.05


def test_a_person_far_away_leaves_the_wish_as_it_is():
    wish = Twist2D(vx_mps=0.5)
    assert command_of(PEOPLE, person(4.0, 3.0, 0.0, 1.0), wish=wish) is wish
