"""A navigator with fake planners, and a clock that stops wherever something is due."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from upstream import UPSTREAM

from quad_nav.config import load
from quad_nav.errors import NoPath, NoValidTrajectory
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import GridSpec
from quad_nav.navigator.command_filter import VoronoiCell
from quad_nav.navigator.navigator import Navigator
from quad_nav.navigator.tick import RobotPoses
from quad_nav.peers.coordinator import PeerCoordinator
from quad_nav.recovery import Step

HERE = Pose2D(1.0, 1.0, 0.0)
GOAL = Pose2D(5.0, 1.0, 0.0)
FORWARD = Twist2D(vx_mps=0.3)


@dataclass
class CostmapParams:
    update_frequency_hz: float
    rolling_window: bool = False


class FakeCostmap:
    def __init__(self, update_frequency_hz):
        self.params = CostmapParams(update_frequency_hz)
        self.spec = GridSpec(10, 10, 1.0)
        self.costs = np.zeros((10, 10), dtype=np.uint8)
        self.footprint = np.zeros((0, 2))
        self.inscribed_radius_m = self.circumscribed_radius_m = 0.0
        self.layers = {}
        self.updates = []
        self.stale = []

    def update(self, now_s, pose):
        self.updates.append(now_s)
        return (0, 0, 0, 0)

    def is_current(self, now_s):
        return not self.stale

    def stale_sources(self, now_s):
        return self.stale


class FakePlanner:
    def __init__(self):
        self.fails, self.error = False, NoPath("walled in")
        self.calls, self.corner = 0, None

    def make_plan(self, spec, costs, start, goal):
        self.calls += 1
        if self.fails:
            raise self.error
        by_way_of = [] if self.corner is None else [self.corner]
        ends = [start.x_m, start.y_m, 0.0], [goal.x_m, goal.y_m, goal.yaw_rad]
        return np.array([ends[0], *by_way_of, ends[1]])


@dataclass(frozen=True)
class Weights:
    occdist_scale: float


class FakeController:
    def __init__(self):
        self.fails = False
        self.reached = False
        self.plans = []
        self.command = FORWARD

    def set_plan(self, plan):
        self.plans.append(plan)

    def set_params(self, params):
        self.params = params

    def is_goal_reached(self):
        return self.reached

    def compute_velocity(self, spec, costs, pose, velocity, local_from_plan):
        if self.fails:
            raise NoValidTrajectory("everything collides")
        return type("Control", (), {"command": self.command})()


class FakeRecovery:
    def __init__(self, steps=1, period_s=0.05):
        self.period_s = period_s
        self.steps = steps
        self.started = 0

    def start(self, context):
        self.started += 1
        self.left = self.steps

    def step(self, context):
        self.left -= 1
        return Step(command=Twist2D(vyaw_radps=1.0), done=self.left == 0)


ALONE = {"peers": {"avoid_peers": False}}


class Flight:
    """A navigator, its fakes, and a clock that stops wherever something is due.

    It behaves as upstream, or with the parameters of the tree that is given.
    """

    def __init__(self, recoveries=(), tree=UPSTREAM, filters=None, **params):
        params.setdefault("controller_frequency_hz", 10.0)
        configuration = load(tree)
        self.global_costmap = FakeCostmap(5.0)
        self.local_costmap = FakeCostmap(4.0)
        self.planner, self.controller = FakePlanner(), FakeController()
        self.navigator = Navigator(
            replace(configuration.navigator, **params),
            self.global_costmap,
            self.local_costmap,
            self.planner,
            self.controller,
            recoveries,
            PeerCoordinator(configuration.peers, self.global_costmap, self.local_costmap),
            [VoronoiCell()] if filters is None else filters,
        )
        self.now_s = 0.0
        self.pose = HERE

    def until(self, end_s):
        ticks = []
        while self.now_s <= end_s + 1e-9:
            ticks.append(self.navigator.tick(self.now_s, RobotPoses(self.pose, self.pose), FORWARD))
            self.now_s = max(min(self.navigator.next_due_s, self.now_s + 0.5), self.now_s + 1e-6)
        return ticks


def outcomes(ticks):
    return [(tick.outcome.succeeded, tick.outcome.text) for tick in ticks if tick.outcome]
