"""A navigator whose sensors, clock, peers and parameters fail in any order and combination."""

from __future__ import annotations

import math
from functools import lru_cache

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
from interaction.machines import assert_sound, machine_settings  # noqa: E402
from interaction.navigator_world import (  # noqa: E402
    CONTROL_HZ,
    STEP_S,
    NavigatorWorld,
    Walker,
)

from quad_nav.config.planners import SLOTS  # noqa: E402
from quad_nav.geometry import Pose2D, Twist2D  # noqa: E402

TIMEOUT_S = 0.5
"""Of scans, odometry and tf, in all configurations."""
THROTTLE_S = 5.0
"""A line that is like an earlier one is not logged again for so long."""
DATA = st.sampled_from(["scan", "odometry", "tf", "second scan", "peer"])
GOALS = (Pose2D(6.5, 4.0), Pose2D(4.0, 6.5), Pose2D(1.5, 1.5))
CLOCKS = st.sampled_from([(10**9, False), (10**9, True), (1_700_000_000 * 10**9 + 1, False)])
"""Begin in ns, and whether it is rounded: of a simulator, or of a real quadcopter."""
WALKERS = st.sampled_from([(4.0, 7.0, 0.0, -1.0), (7.0, 4.0, -1.0, 0.0), (1.5, 7.0, 0.0, -0.6)])
PLANNERS = st.sampled_from([(key, name) for key, slot in SLOTS.items() for name in slot.types])
AT_GOAL_M = 0.3
LOST_S = 0.9
"""A navigator has stopped for lost data by then."""
SEEN_S = 1.5
"""A walker is tracked by then."""
WATCHED_S = 2.5
"""A walker has a good track after this time."""


@lru_cache(maxsize=None)
def undisturbed(name, clock):
    """Return quadcopter 1's poses by the step, while nothing happens to quadcopter 0."""
    world, poses = NavigatorWorld(name, False, False, *clock), {}
    while world.flown_s < 20.0:
        poses[round(world.flown_s / STEP_S)] = world.bodies[1].pose
        world.run(STEP_S / 2.0)
    world.close()
    return poses


