"""Schedules: one run in each period, however the clock is rounded."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_navigator import GOAL, HERE, Flight

from quad_nav.geometry import Twist2D
from quad_nav.navigator.tick import RobotPoses
from quad_nav.timing import Schedule

DAY_S = 86_400.0
SINCE_1970_S = 1.8e9


def truncated(seconds: float) -> float:
    """As ``rospy.Time.from_sec`` has it: never later, and up to a nanosecond earlier."""
    whole = int(seconds)
    return whole + int((seconds - whole) * 1e9) / 1e9


def rounded(seconds: float) -> float:
    return round(seconds * 1e9) / 1e9


CLOCKS = pytest.mark.parametrize("clock", [float, truncated, rounded])


def runs(schedule, times_s):
    return [now_s for now_s in times_s if schedule.pop(now_s)]


def test_a_nanosecond_early_is_on_time_and_counts_once():
    for start_s in (0.0, 11.1, 1e5):
        schedule = Schedule(10.0)
        schedule.start(start_s)
        assert schedule.pop(start_s - 1e-9)
        assert schedule.due_s == pytest.approx(start_s + 0.1)
        assert not schedule.pop(start_s)
        assert not schedule.pop(start_s + 0.05)


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


@CLOCKS
def test_a_schedule_of_any_clock_is_never_due_in_the_past(clock):
    """20,000 schedules, each asked at its due time and around it."""
    random = np.random.default_rng(0)
    for _ in range(20_000):
        schedule = Schedule(random.uniform(0.1, 100.0))
        schedule.start(clock(random.uniform(0.0, 1000.0)))
        for _ in range(3):
            late_s = random.choice([0.0, 1e-9, -1e-9, 1e-7, 0.5, 1.0, 3.0, 3.7])
            now_s = clock(schedule.due_s + late_s * (schedule.period_s if late_s >= 0.5 else 1.0))
            if schedule.pop(now_s):
                assert now_s < schedule.due_s <= now_s + schedule.period_s + 1e-6
                assert not schedule.pop(now_s)


def test_a_clock_since_1970_runs_a_task_no_more_often():
    """Its floats are 2.4e-7 s apart, so that due times are rounded."""
    for frequency_hz in (1.0, 3.0, 7.0, 10.0, 20.0, 30.0):
        schedule = Schedule(frequency_hz)
        schedule.start(SINCE_1970_S)
        times_s = [SINCE_1970_S + k / 240 for k in range(240 * 60)]
        found = runs(schedule, [now_s for now_s in times_s for _ in range(2)])
        assert np.diff(found).min() > 1.0 / frequency_hz - 1 / 240
        assert len(found) == 60 * frequency_hz


def test_due_times_that_have_passed_are_dropped():
    schedule = Schedule(10.0)
    schedule.start(0.0)
    assert runs(schedule, [0.0, 0.37, 0.38, 0.4, 0.41]) == [0.0, 0.37, 0.4]


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
