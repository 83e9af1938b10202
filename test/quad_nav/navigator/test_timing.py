"""Schedules: one run in each period, however the clock is rounded."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fake_navigator import GOAL, HERE, Flight

from quad_nav.geometry import Twist2D
from quad_nav.navigator.tick import RobotPoses
from quad_nav.timing import Schedule

DAY_S = 86_400.0


def truncated(seconds: float) -> float:
    """As ``rospy.Time.from_sec`` has it: never later, and up to a nanosecond earlier."""
    whole = int(seconds)
    return whole + int((seconds - whole) * 1e9) / 1e9


def rounded(seconds: float) -> float:
    return round(seconds * 1e9) / 1e9


CLOCKS = pytest.mark.parametrize("clock", [float, truncated, rounded])


def runs(schedule, times_s):
    return [now_s for now_s in times_s if schedule.pop(now_s)]


@CLOCKS
@pytest.mark.parametrize("start_s", [0.0, 11.1, DAY_S])
@pytest.mark.parametrize("steps", [1, 3, 24])
def test_a_clock_of_any_rounding_runs_a_task_once_in_each_period(clock, start_s, steps):
    """The clock steps once in each period, or more often."""
    random = np.random.default_rng(steps)
    for frequency_hz in (*random.uniform(0.5, 50.0, 30), 1.0, 3.0, 10.0, 20.0, 30.0):
        schedule = Schedule(frequency_hz)
        schedule.start(clock(start_s))
        step_s = 1.0 / frequency_hz / steps
        times_s = [clock(start_s + k * step_s) for k in range(200 * steps)]
        assert runs(schedule, times_s) == times_s[::steps]


def test_a_frequency_of_zero_is_never_due():
    schedule = Schedule(0.0)
    schedule.start(0.0)
    assert schedule.due_s == math.inf and not schedule.pop(1e9)


@CLOCKS
@pytest.mark.parametrize("first", [3, 6, 9, 2424])
def test_a_navigator_of_any_clock_searches_and_commands_once_in_each_period(clock, first):
    """With a clock of 240 Hz. A search that fails is repeated in each control cycle."""
    flight = Flight(tree={}, controller_frequency_hz=1.0, planner_patience_s=100.0)
    flight.planner.fails, here = True, RobotPoses(HERE, HERE)
    times_s = [clock((first + k) / 240) for k in range(240 * 18)]
    flight.navigator.set_goal(GOAL, times_s[0])
    ticks = [flight.navigator.tick(now_s, here, Twist2D()) for now_s in times_s]
    assert [tick.now_s for tick in ticks if tick.command] == times_s[::240]
    assert flight.planner.calls == 18
