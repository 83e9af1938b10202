"""A mission that is stopped and resumed, edited, reset, and killed in any order and combination."""

from __future__ import annotations

from functools import lru_cache

import pytest

pytest.importorskip("rospy")
pytest.importorskip("greenlet")

from hypothesis import strategies as st  # noqa: E402
from hypothesis.stateful import (  # noqa: E402
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
)
from interaction.machines import assert_sound, machine_settings  # noqa: E402
from interaction.mission_world import (  # noqa: E402
    ROBOTS,
    STEP_S,
    MissionWorld,
)

from quad_nav.mission.actions import Event  # noqa: E402

ROBOT = st.integers(0, ROBOTS - 2)
UNTOUCHED = ROBOTS - 1
"""Nothing happens to this quadcopter alone."""
GRACE_S = 0.6
"""A quadcopter stands so soon after a stop, and flies so soon after a resumption."""
TIME_ERROR_S = 0.5
"""Of the times that are counted here, and as much for each clock that has jumped meanwhile."""
LOST_S = 8.0
"""A quadcopter that should fly has a goal within this time."""
EDITS = st.sampled_from(
    [
        ((0.0, 2.0), (0.0, 0.0), (1.5, 1.0)),
        ((0.0, 2.0), (1.0, 0.0)),
        ((0.0, 2.0), (0.0, 0.0), (1.5, 1.0), (0.0, 1.0)),
    ]
)


@lru_cache(maxsize=None)
def undisturbed():
    """Return the poses of `UNTOUCHED` by the step, while nothing happens to the others."""
    world, poses = MissionWorld(), {}
    world.on_step = lambda: poses.setdefault(world.steps, world.poses[UNTOUCHED])
    world.graph.run(30.0)
    world.close()
    return poses


class Goal:
    """What is known of the goal that a quadcopter has.

    Attributes:
        place: (lap, index).
        attempt: Number of the attempt.
        flown_s: Time since it was first sent, without that for which the mission was stopped.
        error_s: How far the sequencer's time may be from that.
        is_uncertain: The clock has changed while there was no sequencer: the next one knows the
            time up to its last line in the journal alone.
    """

    def __init__(self, place):
        self.place, self.attempt, self.flown_s = place, 1, 0.0
        self.error_s, self.is_uncertain = TIME_ERROR_S, False


