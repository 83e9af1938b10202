"""A robot without data stands, whatever it did before and whatever comes near."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_navigator import GOAL, HERE, FakeRecovery, Flight
from flight_faults import NoPose, NoScans
from test_tracking_flights import walker

from quad_moving.evasion import Evasion
from quad_nav.config.plugins import Parameters
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Twist2D
from quad_nav.navigator.recovery_sequence import NamedRecovery
from quad_nav.navigator.tick import RobotPoses, State
from quad_nav.offline import flight as offline
from quad_nav.peers.peer import Intention, Peer, idle_priority
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.simulation_params import SimulationParams

ROOT = Path(__file__).resolve().parents[2]
FEW_BEAMS = LidarParams(step_size_rad=2 * np.pi / 128)
BOTH = RobotPoses(HERE, HERE)

# -- the state machine ----------------------------------------------------------------


class Threatened(Flight):
    """A robot at (1, 1), one obstacle that comes from (3, 1.1) at 1 m/s, and a peer at (1.9, 1)."""

    def __init__(self, tree=(), **params):
        rotate = NamedRecovery("rotate", FakeRecovery(steps=1000))
        evasion = Evasion(Parameters({}, "evasion"))
        super().__init__([rotate], dict(tree), [evasion], planner_patience_s=0.5, **params)
        self.controller.params = TrajectoryPlannerParams(holonomic_robot=True, max_vel_x_mps=0.5)
        self.threat = True

    def ticks(self, seconds, poses=BOTH):
        end_s, ticks = self.now_s + seconds, []
        while self.now_s < end_s - 1e-9:
            now_s = self.now_s
            states = np.array([[3.0 - 1e-3 * now_s, 1.1, -1.0, 0.0]])
            tracks = Tracks(
                now_s,
                np.array([1]),
                states,
                1e-4 * np.eye(4)[np.newaxis],
                np.array([0.3]),
                np.zeros(1),
            )
            peer = Peer("quad1", 1.9, 1.0, -0.2, 0.0, now_s, Intention(idle_priority(1)))
            tracks = tracks if self.threat else Tracks.none(now_s)
            ticks.append(self.navigator.tick(now_s, poses, Twist2D(), (peer,), tracks))
            self.now_s += 1 / 40
        return ticks


def controls(flight):
    flight.navigator.set_goal(GOAL, 0.0)
    return State.CONTROLLING


def recovers(flight):
    flight.planner.fails = True
    flight.navigator.set_goal(GOAL, 0.0)
    return State.CLEARING


def plans(flight):
    flight.planner.fails = True
    flight.navigator.set_params(replace(flight.navigator.params, planner_patience_s=100.0))
    flight.navigator.set_goal(GOAL, 0.0)
    return State.PLANNING


def hovers(flight):
    return State.IDLE


def yields(flight):
    """It flies a manoeuvre to make room; only its goal differs from that of a mission."""
    flight.navigator.peers.is_yield_manoeuvre = True
    flight.navigator.start_goal(GOAL, 0.0)
    return State.CONTROLLING


def no_scans(flight):
    flight.local_costmap.stale = [("obstacle_layer/base_scan", 1.3)]
    return BOTH, "no data from obstacle_layer/base_scan for 1.3 s"


def old_costmap(flight):
    flight.local_costmap.is_current = lambda now_s: False
    return BOTH, "local costmap out of date"


def no_odometry(flight):
    return RobotPoses(None, None, "no message on /odom0 for 0.6 s"), "no message on /odom0"


def no_local_pose(flight):
    return RobotPoses(HERE, None), "robot pose unknown"


@pytest.mark.parametrize("lose", [no_scans, old_costmap, no_odometry, no_local_pose])
@pytest.mark.parametrize("does", [controls, recovers, plans, hovers, yields])
def test_every_command_of_a_robot_without_data_is_zero(does, lose):
    flight = Threatened()
    flight.threat = does is not recovers
    state = does(flight)
    before = flight.ticks(2.0)
    assert before[-1].state is state and any(tick.command for tick in before)
    assert not all(tick.command.is_zero for tick in before[-8:] if tick.command)
    flight.threat = True
    poses, reason = lose(flight)
    ticks = flight.ticks(4.0, poses)
    assert all(tick.command.is_zero and not tick.limited_by for tick in ticks if tick.command)
    lines = [line for tick in ticks for line in tick.warnings if line.startswith("stopping: ")]
    assert lines and all(reason in line for line in lines)
    periods = np.diff([tick.now_s for tick in ticks if tick.command])
    assert all(periods > 0.1 - 1e-6)  # the control period


@pytest.mark.parametrize("lose", [no_scans, no_odometry])
def test_a_cancel_without_data_is_a_stop(lose):
    flight = Threatened()
    controls(flight)
    flight.ticks(2.0)
    poses, _ = lose(flight)
    flight.navigator.cancel()
    ticks = flight.ticks(2.0, poses)
    assert [tick.command for tick in ticks if tick.command] == [Twist2D()]


@pytest.mark.parametrize("frequency_hz", [2.0, 20.0])
def test_an_idle_robot_evades_at_a_changed_frequency(frequency_hz):
    flight = Threatened()
    hovers(flight)
    flight.ticks(1.0)
    params = replace(flight.navigator.params, controller_frequency_hz=frequency_hz)
    flight.navigator.set_params(params)
    ticks = [tick for tick in flight.ticks(3.0) if tick.command]
    periods = np.diff([tick.now_s for tick in ticks])
    assert len(ticks) > 5 and periods == pytest.approx(1.0 / frequency_hz)


# -- flights --------------------------------------------------------------------------

BEGIN_S, SECONDS, TIMEOUT_S, CONTROL_PERIOD_S = 4.0, 10.0, 0.5, 0.1
FAR, HOVERS = [1.0, 8.0], [1.5, 1.5]  # the robot starts there


class Commands(offline.FlightObserver):
    """Collects the ticks, and the tracks after each of them."""

    def __init__(self):
        self.ticks, self.tracks = [], []

    def on_start(self, flight):
        self._filters = flight.offline_robots[0].scan_filters

    def on_tick(self, robot, tick, located, wall_s):
        self.ticks.append(tick)
        self.tracks.append((tick.now_s, len(self._filters.tracks(tick.now_s))))

    def moves(self, from_s):
        return [
            tick.now_s
            for tick in self.ticks
            if tick.now_s > from_s and tick.command and not tick.command.is_zero
        ]


def fly(folder, config, goal, fault):
    """Fly among walkers who come along the robot's way, one after the other."""
    (folder / "quad0_goals.json").write_text(json.dumps({"goals": [goal]}))
    simulation = SimulationParams(FEW_BEAMS)
    options = FlightOptions(
        ROOT / "scenes" / "arena.yaml", folder, config, scans_per_s=10.0, simulation=simulation
    )
    setup = read_setup(options)
    walkers = tuple(walker((6.0, y_m), (0.6, y_m), speed_mps=1.2) for y_m in (1.2, 1.9))
    setup = replace(setup, scene=replace(setup.scene, moving=walkers))
    commands = Commands()
    flight = offline.Flight(setup, [fault, commands])
    while flight.now_s < SECONDS:
        flight.advance()
    flight.end()
    return commands


@pytest.mark.parametrize("fault", [NoScans, NoPose])
@pytest.mark.parametrize("goal", [FAR, HOVERS], ids=["flies", "hovers"])
@pytest.mark.parametrize("config", ["moving", "people"])
def test_nothing_moves_a_quadcopter_that_has_lost_its_data(config, goal, fault, tmp_path):
    commands = fly(tmp_path, config, goal, fault(BEGIN_S, 1e9))
    limit_s = BEGIN_S + TIMEOUT_S + CONTROL_PERIOD_S
    assert any(tick.limited_by for tick in commands.ticks if tick.now_s < limit_s)
    assert commands.moves(limit_s) == []
