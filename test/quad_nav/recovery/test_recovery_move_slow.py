"""Recovery MoveSlowAndClear: cleared area, limited parameters and duration of the limit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from costmap_maps import drawn, picture

from quad_nav.config import load
from quad_nav.control.trajectory_planner import TrajectoryPlannerParams
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layered import CostmapParams, LayeredCostmap
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.navigator import Navigator
from quad_nav.navigator.parameter_limiter import ParameterLimiter
from quad_nav.navigator.tick import RobotPoses, State
from quad_nav.recovery import (
    MoveSlowAndClear,
    MoveSlowAndClearParams,
    ParameterLimit,
    RecoveryContext,
)
from quad_nav.scenario.assembly import build_navigator

HERE = Pose2D(2.5, 2.5)
LIMIT = ParameterLimit(
    (("max_vel_x_mps", 0.25), ("max_vel_theta_radps", 0.45), ("min_vel_theta_radps", 0.45)),
    distance_m=0.3,
)


@dataclass
class Controller:
    params: TrajectoryPlannerParams

    def set_params(self, params):
        self.params = params


def costmap_of(size_m=6.0, **layers):
    layers = layers or {"laser": ObstacleLayerParams(), "inflation": InflationLayerParams()}
    return LayeredCostmap(
        CostmapParams(
            width_m=size_m, height_m=size_m, resolution_m=1.0, layers=tuple(layers.items())
        )
    )


def full(costmap):
    costmap.layers["laser"].grid.costs[...] = 254
    costmap.update(0.0, Pose2D(0.0, 0.0))
    return costmap


def test_the_square_around_the_robot_is_cleared_in_layer_and_master():
    local = full(costmap_of())
    around = RecoveryContext(0.0, full(costmap_of()), local, HERE, HERE)
    step = MoveSlowAndClear(MoveSlowAndClearParams(clearing_distance_m=1.0)).step(around)
    assert step.done and step.command is None
    assert picture(local.layers["laser"].grid.costs) == drawn("""######
                                                                 ######
                                                                 #...##
                                                                 #...##
                                                                 #...##
                                                                 ######""")
    assert not local.is_current(0.0)
    window = local.update(0.0, Pose2D(0.0, 0.0))
    assert (window.x0, window.xn, window.y0, window.yn) == (0, 5, 0, 5)  # one cell of inflation
    assert local.costs[2, 2] < 254 and local.costs[4, 4] == 254
    assert around.global_costmap.layers["laser"].grid.costs[2, 2] == 0


def test_costmaps_that_cannot_be_cleared_are_reported():
    blind = costmap_of(inflation=InflationLayerParams())
    small = full(costmap_of(size_m=3.0))
    step = MoveSlowAndClear(MoveSlowAndClearParams(translation_fields=("max_vel_x_mps",))).step(
        RecoveryContext(0.0, small, blind, Pose2D(2.75, 1.0), Pose2D(0.5, 0.5))
    )
    why = "it has no obstacle layer or ends within 0.5 m of the robot"
    assert step.message.split("; ") == [
        f"global costmap not cleared: {why}",
        f"local costmap not cleared: {why}",
        "limiting speed to 0.25 m/s and 0.45 rad/s for the next 0.3 m",
    ]
    assert (small.layers["laser"].grid.costs == 254).all()


def test_at_an_unknown_pose_nothing_is_cleared_or_limited():
    costmap = full(costmap_of())
    step = MoveSlowAndClear(MoveSlowAndClearParams()).step(
        RecoveryContext(0.0, costmap, costmap, None, None)
    )
    assert step.done and step.limit is None
    assert step.message.count("robot pose unknown") == 2
    assert (costmap.layers["laser"].grid.costs == 254).all()


def test_a_limit_never_raises_a_speed():
    controller = Controller(TrajectoryPlannerParams(max_vel_x_mps=0.1))
    ParameterLimiter(controller).impose(LIMIT, HERE, 0.0)
    assert controller.params.max_vel_x_mps == 0.1


def test_parameters_that_change_under_a_limit_take_effect_with_its_end():
    controller = Controller(TrajectoryPlannerParams())
    speed = ParameterLimiter(controller)
    speed.impose(LIMIT, HERE, 0.0)
    speed.set_params(TrajectoryPlannerParams(max_vel_x_mps=2.0, sim_time_s=1.0))
    assert (controller.params.max_vel_x_mps, controller.params.sim_time_s) == (0.25, 1.0)
    speed.lift()
    assert controller.params == TrajectoryPlannerParams(max_vel_x_mps=2.0, sim_time_s=1.0)
    speed.lift()
    assert controller.params.max_vel_x_mps == 2.0


TREE = {
    "recovery_behaviors": [{"name": "slow", "type": "move_slow_and_clear/MoveSlowAndClear"}],
    "planner_patience": 0.5,
    "controller_frequency": 10.0,
    "TrajectoryPlannerROS": {"max_vel_x": 0.6, "min_vel_x": 0.1},
    "global_costmap": {"width": 6, "height": 6, "resolution": 0.1},
    "local_costmap": {"width": 6, "height": 6, "resolution": 0.1},
}


