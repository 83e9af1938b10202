"""The loop: steps, robots flown from outside, LIDARs that are off, groups of a shell, resets."""

from __future__ import annotations

import os
import signal
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.loop import offline_setup, shares_of, worker_process
from quad_nav.loop.flight_loop import FlightLoop
from quad_nav.loop.navigator_group import NavigatorGroup
from quad_nav.peers.peer import Intention
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.simulation_params import SimulationParams

ROOT = Path(__file__).resolve().parents[3]
GOALS = (Pose2D(3.0, 1.5), Pose2D(1.5, 4.0))


@pytest.fixture(scope="module")
def setup():
    simulation = SimulationParams(LidarParams(step_size_rad=2 * np.pi / 64))
    files = ROOT / "scenes" / "arena.yaml", ROOT / "goals", "tutorial"
    return offline_setup(read_setup(FlightOptions(*files, simulation=simulation)))


def fly(loop: FlightLoop, periods: int) -> list:
    """Fly with the navigators' commands; return the bodies at each odometry."""
    rows = []
    for _ in range(periods):
        while not loop.advance().is_odometry:
            pass
        for result in loop.navigate():
            loop.command(result.robot, result.tick.command)
        rows.append(loop.simulation.body_state.rows)
    return rows


def started(setup, shares, **arguments) -> FlightLoop:
    loop = FlightLoop(setup, shares, **arguments)
    loop.start()
    for robot in loop.hosted:
        loop.send_goal(robot, GOALS[robot])
    return loop


class Parking(NavigatorGroup):
    """A group whose robots get their goals in its own process, and never a command."""

    def before_ticks(self, now_s):
        if now_s < 0.03:
            for robot in self.robots.values():
                robot.waiting_goal = GOALS[0]

    def tick(self, number, now_s, states, peers):
        result = super().tick(number, now_s, states, peers)
        assert result.goal_waits is False
        return replace(result, tick=replace(result.tick, command=None, notes=["parked"]))


def test_robots_are_divided_and_no_share_but_the_first_is_empty():
    assert shares_of(range(5), 2) == [(0, 2, 4), (1, 3)]
    assert shares_of([3, 7], 4) == [(3,), (7,)]
    assert shares_of(range(4), 1) == [(0, 1, 2, 3)]
    assert shares_of([], 3) == [()]


def test_steps_end_at_scans_and_odometry(setup):
    """A scan each 8 steps, odometry each 6: events at 6, 8, 12, 16, 18 and 24."""
    loop = FlightLoop(replace(setup, steps_per_scan=8, start_step=240), [(0, 1)])
    events = []
    while loop.simulation.step_count < 240 + 24:
        progress = loop.advance(4)
        events.append(
            (loop.simulation.step_count - 240, sorted(progress.scans), progress.is_odometry)
        )
    loop.close()
    assert events == [
        (4, [], False),
        (6, [], True),
        (8, [0, 1], False),
        (12, [], True),
        (16, [0, 1], False),
        (18, [], True),
        (22, [], False),
        (24, [0, 1], True),
    ]


def test_single_steps_give_the_same_flight(setup):
    whole, stepped = started(setup, [(0, 1)]), started(setup, [(0, 1)])
    rows = fly(whole, 40)
    for expected in rows:
        while not stepped.advance(1).is_odometry:
            pass
        for result in stepped.navigate():
            stepped.command(result.robot, result.tick.command)
        assert np.array_equal(stepped.simulation.body_state.rows, expected)
    assert np.hypot(*(rows[-1] - rows[0])[0, :2]) > 0.1
    whole.close()
    stepped.close()


def test_planners_of_a_group_share_their_working_memory(setup):
    loop = FlightLoop(setup, [(0, 1)])
    first, second = (robot.navigator.planner for robot in loop.group.robots.values())
    loop.close()
    assert first.wave is second.wave


