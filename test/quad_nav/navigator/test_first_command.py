"""From a goal to its plan and its first command, as upstream and with the fixes."""

from __future__ import annotations

import pytest
from fake_navigator import FORWARD, GOAL, FakeRecovery, Flight, outcomes
from upstream import UPSTREAM

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.recovery_sequence import NamedRecovery
from quad_nav.navigator.tick import Trigger

FIXED = {"peers": {"avoid_peers": False}}
STOP = Twist2D()
OTHER_GOAL = Pose2D(5.0, 3.0, 0.0)


def plans(ticks):
    return pytest.approx([tick.now_s for tick in ticks if tick.plan is not None])


def commands(ticks, command=FORWARD):
    return pytest.approx([tick.now_s for tick in ticks if tick.command == command])


def first_motion_s(ticks):
    return next(tick.now_s for tick in ticks if tick.command not in (None, STOP))


@pytest.mark.parametrize("rate_hz", [1.0, 10.0])
@pytest.mark.parametrize("tree, periods", [(UPSTREAM, 1), (FIXED, 0)])
class TestFromGoalToMotion:
    """The plan comes in the cycle that takes the goal; the command so many periods later."""

    def flight(self, rate_hz, tree):
        return Flight(
            [NamedRecovery("none", FakeRecovery())],
            tree,
            controller_frequency_hz=rate_hz,
            planner_patience_s=1.0,
        )

    def test_from_idle(self, rate_hz, tree, periods):
        flight = self.flight(rate_hz, tree)
        flight.until(0.3)
        taken_s = flight.now_s
        flight.navigator.set_goal(GOAL, taken_s)
        ticks = flight.until(taken_s + 2.0)
        assert [taken_s] == plans(ticks)
        assert first_motion_s(ticks) - taken_s == pytest.approx(periods / rate_hz)
        assert [taken_s][:periods] == commands(ticks, STOP)

    def test_over_an_active_goal(self, rate_hz, tree, periods):
        flight = self.flight(rate_hz, tree)
        flight.navigator.set_goal(GOAL, 0.0)
        flight.until(2.95)
        assert not flight.navigator.accepts_goal(2.95)
        taken_s = flight.now_s = 3.0
        assert flight.navigator.accepts_goal(taken_s)
        flight.navigator.set_goal(OTHER_GOAL, taken_s)
        ticks = flight.until(taken_s + 2.0)
        assert [taken_s] == plans(ticks)
        assert first_motion_s(ticks) - taken_s == pytest.approx(periods / rate_hz)
        assert [] == commands(ticks, STOP)  # the command of the goal before goes on

    def test_after_an_abort(self, rate_hz, tree, periods):
        flight = self.flight(rate_hz, tree)
        flight.planner.fails = True
        flight.navigator.set_goal(GOAL, 0.0)
        assert len(outcomes(flight.until(6.0))) == 1
        flight.planner.fails = False
        taken_s = flight.now_s
        flight.navigator.set_goal(GOAL, taken_s)
        ticks = flight.until(taken_s + 2.0)
        assert [taken_s] == plans(ticks)
        assert first_motion_s(ticks) - taken_s == pytest.approx(periods / rate_hz)


def test_upstream_delays_its_cycles_by_a_rotation():
    """Fifty steps from 1.1 s on; the last one, at 3.55 s, is followed by a cycle and a plan."""
    flight = Flight([NamedRecovery("turn", FakeRecovery(steps=50))], planner_patience_s=1.0)
    flight.planner.fails = True
    flight.navigator.set_goal(GOAL, 0.0)
    flight.until(3.0)
    flight.planner.fails = False
    ticks = flight.until(4.0)
    assert [3.55] == plans(ticks)
    assert [3.65, 3.75, 3.85, 3.95] == commands(ticks)
    assert [] == commands(ticks, STOP)


@pytest.mark.parametrize("tree, followed", [(UPSTREAM, [0, 1, 2]), (FIXED, [1, 2, 3])])
def test_a_periodic_plan_is_followed_from_the_next_cycle_on(tree, followed):
    """Planner and controller at 2 Hz: the plans that were followed after 0.1, 0.6 and 1.1 s."""
    flight = Flight(tree=tree, controller_frequency_hz=2.0, planner_frequency_hz=2.0)
    flight.navigator.set_goal(GOAL, 0.0)
    counts = []
    for end_s in (0.1, 0.6, 1.1):
        flight.until(end_s)
        counts.append(len(flight.controller.plans))
    assert counts == followed


@pytest.mark.parametrize("tree, recovers", [(UPSTREAM, False), (FIXED, True)])
def test_a_plan_ends_upstreams_recovery_before_it_starts(tree, recovers):
    """The planner thread sets the state after every plan, also when control has failed."""
    recovery = FakeRecovery()
    flight = Flight(
        [NamedRecovery("r", recovery)],
        tree,
        controller_frequency_hz=1.0,
        planner_frequency_hz=2.0,
        controller_patience_s=1.5,
    )
    flight.controller.fails = True
    flight.navigator.set_goal(GOAL, 0.0)
    ticks = flight.until(10.0)
    assert (recovery.started > 0) is recovers
    assert outcomes(ticks) == ([(False, Trigger.CONTROLLING.value)] if recovers else [])


@pytest.mark.parametrize("tree, first_stop_s", [(UPSTREAM, 3.1), (FIXED, 2.0)])
def test_a_new_goal_without_a_plan_over_an_active_one(tree, first_stop_s):
    """Upstream flies on for planner_patience with the last command of the goal before."""
    flight = Flight(tree=tree, planner_patience_s=1.0, recovery_behavior_enabled=False)
    flight.navigator.set_goal(GOAL, 0.0)
    flight.until(1.95)
    flight.planner.fails = True
    flight.now_s = 2.0
    flight.navigator.set_goal(OTHER_GOAL, 2.0)
    ticks = flight.until(4.0)
    assert next(t.now_s for t in ticks if t.command == STOP) == pytest.approx(first_stop_s)
    assert outcomes(ticks) == [(False, Trigger.PLANNING.value)]
    assert commands(ticks) == []
