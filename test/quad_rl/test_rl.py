"""Environments for reinforcement learning: their interfaces, rewards, seeds and flights."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test, parallel_seed_test

import quad_nav
from quad_nav.errors import InputError
from quad_nav.recording.trace import TraceObserver
from quad_rl import FleetEnv, QuadEnv, default_reward
from quad_rl.task import Progress

ROOT = Path(__file__).resolve().parents[2]
NEAR = [[2.6, 1.8]]  # 1.1 m ahead of the start (1.5, 1.5) of the arena
PERIOD_S = 0.025  # every command of a navigator at its own time
AHEAD = np.array([0.5, 0.0, 0.0], np.float32)
BACK = np.array([-1.0, 0.0, 0.0], np.float32)
SIMULATION = quad_nav.lidar_simulation(beams=64, range_noise_m=0.01, jitter_m=0.2)


@pytest.fixture(scope="module")
def setup():
    return quad_nav.prepare(goals=[NEAR], seed=3, simulation=SIMULATION)


@pytest.fixture(scope="module")
def fleet_setup():
    return quad_nav.prepare(goals=[NEAR, [[9.4, 2.3]]], seed=3, simulation=SIMULATION)


@pytest.fixture(scope="module")
def env(setup):
    environment = QuadEnv(setup)
    yield environment
    environment.close()


def test_gymnasium_finds_no_fault(env):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env)
    texts = [str(one.message) for one in caught]
    # Velocities have units, and an environment that is not registered has no modes to try.
    known = ("symmetric and normalized space", "not having a spec")
    assert [text for text in texts if not any(part in text for part in known)] == []


def test_pettingzoo_finds_no_fault(fleet_setup):
    environment = FleetEnv(fleet_setup)
    parallel_api_test(environment, num_cycles=300)
    environment.close()
    parallel_seed_test(lambda: FleetEnv(fleet_setup), num_cycles=50)


def flown_rows(environment, actions, seed=3):
    environment.reset(seed=seed)
    rows = [environment.world.bodies().rows.copy()]
    for action in actions:
        ended = environment.step(action)[2]
        rows.append(environment.world.bodies().rows.copy())
        if ended:
            break
    return np.array(rows)


def test_commands_of_a_flight_as_actions_fly_the_same_flight(setup):
    """The actions of a flight with navigator, in an environment without."""
    trace = TraceObserver()
    flown = quad_nav.fly(setup, [trace])
    (robot,) = trace.trace().robots
    commands = {at_s: row for at_s, row in zip(robot.command_times_s, robot.commands)}
    times_s = flown.column(0, "time_s")
    environment = QuadEnv(setup, period_s=PERIOD_S)
    rows = flown_rows(environment, [commands.get(at_s) for at_s in times_s[:-1]])
    environment.close()
    assert len(times_s) > 100
    assert np.array_equal(rows[:, 0, :7], flown.trajectories[0][:, 1:8])


def test_the_navigators_actions_fly_the_flight_of_quad_fly(setup):
    flown = quad_nav.fly(setup)
    environment = QuadEnv(setup, navigator=True, period_s=PERIOD_S)
    environment.reset(seed=3)
    ended = False
    while not ended:
        _, _, ended, late, _ = environment.step(environment.navigator_action())
        assert not late
    trajectories = environment.world.flight.result().trajectories
    environment.close()
    assert np.array_equal(trajectories[0], flown.trajectories[0])


def test_episodes_follow_from_their_seeds(env):
    actions = [AHEAD] * 10
    first, other = flown_rows(env, actions, 5), flown_rows(env, actions, 6)
    assert not np.array_equal(first[0], other[0])
    assert np.array_equal(flown_rows(env, actions, 5), first)
    following = [env.reset()[0]["pose"] for _ in range(3)]
    env.reset(seed=5)
    assert np.array_equal([env.reset()[0]["pose"] for _ in range(3)], following)
    assert len({tuple(pose) for pose in following}) == 3


def test_an_episode_after_a_contact_is_that_of_a_new_environment(env, setup):
    env.reset(seed=1)
    while not env.step(BACK)[2]:
        pass
    new = QuadEnv(setup)
    again, fresh = flown_rows(env, [BACK] * 60, 2), flown_rows(new, [BACK] * 60, 2)
    new.close()
    assert np.array_equal(again, fresh)
    assert len(again) < 61  # the engine moved it last, up to the wall


def test_contact_ends_the_episode_and_costs(env):
    env.reset(seed=3)
    rewards = []
    ended = False
    while not ended:
        _, reward, ended, _, info = env.step(BACK)
        rewards.append(reward)
    assert info == {"reached": 0, "contacts": 1}
    assert rewards[-1] < -10.0 < min(rewards[:-1])


def test_rewards_add_up_to_the_way_and_the_goal(env):
    seen, _ = env.reset(seed=3)
    start_m = np.hypot(*seen["goal"])
    total, steps, ended = 0.0, 0, False
    while not ended:
        bearing = np.arctan2(seen["goal"][1], seen["goal"][0])
        action = np.array([0.5 * np.cos(bearing), 0.5 * np.sin(bearing), 0.0])
        before_m = np.hypot(*seen["goal"])
        seen, reward, ended, late, info = env.step(action)
        total, steps = total + reward, steps + 1
    assert info["reached"] == 1 and not late
    assert total == pytest.approx(start_m - before_m + 10.0 - 0.01 * steps, abs=1e-4)


def test_rewards_can_be_overridden(setup):
    class Own(QuadEnv):
        def reward(self, progress):
            return 3.0 * default_reward(progress)

    environment = Own(setup)
    environment.reset(seed=3)
    progress = Progress(0.0, 0, 0, False)
    assert environment.step(np.zeros(3))[1] == pytest.approx(3 * default_reward(progress), abs=0.1)
    environment.close()


def test_observations_are_in_the_robots_frame(setup):
    turned = quad_nav.prepare(goals=[NEAR], seed=3)
    environment = QuadEnv(turned)
    seen, _ = environment.reset(seed=3)
    start = turned.scene.starts[0]
    goal = quad_nav.Pose2D(*NEAR[0]).relative_to(start)
    assert np.allclose(seen["goal"], [goal.x_m, goal.y_m], atol=1e-5)
    assert np.allclose(seen["pose"], [start.x_m, start.y_m, start.yaw_rad], atol=1e-6)
    for _ in range(20):
        seen = environment.step(np.array([0.0, 0.3, 0.0]))[0]
    assert np.allclose(seen["velocity"], [0.0, 0.3, 0.0], atol=0.02)
    assert seen["lidar"].shape == (512,) and seen["lidar"].max() <= 60.0
    environment.close()


def test_goals_of_an_episode_can_be_given(env):
    given, _ = env.reset(seed=3, options={"goals": [[[1.5, 4.0]]]})
    usual, _ = env.reset(seed=3)
    assert np.hypot(*given["goal"]) == pytest.approx(np.hypot(*(given["pose"][:2] - [1.5, 4.0])))
    assert not np.array_equal(given["goal"], usual["goal"])
    with pytest.raises(InputError, match="options: quad0: goals.0."):
        env.reset(options={"goals": [[[1.5]]]})


def test_a_robot_that_touched_hovers_while_the_others_fly(fleet_setup):
    environment = FleetEnv(fleet_setup)
    environment.reset(seed=3)
    while "quad0" in environment.agents:
        environment.step({"quad0": BACK, "quad1": np.zeros(3)})
    ended_at = environment.world.bodies().positions_m[0].copy()
    for _ in range(20):
        seen, rewards, *_ = environment.step({"quad1": np.array([0.1, 0.0, 0.0])})
    assert set(seen) == set(rewards) == {"quad1"}
    assert np.linalg.norm(environment.world.bodies().positions_m[0] - ended_at) < 0.3
    environment.close()


def test_parameters_as_actions_change_the_navigator(setup):
    ranges = {"TrajectoryPlannerROS/max_vel_x": (0.1, 0.6)}
    environment = QuadEnv(setup, "parameters", ranges, period_s=0.5)
    assert environment.action_space.low.tolist() == [np.float32(0.1)]
    speeds = []
    for limit_mps in (0.1, 0.5):
        environment.reset(seed=3)
        environment.step(np.array([limit_mps]))
        seen, *_ = environment.step(np.array([limit_mps]))
        speeds.append(float(np.hypot(*seen["velocity"][:2])))
    environment.close()
    assert speeds[0] < 0.13 < 0.2 < speeds[1]


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"action": "speed"}, "action: 'speed'; expected 'velocity' or 'parameters'"),
        ({"action": "parameters"}, "parameters: {} with action 'parameters'; expected ranges"),
        ({"parameters": {"a": (0, 1)}}, "with action 'velocity'; expected ranges"),
        ({"period_s": 0.03}, "period_s: 0.03; expected a multiple of 0.025 s"),
    ],
)
def test_arguments_that_do_not_fit_are_refused(arguments, message, setup):
    with pytest.raises(ValueError) as caught:
        QuadEnv(setup, **arguments)
    assert message in str(caught.value)


def test_episodes_end_at_the_time_limit_and_steps_need_one(setup):
    environment = QuadEnv(setup, time_limit_s=0.2)
    for _ in range(2):
        with pytest.raises(ValueError, match="there is no episode; expected a call of reset"):
            environment.step(np.zeros(3))
        environment.reset(seed=3)
        ends = [environment.step(np.zeros(3))[2:4] for _ in range(2)]
        assert ends == [(False, False), (False, True)]
    environment.close()


def test_actions_that_cannot_be_flown_are_refused(env):
    env.reset(seed=3)
    with pytest.raises(ValueError, match="quad0: action .*; expected .vx, vy, vyaw., m/s"):
        env.step(np.zeros(2))
    with pytest.raises(ValueError, match="quad0: command is not finite"):
        env.step(np.array([0.0, np.nan, 0.0]))
    with pytest.raises(ValueError, match="there are no navigators; expected navigator=True"):
        env.navigator_action()
