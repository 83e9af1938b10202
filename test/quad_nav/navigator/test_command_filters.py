"""Command filters: what they are given, what they may change, and what nothing overrides."""

from __future__ import annotations

from dataclasses import replace

import pytest
from fake_navigator import FORWARD, GOAL, HERE, FakeRecovery, Flight
from upstream import UPSTREAM

from quad_nav import config
from quad_nav.costmap.scan_validator import ScanValidator
from quad_nav.errors import InputError
from quad_nav.geometry import Twist2D
from quad_nav.navigator.command_filter import Command, CommandFilter, StopReason, VoronoiCell
from quad_nav.navigator.recovery_sequence import NamedRecovery
from quad_nav.navigator.tick import RobotPoses, State
from quad_nav.peers.peer import Intention, Peer, idle_priority

ASIDE = Twist2D(vy_mps=0.2)
BOTH = RobotPoses(HERE, HERE)


class Replaces(CommandFilter):
    """Commands the same velocity whatever it is given."""

    def __init__(self, velocity=ASIDE, acts_when_idle=False, limited_by=""):
        self.velocity, self.acts_when_idle, self.limited_by = velocity, acts_when_idle, limited_by
        self.given, self.situations, self.resets = [], [], 0

    def filter(self, command, situation):
        self.given.append(command)
        self.situations.append(situation)
        if self.velocity is None:
            return command
        return Command(self.velocity, limited_by=self.limited_by)

    def reset(self):
        self.resets += 1


def flight_with(*filters, recoveries=(), **params):
    return Flight(recoveries, {}, filters, **params)


def ticks(flight, seconds, poses=BOTH, peers=()):
    end_s, found = flight.now_s + seconds, []
    while flight.now_s < end_s - 1e-9:
        found.append(flight.navigator.tick(flight.now_s, poses, FORWARD, peers))
        flight.now_s += 1 / 40
    return found


def test_each_filter_is_given_what_the_one_before_returned():
    first, second = Replaces(), Replaces(None)
    flight = flight_with(first, second)
    flight.navigator.set_goal(GOAL, 0.0)
    commands = [tick.command for tick in ticks(flight, 0.5) if tick.command]
    assert set(commands) == {ASIDE}
    assert Command(FORWARD) in first.given
    assert [one.velocity for one in second.given] == commands
    assert [one.last for one in second.situations] == [Twist2D(), *commands[:-1]]


def test_a_situation_has_the_plan_that_is_followed():
    watches = Replaces(None)
    flight = flight_with(watches)
    flight.navigator.set_goal(GOAL, 0.0)
    ticks(flight, 0.5)
    last = watches.situations[-1]
    assert last.plan[-1, :2].tolist() == [GOAL.x_m, GOAL.y_m]
    assert (last.pose, last.map_pose, last.velocity) == (HERE, HERE, FORWARD)
    assert last.period_s == pytest.approx(0.1) and last.tracks is None


def ends(flight):
    flight.controller.reached = True


def cannot_plan(flight):
    flight.planner.fails = True


def cannot_control(flight):
    flight.controller.fails = True


@pytest.mark.parametrize(
    "what, reason",
    [
        (ends, StopReason.GOAL_ENDED),
        (cannot_plan, StopReason.NO_PLAN),
        (cannot_control, StopReason.NO_TRAJECTORY),
    ],
)
def test_a_filter_can_ask_why_a_command_is_a_stop(what, reason):
    watches = Replaces(None)
    flight = Flight([], {"escape_collision": False}, [watches])
    what(flight)
    flight.navigator.set_goal(GOAL, 0.0)
    stops = [tick.stop for tick in ticks(flight, 0.5) if tick.stop]
    assert reason in stops and reason in [one.stop for one in watches.given]


def no_scans(flight):
    flight.local_costmap.stale = [("obstacle_layer/base_scan", 1.3)]
    return BOTH


def no_pose(flight):
    return RobotPoses(None, None)


@pytest.mark.parametrize("lose", [no_scans, no_pose])
@pytest.mark.parametrize("does", ["controls", "recovers", "hovers"])
def test_no_filter_moves_a_robot_without_data(does, lose):
    """The stop for missing data comes after the filters."""
    pushes = Replaces(acts_when_idle=True)
    rotate = NamedRecovery("rotate", FakeRecovery(steps=1000))
    flight = flight_with(pushes, recoveries=[rotate], planner_patience_s=0.2)
    flight.planner.fails = does == "recovers"
    if does != "hovers":
        flight.navigator.set_goal(GOAL, 0.0)
    before = ticks(flight, 1.5)
    assert ASIDE in [tick.command for tick in before]
    found = ticks(flight, 3.0, lose(flight))
    assert all(tick.command.is_zero for tick in found if tick.command)
    assert any(tick.is_stopped for tick in found) and pushes.resets > 0