class MissionMachine(RuleBasedStateMachine):
    """What happens to the quadcopters.

    Attributes:
        world: The quadcopters and the sequencer.
        stopped: Numbers of those whose mission is stopped.
        changed_s: When the stop of each was asked for, or its resumption.
        goals: What each flies to, None before the first, after the last, and in a stay.
        ended: (lap, index) of the goals that each has flown.
        waits_s: For how long each has had nothing to do although its mission goes on.
        is_alone: Whether nothing has happened yet that concerns `UNTOUCHED`, too.
    """

    @initialize()
    def begin(self):
        self.stopped, self.changed_s = set(), [0.0] * ROBOTS
        self.goals, self.ended = [None] * ROBOTS, [set() for _ in range(ROBOTS)]
        self.waits_s, self.is_alone, self.faults = [0.0] * ROBOTS, True, []
        undisturbed()
        self.world = MissionWorld()
        self.world.on_event, self.world.on_step = self.take_event, self.take_step
        self.world.on_reset = self.take_reset
        self.run(2.0)

    def teardown(self):
        if hasattr(self, "world"):
            self.world.close()

    def run(self, seconds):
        self.world.graph.run(seconds)

    # What is known of the flight.

    def take_reset(self):
        """Forget the flight before a reset."""
        self.goals, self.ended = [None] * ROBOTS, [set() for _ in range(ROBOTS)]

    def take_event(self, event):
        """Follow what the sequencer says."""
        robot, place = event.robot, (event.lap, event.goal)
        if event.event is not Event.SENT:
            self.goals[robot] = None
            if event.event is not Event.DONE:
                self.ended[robot].add(place)
        elif not event.reason:
            self.goals[robot] = Goal(place)
            if place in self.ended[robot]:
                self.faults.append(f"flown twice: {event}")
        else:
            self.check_again(robot, place, event)

    def check_again(self, robot, place, event):
        """Check a goal that is sent again."""
        goal = self.goals[robot]
        if goal is None or goal.place != place or event.attempts < goal.attempt:
            self.faults.append(f"sent again: {event}")
            return
        goal.attempt = event.attempts
        is_resumed = self.world.graph.threads.now_s - self.changed_s[robot] < GRACE_S
        if "resumed" in event.reason and not is_resumed:
            self.faults.append(f"resumed without being stopped: {event}")

    def change_clock(self):
        """Note that the simulated clock has another time."""
        self.is_alone = False
        for goal in self.goals:
            if goal is not None:
                goal.error_s += TIME_ERROR_S
                goal.is_uncertain |= self.world.sequencer is None

    def take_step(self):
        """Count the times after a step of the simulation."""
        world = self.world
        for robot, goal in enumerate(self.goals):
            if goal is not None and robot not in self.stopped:
                goal.flown_s += STEP_S
            has_nodes = world.sequencer is not None and robot in world.pilots
            is_busy = not has_nodes or world.pilots[robot].goal is not None
            is_over = robot in self.stopped or (world.runner and world.runner.robots[robot].is_done)
            self.waits_s[robot] = 0.0 if is_busy or is_over else self.waits_s[robot] + STEP_S

    # What happens.

    @rule(seconds=st.sampled_from([0.2, 1.0, 3.0, 8.0]))
    def time_passes(self, seconds):
        self.run(seconds)

    def ask(self, request, robot=None):
        """Stop or resume the mission of a robot, or of all."""
        robots = range(ROBOTS) if robot is None else [robot]
        name = "/mission" if robot is None else f"/mission/quad{robot}"
        self.is_alone &= robot is not None
        changed = [one for one in robots if (one in self.stopped) == (request == "resume")]
        for one in changed:
            self.changed_s[one] = self.world.graph.threads.now_s
        response = self.world.call(f"{name}/{request}")
        if response is not None and response.success:
            (self.stopped.difference_update if request == "resume" else self.stopped.update)(robots)
        self.run(0.2)

    @rule(robot=ROBOT)
    def one_is_stopped(self, robot):
        self.ask("stop", robot)

    @rule(robot=ROBOT)
    def one_is_resumed(self, robot):
        self.ask("resume", robot)

    @rule()
    def all_are_stopped(self):
        self.ask("stop")

    @rule()
    def all_are_resumed(self):
        self.ask("resume")

    @rule(robot=ROBOT, places=EDITS)
    def goals_are_edited(self, robot, places):
        self.world.write_goals(robot, places)
        self.run(1.2)

    @rule(robot=ROBOT)
    def the_navigator_gives_up(self, robot):
        if robot in self.world.pilots:
            self.world.pilots[robot].aborts = True
        self.run(0.2)

    @rule(robot=ROBOT, is_stuck=st.booleans())
    def a_quadcopter_is_stuck_or_free(self, robot, is_stuck):
        (self.world.stuck.add if is_stuck else self.world.stuck.discard)(robot)
        self.run(0.2)

    @rule(robot=ROBOT)
    def the_navigator_is_restarted(self, robot):
        self.world.kill_pilot(robot)
        self.run(0.5)
        self.world.start_pilot(robot)
        self.run(0.2)

    @precondition(lambda self: self.world.sequencer is not None)
    @rule()
    def the_sequencer_is_killed(self):
        self.is_alone = False
        self.world.kill_sequencer()
        self.run(0.5)

    @precondition(lambda self: self.world.sequencer is None)
    @rule()
    def the_sequencer_is_started_again(self):
        self.world.start_sequencer(True)
        self.run(1.0)

    @rule()
    def the_clock_stands_still(self):
        self.is_alone = False  # the sequencer goes on meanwhile
        self.world.is_running = False
        self.run(1.5)
        self.world.is_running = True
        self.run(0.2)

    @rule(seconds=st.sampled_from([-0.7, 0.7]))
    def the_clock_steps(self, seconds):
        self.change_clock()
        self.world.step_clock(seconds)
        for robot, goal in enumerate(self.goals):
            if goal is not None and robot not in self.stopped:
                goal.flown_s += max(seconds, 0.0)
        self.run(0.5)

    @rule()
    def the_simulator_is_restarted(self):
        self.change_clock()
        self.world.kill_simulator()
        self.run(0.7)
        self.world.start_simulator()
        self.run(1.0)

    @precondition(lambda self: self.world.sequencer is not None)
    @rule()
    def the_simulation_is_reset(self):
        self.is_alone = False
        self.world.reset()
        self.run(1.0)

    # What must hold.

    @invariant()
    def no_node_crashes(self):
        assert_sound(self.world.graph)

    @invariant()
    def the_sequencer_sends_each_goal_as_it_should(self):
        assert not self.faults, self.faults

    @invariant()
    def a_stopped_quadcopter_stands(self):
        for robot in self.stopped:
            if self.world.graph.threads.now_s - self.changed_s[robot] > GRACE_S:
                assert not self.world.moved[robot], robot
                assert robot not in self.world.pilots or self.world.pilots[robot].goal is None

    @invariant()
    def a_mission_goes_on(self):
        assert max(self.waits_s) < LOST_S

    @invariant()
    def times_are_those_of_the_flight(self):
        world = self.world
        for robot, goal in enumerate(self.goals):
            if world.sequencer is None or world.runner is None or robot in self.stopped:
                continue
            active = world.runner.robots[robot].sequencer.active_goal
            if active is None or goal is None:
                continue
            seconds = world.now_s - active.first_sent_s
            if goal.is_uncertain and 0.0 <= seconds <= goal.flown_s:
                goal.flown_s, goal.is_uncertain = seconds, False
            assert abs(seconds - goal.flown_s) < goal.error_s, (robot, seconds, goal.flown_s)
            assert active.attempt >= goal.attempt

    @invariant()
    def the_other_quadcopter_flies_as_it_would_have(self):
        if self.is_alone and self.world.steps in undisturbed():
            assert self.world.poses[UNTOUCHED] == undisturbed()[self.world.steps]


TestMissionMachine = MissionMachine.TestCase
TestMissionMachine.settings = machine_settings(few=100, share=0.8)
