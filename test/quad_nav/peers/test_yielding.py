"""Navigators that yield to each other: bodies that follow commands exactly, no walls."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.config import load
from quad_nav.geometry import Pose2D, Pose3D, Scan, Twist2D
from quad_nav.grid import LETHAL
from quad_nav.navigator.tick import RobotPoses, State
from quad_nav.peers.peer import HIGHEST_PRIORITY, Intention, peer_at
from quad_nav.scenario.assembly import apply_configuration, build_navigator

STEP_S = 0.1
RADIUS_M = 0.36  # the footprint's, padding included
TREE = {
    "controller_frequency": 5.0,
    "planner_frequency": 1.0,
    "global_costmap": {
        "width": 10.0,
        "height": 10.0,
        "robot_radius": 0.35,
        "resolution": 0.1,
        "update_frequency": 5.0,
    },
    "local_costmap": {
        "width": 3.0,
        "height": 3.0,
        "robot_radius": 0.35,
        "rolling_window": True,
        "update_frequency": 5.0,
    },
    "TrajectoryPlannerROS": {
        "max_vel_x": 0.3,
        "min_vel_x": 0.1,
        "holonomic_robot": False,
        "max_vel_theta": 1.0,
        "yaw_goal_tolerance": 6.3,
    },
}


class Fleet:
    """Navigators that are peers of each other, and their bodies."""

    def __init__(self, *poses, peers=None):
        tree = {**TREE, "peers": peers or {}}
        self.navigators = [build_navigator(load({**tree, "robot": k})) for k in range(len(poses))]
        self.poses = list(poses)
        self.velocities = [Twist2D()] * len(poses)
        self.now_s = 0.0
        self.nearest_m = math.inf
        self.outcomes = [[] for _ in poses]
        self.notes = [[] for _ in poses]
        self.yielded = [False] * len(poses)

    def fly(self, seconds, until=lambda: False):
        end_s = self.now_s + seconds
        while self.now_s < end_s and not until():
            seen = [
                peer_at(f"quad{k}", pose, velocity, self.now_s, navigator.peers.intention)
                for k, (pose, velocity, navigator) in enumerate(
                    zip(self.poses, self.velocities, self.navigators)
                )
            ]
            for k in range(len(self.poses)):
                self._tick(k, seen[:k] + seen[k + 1 :])
            self.poses = [moved(p, v) for p, v in zip(self.poses, self.velocities)]
            self.now_s += STEP_S
            self.nearest_m = min(
                [self.nearest_m]
                + [a.distance_to(b) for i, a in enumerate(self.poses) for b in self.poses[:i]]
            )

    def _tick(self, k, peers):
        tick = self.navigators[k].tick(
            self.now_s, RobotPoses(self.poses[k], self.poses[k]), self.velocities[k], peers
        )
        if tick.command is not None:
            self.velocities[k] = tick.command
        if tick.outcome is not None:
            self.outcomes[k].append(tick.outcome)
        self.notes[k] += tick.notes
        self.yielded[k] |= tick.yielding is not None


def moved(pose, velocity):
    turn, length = velocity.vyaw_radps * STEP_S, velocity.vx_mps * STEP_S
    yaw = pose.yaw_rad + 0.5 * turn
    return Pose2D(
        pose.x_m + length * math.cos(yaw), pose.y_m + length * math.sin(yaw), pose.yaw_rad + turn
    )


def test_head_on_one_robot_goes_straight_and_the_other_passes_beside_it():
    fleet = Fleet(Pose2D(2.0, 5.0), Pose2D(8.0, 5.0, math.pi))
    fleet.navigators[0].set_goal(Pose2D(8.0, 5.0), 0.0)
    fleet.navigators[1].set_goal(Pose2D(2.0, 5.0), 0.0)
    fleet.fly(90.0, until=lambda: all(fleet.outcomes))
    assert [[o.succeeded for o in outcomes] for outcomes in fleet.outcomes] == [[True], [True]]
    assert fleet.yielded == [False, False]
    assert fleet.nearest_m > 2 * RADIUS_M


def test_an_idle_robot_on_a_goal_makes_room_and_returns():
    fleet = Fleet(Pose2D(2.0, 5.0), Pose2D(6.0, 5.0))
    fleet.navigators[0].set_goal(Pose2D(6.0, 5.0), 0.0)
    fleet.fly(60.0, until=lambda: fleet.outcomes[0])
    assert fleet.outcomes[0][0].succeeded
    assert fleet.poses[1].distance_to(Pose2D(6.0, 5.0)) > 2 * RADIUS_M
    fleet.navigators[0].set_goal(Pose2D(2.0, 5.0), fleet.now_s)
    fleet.fly(60.0, until=lambda: "back at its parking pose" in fleet.notes[1])
    assert fleet.poses[1].distance_to(Pose2D(6.0, 5.0)) < 0.2
    assert fleet.navigators[1].state is State.IDLE
    assert fleet.outcomes[1] == []  # it had no goal of its own
    assert fleet.nearest_m > 2 * RADIUS_M


def test_a_robot_without_progress_gives_up_its_priority():
    fleet = Fleet(Pose2D(5.0, 5.0), Pose2D(8.0, 8.0))
    navigator = fleet.navigators[0]
    navigator.set_goal(Pose2D(8.0, 5.0), 0.0)
    priority = navigator.peers.priority
    here = fleet.poses[0]
    while fleet.now_s < 20.0:
        peers = [peer_at("quad1", fleet.poses[1], Twist2D(), fleet.now_s)]
        fleet.notes[0] += navigator.tick(
            fleet.now_s, RobotPoses(here, here), Twist2D(), peers
        ).notes
        fleet.now_s += STEP_S
    assert navigator.peers.priority < priority - 15.0
    assert any("giving up priority" in note for note in fleet.notes[0])


def test_a_lost_peer_is_logged_once():
    fleet = Fleet(Pose2D(5.0, 5.0))
    navigator = fleet.navigators[0]
    here = fleet.poses[0]
    notes = []
    for k in range(30):  # the state at 0 s is fresh for half a second
        seen = [peer_at("quad1", Pose2D(7.0, 5.0), Twist2D(), 0.0)]
        notes += navigator.tick(k * STEP_S, RobotPoses(here, here), Twist2D(), seen).notes
    assert notes == ["no data from quad1 for 0.5 s, avoiding it by LIDAR only"]
    seen = [peer_at("quad1", Pose2D(7.0, 5.0), Twist2D(), 3.0)]
    assert navigator.tick(3.0, RobotPoses(here, here), Twist2D(), seen).notes == [
        "receiving data from quad1 again"
    ]


def test_marks_of_a_peer_are_cleared_when_it_becomes_known():
    source = {
        "observation_sources": "scan",
        "obstacle_range": 5.0,
        "scan": {"data_type": "LaserScan", "marking": True, "max_obstacle_height": 2.0},
    }
    navigator = build_navigator(load({"global_costmap": source, "local_costmap": source}))
    here = Pose2D(5.0, 5.0)
    layer = navigator.global_costmap.layers["obstacle_layer"]
    scan = Scan(0.0, 0.0, 0.01, 0.02, 60.0, np.full(2, 1.7, dtype=np.float32))
    layer.add_scan("scan", scan, Pose3D(5.0, 5.0, 1.0), 0.0)
    navigator.tick(0.0, RobotPoses(here, here), Twist2D())
    assert (layer.grid.costs == LETHAL).any()
    nothing = Scan(1.0, 0.0, 0.01, 0.02, 60.0, np.full(2, math.inf, dtype=np.float32))
    layer.add_scan("scan", nothing, Pose3D(5.0, 5.0, 1.0), 1.0)
    seen = [peer_at("quad1", Pose2D(7.0, 5.0), Twist2D(), 1.0)]
    navigator.tick(1.0, RobotPoses(here, here), Twist2D(), seen)
    navigator.global_costmap.update(1.0, here)
    assert not (layer.grid.costs == LETHAL).any()


def test_a_stationary_peer_is_an_obstacle_whatever_its_intention():
    """The peer stands for 9 s and moves on. The separation of centres is 2 x (r + 0.05 m)."""
    navigator = build_navigator(load(TREE))
    here = Pose2D(5.0, 5.0)

    def solid(now_s, x_m):
        intention = Intention(HIGHEST_PRIORITY, np.array([[x_m, 5.0], [9.0, 5.0]]))
        seen = [peer_at("quad1", Pose2D(x_m, 5.0), Twist2D(), now_s).with_intention(intention)]
        navigator.tick(now_s, RobotPoses(here, here), Twist2D(), seen)
        navigator.local_costmap.update(now_s, here)
        return np.count_nonzero(navigator.local_costmap.costs == LETHAL)

    assert [solid(now_s, 6.0) for now_s in (0.0, 4.0, 7.9)] == [0, 0, 0]
    assert solid(9.0, 6.0) * 0.05**2 == pytest.approx(
        math.pi * (RADIUS_M + 2 * 0.05) ** 2, rel=0.05
    )
    assert solid(9.2, 6.15) == 0


def test_an_idle_robot_makes_room_for_a_peer_that_it_blocks():
    """The goal is 0.71 m from the parked robot; a robot that stands for long counts as parked."""
    fleet = Fleet(Pose2D(5.0, 5.0), Pose2D(4.72, 6.2, -1.0), peers={"yield_when_idle": False})
    fleet.navigators[1].set_goal(Pose2D(5.5, 5.5), 0.0)
    fleet.fly(12.0)
    assert fleet.outcomes[1] == [] and fleet.poses[1].distance_to(Pose2D(4.72, 6.2)) < 0.5
    configuration = load({**TREE, "robot": 0})
    apply_configuration(fleet.navigators[0], configuration)
    fleet.fly(60.0, until=lambda: bool(fleet.outcomes[1]))
    assert [outcome.succeeded for outcome in fleet.outcomes[1]] == [True]
    assert fleet.nearest_m > 2 * RADIUS_M


@pytest.mark.parametrize("end_m, yields", [(5.2, True), (8.0, False)])
def test_an_idle_robot_makes_room_for_a_peer_that_stands_far_away_and_wants_its_place(
    end_m, yields
):
    """Plans of the peer lead around the idle robot, but to no goal that this one stands on."""
    navigator = build_navigator(load({**TREE, "robot": 0}))
    here, path = Pose2D(5.0, 5.0), np.array([[1.0, 5.0], [end_m, 5.0]])
    idle = []
    for now_s in np.arange(0.0, 12.0, 0.1).tolist():
        peer = peer_at("quad1", Pose2D(1.0, 5.0), Twist2D(), now_s, Intention(-1.0, path))
        idle.append(
            navigator.tick(now_s, RobotPoses(here, here), Twist2D(), [peer]).state is State.IDLE
        )
    assert idle[70] and idle[-1] is not yields
    assert np.count_nonzero(np.diff(idle)) == int(yields), "it decides once"


def test_without_avoid_peers_they_do_not_avoid_each_other():
    fleet = Fleet(Pose2D(2.0, 5.0), Pose2D(8.0, 5.0, math.pi), peers={"avoid_peers": False})
    fleet.navigators[0].set_goal(Pose2D(8.0, 5.0), 0.0)
    fleet.navigators[1].set_goal(Pose2D(2.0, 5.0), 0.0)
    fleet.fly(20.0)
    assert fleet.yielded == [False, False]
    assert fleet.nearest_m < RADIUS_M


def test_a_goal_ends_a_yielding_manoeuvre():
    fleet = Fleet(Pose2D(3.5, 5.0), Pose2D(6.0, 5.0))
    fleet.navigators[0].set_goal(Pose2D(6.0, 5.0), 0.0)
    fleet.fly(20.0, until=lambda: fleet.yielded[1])
    fleet.navigators[1].set_goal(Pose2D(8.0, 8.0), fleet.now_s)
    fleet.fly(60.0, until=lambda: fleet.outcomes[1])
    assert fleet.outcomes[1][0].succeeded
    assert fleet.poses[1].distance_to(Pose2D(8.0, 8.0)) < 0.2