def test_a_clock_that_jumps_back_resets_the_filters():
    watches = Replaces(None)
    flight = flight_with(watches)
    for costmap in (flight.global_costmap, flight.local_costmap):
        costmap.reset_layers = lambda now_s: None
    flight.navigator.restart(0.0)
    assert watches.resets == 1


def test_upstream_goes_on_recovering_without_scans():
    flight = Flight(
        [NamedRecovery("rotate", FakeRecovery(steps=1000))], UPSTREAM, [], planner_patience_s=0.2
    )
    flight.planner.fails = True
    flight.navigator.set_goal(GOAL, 0.0)
    ticks(flight, 1.5)
    assert Twist2D(vyaw_radps=1.0) in [
        tick.command for tick in ticks(flight, 1.0, no_scans(flight))
    ]


def test_an_idle_robot_says_nothing_unless_a_filter_acts():
    assert not any(tick.command for tick in ticks(flight_with(Replaces()), 1.0))
    hovers = Replaces(None, acts_when_idle=True)
    flight = flight_with(hovers)
    assert not any(tick.command for tick in ticks(flight, 1.0))
    assert {one.stop for one in hovers.given} == {StopReason.IDLE}
    assert len(hovers.given) == pytest.approx(10, abs=1)
    hovers.velocity = ASIDE
    assert len([tick for tick in ticks(flight, 1.0) if tick.command == ASIDE]) >= 9
    hovers.velocity = None
    stops = [tick.command for tick in ticks(flight, 1.0) if tick.command]
    assert stops == [Twist2D()]  # once, after the filter's last command


def test_a_robot_that_is_held_back_is_patient():
    """Without progress it would replan after 2 s."""
    for limited_by, is_patient in (("somebody", True), ("", False)):
        flight = flight_with(Replaces(Twist2D(), limited_by=limited_by))
        params = flight.navigator.params
        flight.navigator.set_params(
            replace(params, progress=replace(params.progress, timeout_s=2.0))
        )
        flight.navigator.set_goal(GOAL, 0.0)
        found = ticks(flight, 4.0)
        warned = [line for tick in found for line in tick.warnings if "no progress" in line]
        assert (not warned) is is_patient
        assert found[-1].state in (State.CONTROLLING, State.PLANNING)


def test_the_voronoi_cell_names_the_peer_that_limits():
    flight = flight_with(VoronoiCell())
    flight.navigator.set_goal(GOAL, 0.0)
    peer = Peer("quad1", 1.35, 1.0, -0.2, 0.0, 0.0, Intention(idle_priority(1)))
    found = []
    for _ in range(40):
        found += ticks(flight, 0.025, peers=[replace(peer, stamp_s=flight.now_s)])
    assert "quad1" in {tick.limited_by for tick in found if tick.command}


@pytest.mark.parametrize(
    "entries, problem",
    [
        ("peers", "'peers' is not a list"),
        ([{"name": "peers"}], "is not a filter; expected {name: , type: }"),
        ([{"name": "a", "type": "quad/VoronoiCell"}] * 2, "'a' is used twice"),
        ([{"name": "a", "type": "no_such_package/Class"}], "no module no_such_package"),
        ([{"name": "a", "type": "quad/ScanValidator"}], "is not derived from CommandFilter"),
        ([{"name": "a", "type": "quad_nav.geometry.Pose2D"}], "is not derived from CommandFilter"),
    ],
)
def test_a_list_with_a_fault_is_refused(entries, problem):
    with pytest.raises(InputError) as caught:
        config.load({"command_filters": entries})
    assert any("command_filters" in line and problem in line for line in caught.value.problems)


def test_the_default_lists_have_the_filters_of_the_core():
    configuration = config.load({})
    ((scan_name, scan_filter),) = configuration.scan_filters
    ((command_name, command_filter),) = configuration.command_filters
    assert (scan_name, scan_filter.plugin_class) == ("validator", ScanValidator)
    assert (command_name, command_filter.plugin_class) == ("peers", VoronoiCell)
    assert config.load({"command_filters": []}).command_filters == ()