def test_a_robot_of_no_share_is_flown_from_outside(setup):
    loop = started(setup, [(1,)])
    assert loop.hosted == (1,)
    start = loop.simulation.body_state.rows[:, :2].copy()
    path = np.array([[1.0, 1.0], [2.0, 2.0]])
    loop.set_intention(0, Intention(-1.0, path))
    for _ in range(40):
        loop.command(0, Twist2D(0.2, 0.0, 0.0))
        fly(loop, 1)
    assert loop.group.intentions[0].path is path
    moved = loop.simulation.body_state.rows[:, :2] - start
    assert np.hypot(*moved[0]) == pytest.approx(0.2, abs=0.08) and np.hypot(*moved[1]) > 0.05
    loop.close()


def test_a_lidar_that_is_off_takes_no_scans(setup):
    loop = started(setup, [(0, 1)])
    loop.enable_lidar(1, False)
    scans = []
    while len(scans) < 2:
        progress = loop.advance()
        if progress.scans:
            scans.append(sorted(progress.scans))
            loop.enable_lidar(1, True)
    loop.close()
    assert scans == [[0], [0, 1]]


@pytest.mark.parametrize("method", ["fork", "forkserver", "spawn"])
def test_a_group_of_a_shell_runs_in_every_process(setup, method):
    loop = FlightLoop(setup, [(0,), (1,)], Parking, start_method=method)
    loop.start()
    told = {}
    while loop.now_s < 0.3:
        if loop.advance().is_odometry:
            told.update((result.robot, result.tick) for result in loop.navigate())
    states = {number: tick.state.value for number, tick in told.items()}
    notes = [tick.notes[-1] for tick in told.values()]
    loop.close()
    assert states == {0: "controlling", 1: "controlling"}
    assert notes == ["parked", "parked"]


def test_a_lost_worker_process_is_reported_and_its_robot_hovers_until_there_is_another(setup):
    lost = []
    loop = started(
        setup, [(0,), (1,)], on_worker_loss=lambda robots, error: lost.append((robots, str(error)))
    )
    fly(loop, 40)
    assert not loop.simulation.is_hovering.any()
    os.kill(loop.workers[0].pid, signal.SIGKILL)
    fly(loop, 40)
    assert [robots for robots, _ in lost] == [(1,)] and "it has ended" in lost[0][1]
    assert loop.hosted == (0,)
    assert loop.simulation.is_hovering.tolist() == [False, True]
    loop.add_worker([1])
    loop.send_goal(1, GOALS[1])
    loop.workers[0].wait_until_ready()
    fly(loop, 40)
    assert loop.hosted == (0, 1)
    assert loop.simulation.is_hovering.tolist() == [False, False]
    loop.close()


def test_a_worker_process_that_stops_delays_nobody_for_longer_than_the_patience(setup):
    loop = started(setup, [(0,), (1,)], patience_s=0.01)
    fly(loop, 20)
    os.kill(loop.workers[0].pid, signal.SIGSTOP)
    try:
        fly(loop, 80)
    finally:
        os.kill(loop.workers[0].pid, signal.SIGCONT)
    assert loop.simulation.is_hovering.tolist() == [False, True]
    assert loop.workers[0].results()
    fly(loop, 20)
    loop.close()


@pytest.mark.parametrize("shares", [[(0, 1)], [(0,), (1,)]])
def test_a_reset_returns_to_the_starts_and_restarts_navigators_when_the_clock_jumps(setup, shares):
    loop = started(setup, shares)
    first = fly(loop, 60)
    loop.reset(start_step=0)
    assert loop.now_s == 0.0
    loop.start()
    again = fly(loop, 60)  # the goals go on
    assert np.array_equal(first[0][:, :2], again[0][:, :2])
    assert np.hypot(*(again[-1] - again[0])[:, :2].T).min() > 0.1
    loop.close()


@pytest.mark.parametrize("cores, robots, processes", [(2, 1, 1), (2, 2, 2), (4, 3, 3), (4, 100, 4)])
def test_there_is_a_process_for_each_core_and_at_most_one_for_each_robot(
    monkeypatch, cores, robots, processes
):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(cores)))
    assert worker_process.processes_for(robots, "spawn") == processes


def test_a_process_with_threads_is_not_forked(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    end = threading.Event()
    thread = threading.Thread(target=end.wait)
    thread.start()
    assert worker_process.processes_for(10) == 1
    assert worker_process.processes_for(19, "forkserver", 10) == 1
    assert worker_process.processes_for(20, "forkserver", 10) == 2
    end.set()
    thread.join()
