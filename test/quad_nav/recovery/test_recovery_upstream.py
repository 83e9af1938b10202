"""Recoveries with their fixes off, and what each fix changes."""

from __future__ import annotations

import numpy as np
import pytest
from test_recovery_move_slow import HERE, TREE, Controller, Stuck, costmap_of
from upstream import UPSTREAM

from quad_nav.config import load
from quad_nav.control.trajectory_planner import TrajectoryPlannerParams
from quad_nav.costmap.cost_grid import Square
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.static import StaticLayerParams, StaticMap
from quad_nav.geometry import Pose2D
from quad_nav.grid import LETHAL, UNKNOWN, GridSpec
from quad_nav.navigator.parameter_limiter import ParameterLimiter
from quad_nav.navigator.tick import State
from quad_nav.recovery import (
    ClearCostmap,
    ClearCostmapParams,
    MoveSlowAndClear,
    MoveSlowAndClearParams,
    ParameterLimit,
    RecoveryContext,
)

CORNER = Pose2D(0.5, 0.5)


def full(costmap, *names):
    """The costmap with obstacles in all cells of these layers, drawn; the robot is in a corner."""
    for name in names:
        costmap.layers[name].grid.costs[...] = LETHAL
    costmap.clear_area(names, Square(0.0, 0.0, 0.0), False)  # draws everything
    costmap.update(0.0, CORNER)
    return costmap


def context(costmap, now_s=0.0):
    return RecoveryContext(now_s, costmap, costmap, HERE, HERE)


def layers(*names):
    return {name: ObstacleLayerParams() for name in names}


@pytest.mark.parametrize("fixed, current", [(True, False), (False, True)])
def test_a_cleared_costmap_is_drawn_before_the_robot_moves(fixed, current):
    """Cleared outside of 2 m; upstream's robot may fly by the old costs until the next update."""
    costmap = full(costmap_of(**layers("obstacles")), "obstacles")
    params = ClearCostmapParams(reset_distance_m=2.0, redraw_cleared_costmaps=fixed)
    ClearCostmap(params).step(context(costmap))
    assert costmap.layers["obstacles"].grid.costs[5, 5] == UNKNOWN
    assert costmap.costs[5, 5] == LETHAL
    assert costmap.is_current(0.0) is current
    costmap.update(0.1, CORNER)
    assert costmap.costs[5, 5] == 0 and costmap.is_current(0.1)


@pytest.mark.parametrize("restores", [False, True])
def test_a_cleared_static_layer_stays_unknown_until_the_next_map(restores):
    """Upstream's clear_costmaps does not bring it back; ``restore_static_map`` does."""
    spec = GridSpec(6, 6, 1.0)
    walls = StaticMap(np.full(spec.shape, 100, dtype=np.int8), spec)
    costmap = costmap_of(walls=StaticLayerParams(restore_static_map=restores))
    costmap.set_map(walls)
    costmap.update(0.0, CORNER)
    params = ClearCostmapParams(
        reset_distance_m=2.0,
        layer_names=("walls",),
        force_updating=True,
        affected_maps="global",
        redraw_cleared_costmaps=False,
    )
    ClearCostmap(params).step(context(costmap))
    # The square reaches from 1.5 to 3.5 m; the cells of its border count as outside.
    known = np.argwhere(costmap.layers["walls"].grid.costs != UNKNOWN)
    assert known.tolist() == [[2, 2]]
    costmap.reset_layers(0.1)
    costmap.update(0.1, CORNER)
    assert (costmap.layers["walls"].grid.costs[0, 0] == LETHAL) is np.bool_(restores)
    costmap.set_map(walls)
    costmap.update(0.2, CORNER)
    assert (costmap.costs == LETHAL).all()


def test_move_slow_frees_layers_by_their_names_and_draws_nothing():
    names = ("my_obstacles_2", "obstacle_layer")
    costmap = full(costmap_of(**layers(*names)), *names)
    params = MoveSlowAndClearParams(
        clearing_distance_m=1.0, clear_any_obstacle_layer=False, redraw_cleared_costmaps=False
    )
    MoveSlowAndClear(params).step(context(costmap))
    freed = [int((costmap.layers[name].grid.costs == 0).sum()) for name in names]
    assert freed == [9 + 1, 1]  # and the cell under the robot in its corner
    assert costmap.is_current(0.0)
    window = costmap.update(0.1, CORNER)
    assert (window.xn, window.yn) == (1, 1)
    assert costmap.costs[2, 2] == LETHAL


# -- the limit ---------------------------------------------------------------------------


USUAL = TrajectoryPlannerParams(max_vel_x_mps=0.1)
SETTING = ParameterLimit((("max_vel_x_mps", 0.25),), 0.3, raises=True, check_period_s=0.1)


def test_upstream_looks_at_the_distance_every_tenth_of_a_second():
    planner = Controller(USUAL)
    limiter = ParameterLimiter(planner)
    assert limiter.due_s == np.inf
    limiter.impose(SETTING, HERE, 5.0)
    far = Pose2D(2.9, 2.5)
    assert limiter.due_s == pytest.approx(5.1)
    limiter.check(5.05, far)
    limiter.track(far)  # a control cycle does not look at it
    assert planner.params.max_vel_x_mps == 0.25
    limiter.check(5.1, HERE)
    assert limiter.due_s == pytest.approx(5.2)
    limiter.check(5.2, far)
    assert planner.params == USUAL and limiter.due_s == np.inf


@pytest.mark.parametrize(
    "own, named",
    [
        ({}, ("", "")),  # of DWAPlannerROS, which does not fly here
        ({"planner_namespace": "TrajectoryPlannerROS"}, ("", "")),  # it has no max_trans_vel
        (
            {
                "planner_namespace": "TrajectoryPlannerROS",
                "max_trans_param_name": "max_vel_x",
                "max_rot_param_name": "max_vel_theta",
            },
            ("max_vel_x_mps", "max_vel_theta_radps"),
        ),
    ],
)
def test_the_parameters_that_upstream_sets(own, named):
    ((_, params),) = load({**TREE, "slow": own, **UPSTREAM}, "").recoveries
    assert (params.named_translation_field, params.named_rotation_field) == named
    fields = [field for field, _ in params.limit.greatest]
    assert fields == [field for field in named if field]


def test_an_idle_robot_that_is_moved_gets_its_speed_back():
    """At 1 Hz of control and after the goal: the timer goes on."""
    slow = {
        "planner_namespace": "TrajectoryPlannerROS",
        "max_trans_param_name": "max_vel_x",
        "max_rot_param_name": "max_vel_theta",
    }
    stuck = Stuck({**TREE, "slow": slow, **UPSTREAM})
    assert stuck.max_vel_x_mps == 0.25
    stuck.navigator.cancel()
    stuck.fly(HERE, 0.3)
    assert stuck.navigator.state is State.IDLE
    assert stuck.navigator.next_due_s <= stuck.now_s + 0.1
    stuck.fly(Pose2D(2.9, 2.5), 0.1)
    assert stuck.max_vel_x_mps == 0.6
