"""The cheapest sample is found without scoring all; it is the one that scoring all gives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_nav.control.rollout import Rollout
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import FREE, LETHAL, GridSpec

PARAMS = TrajectoryPlannerParams(holonomic_robot=False)
FOOTPRINT = np.array([[0.2, 0.15], [-0.2, 0.15], [-0.2, -0.15], [0.2, -0.15]])
WINDOW = GridSpec(60, 60, 0.05, -1.5, -1.5)
VARIANTS = {
    "defaults": PARAMS,
    "costs outweigh the path": replace(PARAMS, occdist_scale=1.0),
    "high costs are sought": replace(PARAMS, occdist_scale=-0.5),
    "heading": replace(PARAMS, heading_scoring=True),
    "a simple attractor": replace(PARAMS, simple_attractor=True),
}


def random_rollout(seed, params):
    random = np.random.default_rng(seed)
    costs = np.zeros(WINDOW.shape, np.uint8)
    for _ in range(random.integers(0, 12)):
        y, x = random.integers(0, 56, 2)
        costs[y : y + 4, x : x + 4] = random.choice([40, 120, 252, LETHAL])
    costs[24:36, 24:36] = FREE
    goal = random.uniform(-1.2, 1.2, 2)
    plan = np.column_stack(
        (np.linspace(0.0, goal[0], 30), np.linspace(0.0, goal[1], 30), np.zeros(30))
    )
    return Rollout(
        params,
        WINDOW,
        costs,
        FOOTPRINT,
        plan,
        Pose2D(0.0, 0.0, random.uniform(-math.pi, math.pi)),
        Twist2D(random.uniform(0.0, 0.3), 0.0, random.uniform(-1.0, 1.0)),
    )


def samples():
    return np.array(
        [
            (vx, vy, vtheta)
            for vx in np.linspace(0.0, 0.5, 8)
            for vy in (0.0, 0.1)
            for vtheta in np.linspace(-1.0, 1.0, 9)
        ]
    )


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_cheapest_is_that_of_all_scores(variant):
    illegal = 0
    for seed in range(12):
        rollout = random_rollout(seed, VARIANTS[variant])
        costs, _ = rollout.score(samples())
        legal = np.where(costs >= 0.0, costs, np.inf)
        illegal += np.count_nonzero(costs < 0.0)
        k = int(np.argmin(legal))
        expected = (k, costs[k]) if costs[k] >= 0.0 else None
        assert rollout.cheapest(samples()) == expected
    assert illegal > 50


def test_costs_up_to_a_limit_are_those_without_one():
    left_out = 0
    for seed in range(12):
        rollout = random_rollout(seed, PARAMS)
        costs, ends = rollout.score(samples())
        limit = float(np.median(costs))
        limited, limited_ends = rollout.score(samples(), limit)
        scored = np.isfinite(limited)
        np.testing.assert_array_equal(limited[scored], costs[scored])
        np.testing.assert_array_equal(limited_ends[scored], ends[scored])
        # Those that collide would have cost more than the limit if they did not.
        assert ((costs[~scored] > limit) | (costs[~scored] < 0.0)).all()
        left_out += np.count_nonzero(~scored)
    assert left_out > 250
