"""The state machine with fake planners."""

from __future__ import annotations

import numpy as np
import pytest
from fake_navigator import (
    ALONE,
    FORWARD,
    GOAL,
    FakeController,
    FakePlanner,
    FakeRecovery,
    Flight,
    Weights,
    outcomes,
)
from upstream import UPSTREAM

from quad_nav.errors import GoalOutsideMap, NoPath
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.control_supervisor import way_left_m
from quad_nav.navigator.recovery_sequence import NamedRecovery
from quad_nav.navigator.tick import RobotPoses, State, Trigger


def test_a_goal_is_planned_once_and_commanded_in_every_cycle():
    flight = Flight(tree={}, controller_frequency_hz=2.0)
    flight.navigator.set_goal(GOAL, 0.0)
    ticks = flight.until(2.0)
    assert flight.planner.calls == 1
    assert [tick.now_s for tick in ticks if tick.command == FORWARD] == pytest.approx(
        [0.0, 0.5, 1.0, 1.5, 2.0]
    )
    np.testing.assert_array_equal(flight.controller.plans[0], [[1, 1, 0], [5, 1, 0]])


def test_no_plan_within_patience_runs_all_recoveries_and_aborts():
    recoveries = [NamedRecovery(f"r{k}", FakeRecovery()) for k in range(2)]
    flight = Flight(recoveries, planner_patience_s=2.0)
    flight.planner.fails = True
    flight.navigator.set_goal(GOAL, 0.0)
    ticks = flight.until(10.0)
    starts = [
        (tick.recovery.name, tick.recovery.index, tick.recovery.total)
        for tick in ticks
        if tick.recovery
    ]
    assert starts == [("r0", 0, 2), ("r1", 1, 2)]
    assert outcomes(ticks) == [(False, Trigger.PLANNING.value)]
    ended = next(tick.now_s for tick in ticks if tick.outcome)
    assert ended == pytest.approx(3 * 2.0, abs=0.5)  # patience before each of three endings


@pytest.mark.parametrize(
    "x_m, rolls, is_told", [(11.0, True, True), (11.0, False, False), (5.0, True, False)]
)
def test_a_goal_off_a_rolling_costmap_is_told(x_m, rolls, is_told):
    """The costmap is 10 m wide."""
    flight = Flight(planner_patience_s=1.0, recovery_behavior_enabled=False)
    flight.planner.fails, flight.global_costmap.params.rolling_window = True, rolls
    flight.navigator.set_goal(Pose2D(x_m, 1.0), 0.0)
    off = " The goal is off the rolling global costmap, x 0.00 to 10.00, y 0.00 to 10.00 m."
    text = Trigger.PLANNING.value + off * is_told
    assert outcomes(flight.until(5.0)) == [(False, text)]


def test_failing_control_stops_replans_and_aborts_after_its_patience():
    flight = Flight(controller_patience_s=1.0, recovery_behavior_enabled=False)
    flight.controller.fails = True
    flight.navigator.set_goal(GOAL, 0.0)
    ticks = flight.until(3.0)
    assert {tick.command for tick in ticks if tick.command} == {Twist2D()}
    assert flight.planner.calls > 5
    assert outcomes(ticks) == [(False, Trigger.CONTROLLING.value)]
    ended = next(tick.now_s for tick in ticks if tick.outcome)
    assert ended == pytest.approx(1.2, abs=0.11)


def test_oscillation_timeout_aborts_when_the_robot_stays_within_its_distance():
    flight = Flight(oscillation_timeout_s=2.0, recovery_behavior_enabled=False)
    flight.navigator.set_goal(GOAL, 0.0)
    assert outcomes(flight.until(4.0)) == [(False, Trigger.OSCILLATION.value)]


def test_a_robot_without_progress_replans_then_recovers_then_aborts():
    flight = Flight([NamedRecovery("r", FakeRecovery())], {"progress_timeout": 2.0})
    flight.navigator.set_goal(GOAL, 0.0)
    ticks = flight.until(12.0)
    warnings = [warning for tick in ticks for warning in tick.warnings]
    assert warnings[0] == "no progress for 2 s at (1.00, 1.00), replanning"
    assert [tick.recovery.name for tick in ticks if tick.recovery] == ["r"]
    assert outcomes(ticks) == [(False, Trigger.OSCILLATION.value)]


