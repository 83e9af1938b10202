"""The best sample is found without scoring all; it is the one that scoring all gives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_nav.control.lanes import OFF_MAP, UNCERTAIN
from quad_nav.control.oscillation import Oscillation
from quad_nav.control.rollout import Rollout
from quad_nav.control.rollout_kernel import cheapest
from quad_nav.control.sample_motion import RolloutParams, last_cells, longest, travel
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.control.velocity_search import (
    NO_SAMPLE,
    VelocityWindow,
    sample_rules,
    search,
    spaced,
)
from quad_nav.costmap.cost_grid_kernel import CostmapView
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
        expected = (k, costs[k]) if costs[k] >= 0.0 else (-1, np.inf)
        assert cheapest(rollout.inputs, samples()) == expected
    assert illegal > 50


@pytest.mark.parametrize("holonomic", [False, True])
@pytest.mark.parametrize("forwards", [False, True])
def test_the_search_finds_what_scoring_every_sample_finds(holonomic, forwards):
    params = replace(PARAMS, holonomic_robot=holonomic, vx_samples=5, vtheta_samples=9)
    params = replace(params, min_in_place_vel_theta_radps=0.4, heading_lookahead_m=0.3)
    rules = sample_rules(params, Oscillation(escaping=not forwards, stuck_right=holonomic))
    turned = 0
    for seed in range(20):
        rollout = random_rollout(seed, PARAMS)
        window = VelocityWindow(0.05, 0.5 if seed % 2 else 0.05, -1.0, 1.0)
        found = search(rollout.inputs, window, rules)
        assert found == scored_one_by_one(rollout, window, rules)
        turned += found[0][0] == 0.0 and found[1] != NO_SAMPLE
    assert turned > 5


def scored_one_by_one(rollout, window, rules):
    """The rules of ``control/velocity_search.py``, sample by sample."""
    thetas, step = spaced(window.min_vtheta_radps, window.max_vtheta_radps, rules.vtheta_samples)
    speeds, _ = spaced(window.min_vx_mps, window.max_vx_mps, rules.vx_samples)
    sample, cost, facing = (0.0, 0.0, 0.0), NO_SAMPLE, math.inf
    forward = [(vx, 0.0, vtheta) for vx in speeds for vtheta in [0.0, *thetas[:-1]]]
    forward += [(0.1, 0.1, 0.0), (0.1, -0.1, 0.0)] if rules.holonomic else []
    for tried in forward if rules.goes_forward else []:
        of_this = rollout.trajectory(tried).cost
        if of_this >= 0.0 and (cost == NO_SAMPLE or of_this < cost):
            sample, cost = tried, of_this
    for theta in thetas:
        if (rules.stuck_left if theta < 0.0 else rules.stuck_right) or abs(theta) <= step:
            continue
        turn = (0.0, 0.0, math.copysign(max(abs(theta), rules.slowest_turn_radps), theta))
        trajectory = rollout.trajectory(turn)
        if trajectory.cost < 0.0 or (
            cost != NO_SAMPLE and sample[1] == 0.0 < trajectory.cost - cost
        ):
            continue
        ahead = Pose2D(*trajectory.points[-1]).transform(rules.lookahead_m, 0.0)
        distance = rollout.goal_distance_at(*ahead)
        if distance is not None and distance < facing:
            sample, cost, facing = turn, trajectory.cost, float(distance)
    return sample, cost, facing


def test_last_cells_are_those_of_the_trajectories():
    random = np.random.default_rng(3)
    size_y, size_x = WINDOW.shape
    costmap = CostmapView(np.zeros(WINDOW.shape, np.uint8), -1.5, -1.5, 0.05)
    found = []
    for _ in range(60):
        params = RolloutParams(
            *random.uniform((0.5, 0.01, 0.01, 0.0, 0.0, 0.0), (3.0, 0.1, 0.2, 4.0, 4.0, 4.0)),
            *(1.0, 1.0, 1.0, False, 0.1, False),
        )
        pose = tuple(random.uniform((-1.5, -1.5, -4.0), (1.5, 1.5, 4.0)))
        velocity = tuple(random.uniform(-0.6, 0.6, 3))
        tried = random.uniform(-1.0, 1.0, (21, 3))
        tried[::3, 1] = 0.0
        points = np.empty((longest(params, tried), 3))
        cells = last_cells(params, costmap, pose, velocity, tried)
        for sample, cell in zip(tried, cells):
            last = points[travel(params, pose, velocity, sample, points) - 1]
            x, y = np.floor((last[:2] + 1.5) / 0.05).astype(int)
            on_map = 0 <= x < size_x and 0 <= y < size_y
            assert cell in (UNCERTAIN, y * size_x + x if on_map else OFF_MAP)
        found.extend(cells)
    assert np.count_nonzero(np.equal(found, UNCERTAIN)) < 0.01 * len(found)
    assert np.count_nonzero(np.equal(found, OFF_MAP)) > 50