class NavigatorMachine(RuleBasedStateMachine):
    """What happens to quadcopter 0.

    Attributes:
        world: The quadcopters and their nodes.
        hz: Control frequency.
        goal_s: When quadcopter 0 was sent its goal; None if it has ended or was cancelled.
        idle_s: When it was last known to have one.
        quiet_s: Since when nothing but time has passed.
        is_disturbed: Whether anything has failed so far.
        is_alone: Whether nothing has happened so far that concerns quadcopter 1, too.
    """

    @initialize(
        name=st.sampled_from(["default", "moving", "people"]),
        is_composed=st.booleans(),
        has_second_lidar=st.booleans(),
        clock=CLOCKS,
    )
    def begin(self, name, is_composed, has_second_lidar, clock):
        undisturbed(name, clock)
        self.world = NavigatorWorld(name, is_composed, has_second_lidar, *clock)
        self.name, self.clock, self.group = name, clock, (0, 1) if is_composed else (0,)
        self.hz, self.is_disturbed, self.is_alone = CONTROL_HZ, False, True
        self.cancelled_s = []
        self.a_goal_is_sent(GOALS[0])
        self.let_time_pass(1.0)
        self.begun = len(self.world.graph.log)

    def teardown(self):
        if hasattr(self, "world"):
            self.world.close()

    def let_time_pass(self, seconds):
        self.world.run(seconds)
        self.quiet_s = self.world.flown_s

    # What happens.

    @rule(seconds=st.sampled_from([0.1, 0.5, 1.2, 3.0]))
    def time_passes(self, seconds):
        self.world.run(seconds)

    @rule(name=DATA)
    def data_is_lost(self, name):
        self.is_disturbed = True
        self.world.lost.add(name)
        self.let_time_pass(LOST_S)

    @rule(name=DATA)
    def data_returns(self, name):
        self.world.lost.discard(name)
        self.let_time_pass(0.3)

    @rule(walker=WALKERS)
    def somebody_walks_in(self, walker):
        self.world.walkers = [Walker(*walker)]
        self.let_time_pass(SEEN_S)

    @rule(pose=st.sampled_from([Pose2D(4.0, 4.0), Pose2D(5.0, 5.0), None]))
    def a_peer_comes_or_goes(self, pose):
        is_near = pose is not None and pose.distance_to(self.world.bodies[0].pose) < 1.0
        self.world.peer = None if is_near else pose
        self.let_time_pass(0.3)

    @rule(pose=st.sampled_from(GOALS))
    def a_goal_is_sent(self, pose):
        self.goal_s = self.world.flown_s
        self.world.send_goal(pose)
        self.let_time_pass(0.3)

    @rule()
    def the_goal_is_cancelled(self):
        self.goal_s = None
        self.cancelled_s.append(self.world.graph.threads.now_s)
        self.world.cancel()
        self.let_time_pass(0.3)

    @rule(hz=st.sampled_from([0.5 * CONTROL_HZ, CONTROL_HZ]))
    def the_control_frequency_changes(self, hz):
        self.hz = hz
        self.world.reconfigure({"controller_frequency": hz})
        self.let_time_pass(0.3)

    @rule(planner=PLANNERS)
    def a_planner_changes(self, planner):
        self.world.reconfigure(dict([planner]))
        self.let_time_pass(0.3)

    @rule()
    def the_navigator_is_restarted(self):
        self.is_disturbed, self.hz, self.goal_s = True, CONTROL_HZ, None
        self.is_alone &= len(self.group) == 1
        self.world.kill_navigators(self.group)
        self.let_time_pass(0.7)
        self.world.start_navigators(self.group)
        self.let_time_pass(0.3)

    @rule()
    def the_simulator_is_restarted(self):
        self.is_disturbed, self.is_alone = True, False
        self.world.kill_simulator()
        self.let_time_pass(0.7)
        self.world.start_simulator()
        self.let_time_pass(0.3)

    @rule(seconds=st.sampled_from([-0.7, 0.7]))
    def the_clock_steps(self, seconds):
        self.is_disturbed, self.is_alone = True, False
        self.world.step_clock(seconds)
        self.let_time_pass(0.3)

    @rule()
    def the_clock_stands_still(self):
        self.is_disturbed, self.is_alone = True, False
        self.world.is_running = False
        self.let_time_pass(2.0)
        self.world.is_running = True
        self.let_time_pass(0.3)

    # What must hold.

    @invariant()
    def no_node_crashes(self):
        assert_sound(self.world.graph)

    @invariant()
    def no_motion_is_commanded_without_data(self):
        late_s = TIMEOUT_S + 2.0 * STEP_S
        for command in self.world.commands:
            assert command.is_stop or command.oldest_s <= late_s, command
        if self.world.oldest_s > late_s + 1.0 / self.hz + STEP_S:
            assert self.world.bodies[0].velocity == Twist2D()

    @invariant()
    def no_control_period_has_two_commands(self):
        if any("recovery" in text for _, _, _, text in self.world.graph.log):
            return  # a recovery has a frequency of its own
        seconds = self.world.flown_s - self.quiet_s
        commands = [c for c in self.world.commands if c.flown_s > self.quiet_s + STEP_S / 2]
        assert len(commands) <= seconds * self.hz + 1.0 + 1e-6

    @invariant()
    def a_quadcopter_without_a_goal_stands_still(self):
        ended_s = self.world.results[-1] if self.world.results else -math.inf
        if self.goal_s is not None and ended_s < self.goal_s:
            return
        if self.name == "default" and self.world.flown_s - self.quiet_s > 1.0:
            assert self.world.bodies[0].velocity == Twist2D()

    @invariant()
    def every_stop_has_a_reason_in_the_log(self):
        for before, command in zip(self.world.commands, self.world.commands[1:]):
            away_m = min(command.pose.distance_to(goal) for goal in GOALS)
            is_asked = any(0.0 <= command.now_s - at_s < 1.0 for at_s in self.cancelled_s)
            if before.is_stop or not command.is_stop or away_m < AT_GOAL_M or is_asked:
                continue
            begin_s, end_s = command.now_s - THROTTLE_S, command.now_s + STEP_S
            assert any(
                begin_s <= at_s <= end_s and node == "/move_base0"
                for at_s, node, _, _ in self.world.graph.log
            ), command

    @invariant()
    def walkers_are_tracked_at_their_speed(self):
        world, fleet = self.world, self.world.fleets.get(self.group)
        seconds = world.flown_s - self.quiet_s
        if fleet is None or self.is_disturbed or seconds < WATCHED_S or not world.walkers:
            return
        tracks, walker = fleet.robots[0].scan_filters.tracks(world.now_s), world.walkers[0]
        if tracks is None:
            return
        for x_m, y_m, vx_mps, vy_mps in tracks.at(world.now_s).states.tolist():
            if math.dist((x_m, y_m), walker.place()) < 0.5:
                error_mps = math.dist((vx_mps, vy_mps), (walker.vx_mps, walker.vy_mps))
                assert error_mps < 0.15 * math.hypot(walker.vx_mps, walker.vy_mps), (vx_mps, vy_mps)

    @invariant()
    def no_message_is_dropped_while_nothing_fails(self):
        if not self.is_disturbed:
            lines = [text for _, _, _, text in self.world.graph.log[self.begun :]]
            assert not [text for text in lines if "dropped" in text or "rejected" in text], lines

    @invariant()
    def the_other_quadcopter_flies_as_it_would_have(self):
        steps, poses = round(self.world.flown_s / STEP_S), undisturbed(self.name, self.clock)
        if self.is_alone and steps in poses:
            assert self.world.bodies[1].pose == poses[steps]


TestNavigatorMachine = NavigatorMachine.TestCase
TestNavigatorMachine.settings = machine_settings(few=40, share=0.1)
