"""Sequencers that tick only when they have something to do decide what they would at every tick."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.mission.actions import SendGoal
from quad_nav.mission.flight_log import FlightLog, RobotLog
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import GoalSequence, SequenceSettings
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.navigator.tick import Outcome, State, Tick
from quad_nav.offline.flight_robot import FlightRobot, GoalWatch
from quad_nav.sim.flight import BodyState
from quad_nav.sim.flight_law import planar_states
from quad_nav.sim.robot_state import RobotStates

PERIOD_S = 0.025


def sequence() -> GoalSequence:
    goals = (Goal(1.0, 0.0), Goal(1.0, 1.0, 2.0), Goal(0.0, 0.0, wait_s=0.4))
    return GoalSequence(goals, SequenceSettings(goal_timeout_s=3.0, retries=1))


def fly(seed: int, watched: bool) -> list:
    """Wander about the goals while a navigator takes, ends or loses goals; return all actions."""
    random = np.random.default_rng(seed)
    goals = RobotGoals("quad0", None, sequence())
    robot = FlightRobot(goals, None, FlightLog(["quad0"], 0.3))
    watch, told = GoalWatch([robot]), []
    x_m = y_m = yaw_rad = 0.0
    is_busy = False
    for k in range(4000):
        now_s = k * PERIOD_S
        target = robot.sequencer.active_goal
        if target is not None:
            x_m += 0.02 * np.sign(target.pose.x_m - x_m) + random.normal(0.0, 0.01)
            y_m += 0.02 * np.sign(target.pose.y_m - y_m) + random.normal(0.0, 0.01)
        yaw_rad += random.normal(0.0, 0.05)
        poses = np.array([[x_m, y_m, yaw_rad]])
        if not watched or watch.due(now_s, poses):
            actions = robot.tick_sequencer(now_s, Pose2D(x_m, y_m, yaw_rad))
            watch.update(0)
            told += [(k, action) for action in actions]
        if k % 4:
            continue
        tick = Tick(now_s, State.CONTROLLING if is_busy or robot.goal_waits else State.IDLE)
        is_busy = tick.state is not State.IDLE
        chance = random.random()
        if is_busy and chance < 0.02:
            tick.outcome = Outcome(chance < 0.01, "over")
        if is_busy and chance < 0.03:  # with no outcome, the goal is lost
            tick.state, is_busy = State.IDLE, False
        if robot.update(tick, False):
            watch.update(0)
    return told


@pytest.mark.parametrize("seed", range(6))
def test_the_watch_misses_nothing(seed):
    every, watched = fly(seed, False), fly(seed, True)
    assert watched == every
    assert any(isinstance(one, SendGoal) and one.resend_reason for _, one in every)


def test_a_robot_is_due_at_its_goal_and_at_its_time_out():
    robot = FlightRobot(
        RobotGoals("quad0", None, sequence()),
        None,
        FlightLog(["quad0"], 0.3),
    )
    watch = GoalWatch([robot])
    far, near = np.array([[3.0, 0.0, 0.0]]), np.array([[1.0 + 0.99 * 0.25, 0.0, 0.0]])
    assert watch.due(0.0, far) == [0]  # the first goal is to be sent
    robot.tick_sequencer(0.0, Pose2D(3.0, 0.0))
    robot.update(Tick(0.0, State.CONTROLLING), False)
    watch.update(0)
    assert watch.due(2.9, far) == [] and watch.due(3.0, far) == [0]
    assert robot.sequencer.sequence.tolerance_m(Goal(1.0, 0.0)) >= 0.25
    assert watch.due(0.1, near) == [0]


def test_a_step_of_known_length_and_turn():
    """0.3 m in a second, then half a turn on the spot in two seconds."""
    log = RobotLog("quad0")
    log.add_action(SendGoal(0, 1, Pose2D(1.0, 0.0), 1))
    log.add_track([0.0, 1.0, 3.0], [[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.3, 0.0, math.pi]])
    assert log.path_length_m == pytest.approx(0.3) and log.spin_s == 2.0


def test_planar_states_are_those_of_the_poses_bit_for_bit():
    random = np.random.default_rng(1)
    rows = random.normal(size=(200, 13))
    rows[:, 3:7] /= np.linalg.norm(rows[:, 3:7], axis=1, keepdims=True)
    states, planar = RobotStates(BodyState(rows)), np.empty((200, 8))
    planar_states(rows, planar)
    for state, found in zip(states, planar.tolist()):
        pose, twist = state.map_from_base.to_2d(), state.twist
        assert isinstance(state.map_from_base, Pose3D)
        assert found == [
            pose.x_m,
            pose.y_m,
            pose.yaw_rad,
            twist.vx_mps,
            twist.vy_mps,
            twist.vyaw_radps,
            *pose.rotate(twist.vx_mps, twist.vy_mps),
        ]
    assert np.array_equal(states.planar, planar)
