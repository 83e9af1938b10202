"""Faults of a localization: the quadcopter hovers, or a message is refused, and it flies on."""

from __future__ import annotations

import math
from typing import Callable, NamedTuple, Sequence

import pytest

pytest.importorskip("rospy")
pytest.importorskip("greenlet")

from hypothesis import strategies as st  # noqa: E402
from hypothesis.stateful import (  # noqa: E402
    RuleBasedStateMachine,
    initialize,
    invariant,
    rule,
)
from interaction.localized_world import NODES, WRONG, LocalizedWorld  # noqa: E402
from interaction.machines import assert_sound, machine_settings  # noqa: E402

from quad_nav.geometry import Pose2D  # noqa: E402

GOAL, START, FAR = Pose2D(6.5, 6.5), Pose2D(1.5, 1.5), Pose2D(1e5, 1e5)
LOST = "lost: scans do not fit the map"
HOVERS_AFTER_S, FAULT_S, RESUMES_WITHIN_S = 1.5, 3.0, 6.0
NEAR_M = 0.15


class Fault(NamedTuple):
    """A fault.

    Attributes:
        begins: What spoils the world.
        ends: What repairs it.
        hovers: Whether the quadcopter hovers meanwhile.
        line: Part of a line in the log.
        names: The localizations that it concerns.
    """

    begins: Callable[[LocalizedWorld], object]
    ends: Callable[[LocalizedWorld], object]
    hovers: bool
    line: str
    names: Sequence[str] = tuple(NODES)


def loses(*data):
    return lambda world: world.lost.update(data), lambda world: world.lost.clear()


def spoils(what):
    return lambda world: world.spoilt.add(what), lambda world: world.spoilt.clear()


def gives(pose=WRONG, **more):
    return lambda world: world.give(pose, **more), lambda world: None


def gives_until_corrected(pose):
    return lambda world: world.give(pose), lambda world: world.give(world.bodies[0].pose)


def jumps(far_m):
    def moves(by_m):
        return lambda world: setattr(world, "jump_m", by_m)

    return moves(far_m), moves(0.0)


def steps_clock(seconds):
    return lambda world: world.step_clock(seconds), lambda world: None


FAULTS = {
    "LIDAR lost": Fault(*loses("scan"), True, "no message on /scan0"),
    "odometry lost": Fault(*loses("tf", "odometry"), True, "robot pose unknown"),
    "clock jumps back": Fault(*steps_clock(-2.0), False, "the clock jumped back"),
    "clock jumps far back": Fault(*steps_clock(-60.0), False, "the clock jumped back"),
    "clock jumps forward": Fault(*steps_clock(20.0), False, ""),
    "initialpose in another frame": Fault(
        *gives(frame="odom0"), False, "initial pose dropped: frame 'odom0', expected 'map'"
    ),
    "initialpose of NaN": Fault(
        *gives(Pose2D(math.nan, 1.0)), False, "initial pose dropped: position (nan"
    ),
    "covariance of NaN": Fault(
        *gives(variance=math.nan), False, "initial pose dropped: the covariance"
    ),
    "wrong initial pose": Fault(*gives_until_corrected(WRONG), True, LOST, ("slam",)),
    "initialpose far away": Fault(*gives_until_corrected(FAR), True, LOST, ("slam",)),
    "odometry jumps": Fault(*jumps(50.0), True, LOST, ("slam",)),
    "ranges of NaN": Fault(*spoils("ranges"), True, "scan rejected"),
    "odometry of NaN": Fault(*spoils("odometry pose"), True, "transform dropped"),
    "mount of NaN": Fault(*spoils("mount"), True, "transform dropped"),
    "map origin of NaN": Fault(
        lambda world: world.send_map(math.nan),
        lambda world: world.send_map(),
        False,
        "map dropped: origin (nan",
        ("amcl",),
    ),
}
CASES = [(name, one) for one, fault in FAULTS.items() for name in fault.names]


@pytest.fixture
def world(name, has_map):
    world = LocalizedWorld(name, has_map, 100 * 10**9)
    world.send_goal(GOAL)
    yield world
    world.close()


@pytest.mark.parametrize("has_map", [True])
@pytest.mark.parametrize("name, fault", CASES)
def test_a_fault_in_flight(world, fault):
    fault = FAULTS[fault]
    world.run(2.0)
    assert not world.is_hovering and world.error_m < NEAR_M
    begin = len(world.graph.log)
    fault.begins(world)
    if fault.hovers:
        world.run(HOVERS_AFTER_S)
        here = world.bodies[0].pose
        world.run(FAULT_S)
        assert world.bodies[0].pose == here
    fault.ends(world)
    assert_flies_on(world)
    assert world.has_logged(fault.line, begin), world.graph.log[begin:]


def assert_flies_on(world):
    """The quadcopter moves, and knows where it is."""
    here = world.bodies[0].pose
    assert world.graph.run(
        RESUMES_WITHIN_S, lambda: world.bodies[0].pose.distance_to(here) > 0.5
    ), world.graph.log
    assert world.error_m < NEAR_M
    assert_sound(world.graph)


@pytest.mark.parametrize("name, has_map", [("amcl", False)])
def test_no_map_and_a_map_that_comes_late(world):
    here = world.bodies[0].pose
    world.run(FAULT_S)
    assert world.bodies[0].pose == here
    assert world.has_logged("amcl0: no map yet")
    world.send_map(math.nan)
    world.run(FAULT_S)
    assert world.bodies[0].pose == here
    assert world.has_logged("map dropped: origin (nan")
    world.send_map()
    assert_flies_on(world)


class LocalizedMachine(RuleBasedStateMachine):
    """Faults in any order and combination.

    Attributes:
        world: The quadcopters and their nodes.
        faults: Those that have begun.
    """

    @initialize(name=st.sampled_from(sorted(NODES)))
    def begin(self, name):
        self.world, self.faults = LocalizedWorld(name, True, 100 * 10**9), []
        self.world.send_goal(GOAL)
        self.world.run(1.0)

    def teardown(self):
        if hasattr(self, "world"):
            self.world.close()

    @rule(seconds=st.sampled_from([0.1, 0.5, 1.5, 3.0]))
    def time_passes(self, seconds):
        self.world.run(seconds)

    @rule(fault=st.sampled_from(sorted(FAULTS)))
    def a_fault_begins(self, fault):
        if self.world.localization in FAULTS[fault].names:
            FAULTS[fault].begins(self.world)
            self.faults.append(FAULTS[fault])

    @rule()
    def all_faults_end(self):
        """And a person says where the quadcopter is, and sends it to the other end."""
        for fault in self.faults:
            fault.ends(self.world)
        self.faults.clear()
        self.world.run(2.0)
        self.world.give(self.world.bodies[0].pose)
        self.world.send_goal(max(GOAL, START, key=self.world.bodies[0].pose.distance_to))
        assert_flies_on(self.world)

    @invariant()
    def no_node_crashes(self):
        assert_sound(self.world.graph)

    @invariant()
    def without_a_place_it_hovers(self):
        came_s, _ = self.world.frame
        if self.world.flown_s - came_s > HOVERS_AFTER_S:
            assert self.world.is_hovering


TestLocalizedMachine = LocalizedMachine.TestCase
TestLocalizedMachine.settings = machine_settings(few=8, share=0.05)