def test_a_robot_without_progress_relaxes_the_obstacle_weight_until_it_has_moved():
    flight = Flight(tree={"progress_timeout": 2.0})
    weights = flight.controller
    weights.params = Weights(occdist_scale=0.01)
    flight.navigator.set_goal(GOAL, 0.0)
    flight.until(1.0)
    assert weights.params.occdist_scale == 0.01
    flight.until(3.0)
    assert weights.params.occdist_scale == pytest.approx(0.001)
    flight.navigator.set_goal(GOAL, flight.now_s)
    flight.until(6.0)
    assert weights.params.occdist_scale == pytest.approx(0.001)  # not a tenth of a tenth
    flight.pose = Pose2D(1.6, 1.0)  # oscillation_distance is 0.5
    flight.until(7.0)
    assert weights.params.occdist_scale == 0.01


def test_a_second_stall_leaves_no_weight_to_obstacle_costs_before_any_recovery():
    """DWA does not check collisions at a weight of 0."""
    flight = Flight([NamedRecovery("r", FakeRecovery())], {"progress_timeout": 2.0})
    flight.controller.params = Weights(occdist_scale=0.1)
    flight.navigator.set_goal(GOAL, 0.0)
    assert not any(tick.recovery for tick in flight.until(5.5))
    assert 0.0 < flight.controller.params.occdist_scale < 1e-6
    assert any(tick.recovery for tick in flight.until(7.5))


def moved_along(flight, places):
    """Fly by way of places float64[n, 2], one in half a second; return the ticks."""
    ticks = []
    for x_m, y_m in places.tolist():
        flight.pose = Pose2D(x_m, y_m)
        ticks += flight.until(flight.now_s + 0.5)
    return ticks


@pytest.mark.parametrize("planner_hz", [0.0, 2.0])
def test_a_robot_that_circles_makes_no_progress(planner_hz):
    """It is 3.5 to 4.5 m from the goal, and has 2 s and the time to fly that metre slowly."""
    recovery = NamedRecovery("r", FakeRecovery())
    flight = Flight([recovery], {"progress_timeout": 2.0}, planner_frequency_hz=planner_hz)
    flight.navigator.set_goal(GOAL, 0.0)
    turns_rad = np.linspace(0.0, 8.0 * np.pi, 65)
    circles = np.column_stack((1.0 + 0.5 * np.cos(turns_rad), 1.0 + 0.5 * np.sin(turns_rad)))
    ticks = moved_along(flight, circles)
    warnings = [line for tick in ticks for line in tick.warnings]
    assert warnings[0].startswith("no progress for") and warnings[0].endswith("replanning")
    assert [tick.recovery.trigger for tick in ticks if tick.recovery][:1] == [Trigger.OSCILLATION]


def test_a_robot_has_the_time_to_fly_a_detour():
    """When 2.2 m are left, 6.7 m by way of a corner are found; it flies at 0.2 m/s."""
    flight = Flight(tree={"progress_timeout": 2.0}, planner_frequency_hz=2.0)
    flight.navigator.set_goal(GOAL, 0.0)
    ticks = moved_along(flight, np.linspace((1.0, 1.0), (2.8, 1.0), 18))
    flight.planner.corner = [2.8, 4.0, 0.0]
    ticks += moved_along(flight, np.linspace((2.8, 1.1), (2.8, 4.0), 30))
    flight.planner.corner = None
    ticks += moved_along(flight, np.linspace((2.9, 3.9), (4.9, 1.1), 36))
    assert [tick.warnings for tick in ticks if tick.warnings] == []


def test_the_way_left_leads_to_the_plan_and_along_it():
    plan = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 4.0, 0.0]])
    assert way_left_m(plan, Pose2D(1.0, 0.5)) == pytest.approx(0.5 + 2.0 + 4.0)
    assert way_left_m(plan, Pose2D(-1.0, 0.0)) == pytest.approx(1.0 + 3.0 + 4.0)
    assert way_left_m(plan, Pose2D(3.0, 5.0)) == pytest.approx(1.0)
    assert way_left_m(plan[:1], Pose2D(0.0, 2.0)) == pytest.approx(2.0)