class Stuck:
    """A navigator that has run its recovery for lack of a plan, and has a plan now."""

    def __init__(self, tree=TREE):
        self.configuration = load(tree, "")
        self.navigator: Navigator = build_navigator(self.configuration)
        self.now_s = 0.0
        self.navigator.global_costmap.layers["obstacle_layer"].grid.costs[:, 40] = 254
        self.navigator.set_goal(Pose2D(5.0, 2.5, 0.0), 0.0)
        self.ticks = self.fly(HERE, 0.8)
        self.navigator.clear_costmaps(self.now_s)

    def fly(self, pose, seconds):
        ticks, end_s = [], self.now_s + seconds
        while self.now_s <= end_s:
            ticks.append(self.navigator.tick(self.now_s, RobotPoses(pose, pose), Twist2D()))
            self.now_s += 0.1
        return ticks

    @property
    def max_vel_x_mps(self):
        return self.navigator.controller.params.max_vel_x_mps


@pytest.fixture
def stuck():
    return Stuck()


def test_the_navigator_limits_its_controller_and_lifts_the_limit(stuck):
    assert [tick.recovery.name for tick in stuck.ticks if tick.recovery] == ["slow"]
    assert "limiting speed to 0.25 m/s and 0.45 rad/s for the next 0.3 m" in [
        warning for tick in stuck.ticks for warning in tick.warnings
    ]
    assert stuck.max_vel_x_mps == 0.25
    stuck.fly(Pose2D(2.7, 2.5), 0.5)
    assert stuck.max_vel_x_mps == 0.25
    stuck.fly(Pose2D(2.9, 2.5), 0.5)
    assert stuck.max_vel_x_mps == 0.6


def test_a_limit_outlives_a_cancelled_goal_and_ends_on_the_path_to_the_next(stuck):
    stuck.navigator.cancel()
    stuck.fly(HERE, 0.3)
    assert stuck.navigator.state is State.IDLE
    stuck.navigator.set_goal(Pose2D(1.0, 2.5, 0.0), stuck.now_s)
    stuck.fly(HERE, 0.3)
    assert stuck.max_vel_x_mps == 0.25
    stuck.fly(Pose2D(2.0, 2.5), 0.3)
    assert stuck.max_vel_x_mps == 0.6


def test_dwa_is_limited_in_all_its_speeds_and_flies_below_them():
    dwa = {
        "base_local_planner": "dwa_local_planner/DWAPlannerROS",
        "DWAPlannerROS": {
            "max_vel_trans": 0.8,
            "max_vel_x": 0.8,
            "min_vel_x": -0.6,
            "max_vel_y": 0.4,
            "min_vel_y": -0.4,
            "max_vel_theta": 2.0,
            "min_vel_theta": 0.5,
        },
    }
    stuck = Stuck({**TREE, **dwa})
    usual = build_navigator(stuck.configuration).controller.params
    slow = replace(
        usual,
        max_vel_trans_mps=0.25,
        max_vel_x_mps=0.25,
        min_vel_x_mps=-0.25,
        max_vel_y_mps=0.25,
        min_vel_y_mps=-0.25,
        max_vel_theta_radps=0.45,
        min_vel_theta_radps=0.45,
    )
    assert stuck.navigator.controller.params == slow
    commands = [tick.command for tick in stuck.fly(Pose2D(2.6, 2.5), 2.0) if tick.control]
    assert 0.0 < max(np.hypot(command.vx_mps, command.vy_mps) for command in commands) <= 0.25
    assert max(abs(command.vyaw_radps) for command in commands) <= 0.45
    stuck.fly(Pose2D(2.9, 2.5), 0.5)
    assert stuck.navigator.controller.params == usual


def test_limits_of_different_parameters_hold_side_by_side():
    controller = SimpleController(Params(speed=0.6, weight=0.01))
    limiter = ParameterLimiter(controller)
    limiter.impose(ParameterLimit((("speed", 0.25),), 1.0), Pose2D(0.0, 0.0), 0.0)
    limiter.impose(ParameterLimit((("weight", 0.001),), 0.5), Pose2D(0.0, 0.0), 0.0)
    assert controller.params == Params(0.25, 0.001)
    assert limiter.usual == Params(0.6, 0.01)
    limiter.track(Pose2D(0.6, 0.0))
    assert controller.params == Params(0.25, 0.01)
    limiter.track(Pose2D(1.1, 0.0))
    assert controller.params == Params(0.6, 0.01)


@dataclass(frozen=True)
class Params:
    speed: float
    weight: float


class SimpleController:
    def __init__(self, params):
        self.params = params

    def set_params(self, params):
        self.params = params


def test_a_clock_that_jumps_back_lifts_the_limit(stuck):
    stuck.navigator.restart(0.0)
    assert stuck.max_vel_x_mps == 0.6
