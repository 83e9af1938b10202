"""Our own messages: their fields come back as what they were made of, and are checked."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from quad_nav.geometry import Pose2D
from quad_nav.mission.actions import Event, GoalEnded, Level, SendGoal, SequenceDone
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.peers.right_of_way import Yield, YieldDecision
from quad_nav.recording import messages
from quad_nav.recording.trace import GoalTrace, goal_traces
from quad_nav.sim.contacts import Contact
from quad_nav.sim.scene import Scene, Walls
from quad_nav.topics.contacts import contact_fields, contact_from_message
from quad_nav.topics.flight_info import (
    FlightInfo,
    RobotInfo,
    flight_info_from_message,
    mission_info,
    simulation_info,
)
from quad_nav.topics.mission_events import (
    mission_event,
    mission_event_from_message,
)
from quad_nav.topics.right_of_way import (
    Kind,
    RightOfWay,
    right_of_way,
    right_of_way_from_message,
)
from quad_nav.topics.vehicle_states import State, state_from_message

SCENE = Scene("it", 10.0, 8.0, 1.0, Walls(), (), (Pose2D(1.0, 2.0, 0.0),))
GOAL = Goal(1.0, 2.0)
MAKING_ROOM = YieldDecision("quad2", Yield.MAKE_ROOM, Pose2D(1.5, -2.25, 0.3))
SENT = SendGoal(2, 1, Pose2D(1.0, 2.0, 0.5), 2, "aborted")


def passed_on(kind, fields, **changed):
    """Return a message as it is read from a recording."""
    built = messages.stamped(kind, {**fields, **changed}, 1)
    return messages.decode(messages.encode(built), kind)


@pytest.mark.parametrize(
    "kind, numbers", [("RightOfWay", Kind), ("MissionEvent", Event), ("MissionEvent", Level)]
)
def test_enumerations_have_the_numbers_of_their_messages(kind, numbers):
    found = {one.name: messages.constant(f"quad/{kind}", one.name) for one in numbers}
    assert found == {one.name: one.value for one in numbers}


def test_states_of_vehicles_have_the_numbers_of_their_message():
    for state in State:
        number = messages.constant("quad/VehicleState", state.name)
        assert state.number == number
        assert state_from_message(SimpleNamespace(state=number)) is state
    with pytest.raises(ValueError, match="state 10, expected 0 to 9"):
        state_from_message(SimpleNamespace(state=10))


def test_a_contact_comes_back():
    contact = Contact(13.25, "quad0", "wall", 1234.56789, 1 / 3)
    message = passed_on("quad/Contact", contact_fields(contact))
    assert contact_from_message(message, 13.25) == contact


@pytest.mark.parametrize(
    "changed", [{"x": math.nan}, {"y": -math.inf}, {"x": 1e300}, {"other": "w" * 201}]
)
def test_a_contact_with_odd_fields_is_refused(changed):
    fields = contact_fields(Contact(1.0, "quad0", "wall", 2.0, 3.0))
    with pytest.raises(ValueError, match="contact with"):
        contact_from_message(passed_on("quad/Contact", fields, **changed), 1.0)


@pytest.mark.parametrize(
    "action, event, level, text",
    [
        (SENT, Event.SENT, Level.INFO, "goal 3: sent (1.00, 2.00), attempt 2: aborted"),
        (
            GoalEnded(2, 1, GOAL, False, 4.5, 2, "aborted"),
            Event.SKIPPED,
            Level.WARNING,
            "goal 3: skipped: aborted",
        ),
        (
            GoalEnded(2, 1, GOAL, True, 4.5, 2, yaw_error_rad=0.25),
            Event.REACHED,
            Level.INFO,
            "goal 3: reached after 4.5 s",
        ),
        (SequenceDone(), Event.DONE, Level.INFO, "all goals have ended"),
    ],
)
def test_an_action_has_an_event_that_comes_back(action, event, level, text):
    told = mission_event(1, 4.5, action)
    assert (told.robot, told.event, told.level, told.text) == (1, event, level, text)
    message = passed_on("quad/MissionEvent", told.fields)
    assert mission_event_from_message(message, 4.5) == told


def test_an_action_of_another_kind_is_an_error():
    unknown = dataclasses.make_dataclass("Unknown", ["event", "level", "text"])(Event.SENT, 0, "")
    with pytest.raises(AssertionError, match="Unknown.* is not handled"):
        mission_event(0, 0.0, unknown)


@pytest.mark.parametrize(
    "changed",
    # An empty message must not say that a mission has ended: vehicles would land.
    [{"event": 0}, {"event": 5}, {"level": 9}, {"x": math.nan}, {"yaw": 1e300}],
)
def test_an_event_with_odd_fields_is_refused(changed):
    message = passed_on("quad/MissionEvent", mission_event(1, 4.5, SENT).fields, **changed)
    with pytest.raises(ValueError):
        mission_event_from_message(message, 4.5)


def test_the_end_of_a_goal_that_was_not_sent_belongs_to_no_other():
    def event(time_s, action):
        return mission_event(0, time_s, action)

    events = [
        event(1.0, GoalEnded(7, 1, GOAL, True, 1.0, 1)),
        event(2.0, SendGoal(0, 1, GOAL.pose, 1)),
        event(3.0, GoalEnded(0, 1, GOAL, True, 1.0, 1)),
        event(4.0, GoalEnded(1, 1, GOAL, False, 1.0, 3, "lost")),
        event(5.0, SequenceDone()),
    ]
    assert goal_traces(events, 1.0) == (GoalTrace(0, 1, GOAL.pose, 1.0, 2.0, True),)


def test_the_facts_of_two_publishers_are_merged_and_come_back():
    info = simulation_info(SCENE, 7).merged(
        mission_info(
            {"quad0": GoalSequence((GOAL, Goal(1.0, 2.0, 0.5)))},
            [{"controller_frequency": 10.0}],
            0.3,
        )
    )
    message = messages.flight_info(info)
    message = messages.decode(messages.encode(message), "quad/FlightInfo")
    back = flight_info_from_message(message)
    assert back == info
    assert (back.seed, back.start_s, back.robot_radius_m) == (7, 1.0, 0.3)
    goals = (GOAL, Goal(1.0, 2.0, 0.5))
    assert back.robots == (RobotInfo("quad0", goals, {"controller_frequency": 10.0}),)
    assert back.versions["numpy"] == np.__version__
    assert back.read_scene("it") == SCENE


def test_what_is_unknown_replaces_nothing():
    info = FlightInfo("it", seed=0, jitter_m=0.0)
    assert info.merged(FlightInfo()) == info
    unknown = flight_info_from_message(messages.flight_info(FlightInfo()))
    assert unknown == FlightInfo() and unknown.read_scene("it") is None


@pytest.mark.parametrize(
    "field, value",
    [
        ("scene", "[" * 100_000),
        ("jitter", math.inf),
        ("start", 1e300),
        ("robot_radius", 0.0),
        ("goals", "{}"),
        ("goals", "[[NaN, 1.0]]"),
        ("parameters", "[]"),
        ("parameters", '{"controller_frequency": true}'),
    ],
)
def test_facts_with_odd_fields_are_refused(field, value):
    message = messages.flight_info(FlightInfo(robots=(RobotInfo("quad0"),)))
    setattr(message if hasattr(message, field) else message.robots[0], field, value)
    with pytest.raises(ValueError):
        flight_info_from_message(message)


def test_texts_of_others_have_no_characters_that_a_terminal_obeys():
    message = messages.flight_info(FlightInfo("a\x1b[2Jb", robots=(RobotInfo("q\a"),)))
    info = flight_info_from_message(message)
    assert (info.title, info.robots[0].name) == ("a[2Jb", "q")


def test_a_right_of_way_comes_back_with_its_holding_point_and_who_limits_it():
    assert right_of_way(None, "") == RightOfWay()
    limited = right_of_way(None, "quad3")
    assert limited == RightOfWay(Kind.LIMITED, "quad3", None, "quad3", "limited by quad3")
    assert limited.decision is None
    told = right_of_way(MAKING_ROOM, "quad3")
    assert told.text == "making room for quad2 (higher priority) at (1.50, -2.25)"
    assert (told.kind, told.peer, told.limited_by) == (Kind.MAKES_ROOM, "quad2", "quad3")
    assert right_of_way_from_message(passed_on("quad/RightOfWay", told.fields)) == told
    assert told.decision.holding_point == Pose2D(1.5, -2.25)


@pytest.mark.parametrize(
    ("changed", "problem"),
    [
        ({"kind": 4}, "4 is not a valid Kind"),
        ({"has_hold": True, "hold_x": math.nan}, "finite"),
        ({"peer": "q" * 300}, "longer than"),
    ],
)
def test_fields_of_others_are_checked(changed, problem):
    message = SimpleNamespace(**{**RightOfWay().fields, **changed})
    with pytest.raises(ValueError, match=problem):
        right_of_way_from_message(message)