def test_cancel_publishes_one_stop():
    flight = Flight()
    flight.navigator.set_goal(GOAL, 0.0)
    flight.until(0.5)
    flight.navigator.cancel()
    ticks = flight.until(2.0)
    assert [tick.command for tick in ticks if tick.command is not None] == [Twist2D()]
    assert flight.navigator.state is State.IDLE


@pytest.mark.parametrize("tree, turns", [(ALONE, False), (UPSTREAM, True)])
def test_a_rotation_pauses_without_sensor_data(tree, turns):
    recovery = FakeRecovery(steps=200)
    flight = Flight([NamedRecovery("rotate", recovery)], tree, planner_patience_s=0.5)
    flight.planner.fails = True
    flight.navigator.set_goal(GOAL, 0.0)
    flight.until(2.0)
    assert recovery.started == 1
    left = recovery.left
    flight.local_costmap.stale = [("obstacle_layer/base_scan", 1.26)]
    ticks = flight.until(4.0)
    assert (recovery.left < left) is turns
    assert len(ticks) <= 2.0 / 0.05 + 2 * 2.0 / 0.2 + 2 * 2.0 / 0.25  # no more than what is due


def test_a_robot_that_stops_without_sensor_data_keeps_its_patience():
    flight = Flight(tree={"progress_timeout": 1.0, **ALONE})
    flight.navigator.set_goal(GOAL, 0.0)
    flight.local_costmap.stale = [("obstacle_layer/base_scan", 1.26)]
    flight.until(5.0)
    flight.local_costmap.stale = []
    after = flight.until(5.5)
    assert [tick.warnings for tick in after if tick.warnings] == []
    assert any("no progress" in line for tick in flight.until(7.0) for line in tick.warnings)


def test_local_from_global_transforms_the_global_pose_to_the_local_one():
    poses = RobotPoses(Pose2D(2.0, 1.0, np.pi / 2), Pose2D(0.0, 3.0, 0.0))
    transform = poses.local_from_global
    assert transform is not None
    # Turned by -90 degrees: (2, 1) becomes (1, -2); (0, 3) - (1, -2) = (-1, 5).
    assert (transform.x_m, transform.y_m) == pytest.approx((-1.0, 5.0))
    assert transform.yaw_rad == pytest.approx(-np.pi / 2)


def test_shutdown_costmaps_skips_updates_without_a_goal():
    flight = Flight(shutdown_costmaps=True)
    flight.until(2.0)
    assert flight.global_costmap.updates == []
    ticks = flight.until(3.1)
    times = [tick.now_s for tick in ticks if "local" in tick.windows]
    assert times == pytest.approx([2.25, 2.5, 2.75, 3.0])  # what was not sent yet can go out
    assert all(window is None for tick in ticks for window in tick.windows.values())
    begin_s = flight.now_s
    flight.navigator.set_goal(GOAL, begin_s)
    flight.until(5.0)
    assert flight.global_costmap.updates[0] == begin_s  # before the first plan
    assert len(flight.global_costmap.updates) >= 5


@pytest.mark.parametrize("tree, at_s", [(ALONE, 1.0), (UPSTREAM, 1.1)])
@pytest.mark.parametrize("kind", ["planner", "controller"])
def test_another_planner_stops_the_robot_which_plans_anew(tree, at_s, kind):
    flight = Flight(tree=tree)
    flight.navigator.set_goal(GOAL, 0.0)
    flight.until(0.92)
    flight.now_s = 0.95
    assert flight.planner.calls == 1
    if kind == "planner":
        flight.planner = FakePlanner()
        flight.navigator.change_planner(flight.planner)
    else:
        flight.controller = FakeController()
        flight.navigator.change_controller(flight.controller)
    assert flight.navigator.has_work
    stopped = flight.until(at_s - 0.01)
    assert {tick.command for tick in stopped if tick.command} == {Twist2D()}
    assert stopped[0].command == Twist2D()
    flown = [tick for tick in flight.until(2.0) if tick.command is not None]
    assert flown[0].now_s == pytest.approx(at_s)
    assert {tick.command for tick in flown} == {FORWARD}
    assert flight.planner.calls == (1 if kind == "planner" else 2)
    assert len(flight.controller.plans) == (2 if kind == "planner" else 1)


def test_another_planner_ends_a_recovery_and_an_idle_robot_stays_idle():
    recovery = FakeRecovery(steps=200)
    flight = Flight([NamedRecovery("rotate", recovery)], ALONE, planner_patience_s=0.5)
    flight.planner.fails = True
    flight.navigator.set_goal(GOAL, 0.0)
    flight.until(2.0)
    assert flight.navigator.state is State.CLEARING
    flight.navigator.change_planner(FakePlanner())
    flight.until(2.2)
    assert flight.navigator.state is State.CONTROLLING
    flight.navigator.cancel()
    flight.navigator.change_controller(FakeController())
    assert flight.until(3.0)[-1].state is State.IDLE


def test_retries_of_upstream_take_no_time():
    """3 retries at 5 Hz with two recoveries: the abort comes after five periods, as recorded."""
    recoveries = [NamedRecovery(f"r{k}", FakeRecovery()) for k in range(2)]
    flight = Flight(recoveries, controller_frequency_hz=5.0, max_planning_retries=3)
    flight.planner.fails = True
    flight.navigator.set_goal(GOAL, 0.0)
    assert [tick.now_s for tick in flight.until(5.0) if tick.outcome] == [pytest.approx(1.0)]


@pytest.mark.parametrize("tree, at_s", [(ALONE, 1.5), (UPSTREAM, 4.0)])
def test_a_recovery_of_upstream_delays_goals(tree, at_s):
    """The rotation lasts for 4 s or so; a control cycle follows it at once."""
    recovery = FakeRecovery(steps=60, period_s=0.05)
    flight = Flight([NamedRecovery("rotate", recovery)], tree, planner_patience_s=0.5)
    flight.planner.fails = True
    flight.navigator.set_goal(GOAL, 0.0)
    flight.until(1.4)
    assert recovery.started == 1
    while not flight.navigator.accepts_goal(flight.now_s):
        flight.until(flight.now_s)
    assert flight.now_s == pytest.approx(at_s, abs=0.5)


@pytest.mark.parametrize("tree, commands", [(ALONE, [Twist2D()]), (UPSTREAM, [FORWARD])])
def test_upstream_commands_once_more_before_it_recovers_from_oscillation(tree, commands):
    flight = Flight([NamedRecovery("r", FakeRecovery())], tree, oscillation_timeout_s=2.0)
    flight.navigator.set_goal(GOAL, 0.0)
    entered = [tick for tick in flight.until(2.15) if tick.state is State.CLEARING]
    assert [tick.command for tick in entered] == commands


@pytest.mark.parametrize("tree, recovers", [(ALONE, False), (UPSTREAM, True)])
def test_upstream_recovers_when_its_pose_is_lost(tree, recovers):
    flight = Flight([NamedRecovery("r", FakeRecovery())], tree, planner_patience_s=2.0)
    flight.navigator.set_goal(GOAL, 0.0)
    flight.until(1.0)
    flight.pose = None
    ticks = flight.until(5.0)
    assert any(tick.recovery for tick in ticks) is recovers
    before = [tick.command for tick in ticks if not tick.recovery and tick.command]
    assert set(before) == {Twist2D()}


@pytest.mark.parametrize(
    "error, searched", [(NoPath("walled in"), True), (GoalOutsideMap("far away"), False)]
)
def test_a_goal_outside_of_the_map_is_not_searched_for(error, searched):
    flight = Flight()
    flight.planner.fails, flight.planner.error = True, error
    flight.navigator.set_goal(GOAL, 0.0)
    failed = [tick for tick in flight.until(0.5) if tick.planning_failed]
    assert failed and {tick.no_path for tick in failed} == {searched}
