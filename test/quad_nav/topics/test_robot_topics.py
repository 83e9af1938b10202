"""Topics of a robot at each change: the rows, and when they are published."""

from __future__ import annotations

from pathlib import Path

import pytest

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.tick import State, Tick
from quad_nav.peers.right_of_way import Yield, YieldDecision
from quad_nav.recording import messages
from quad_nav.topics.right_of_way import Kind
from quad_nav.topics.robot_topics import ROBOT_TOPICS, RobotStatus, RobotTopicSchedule

PAGE = Path(__file__).parents[3] / "docs" / "topics.md"
WAITING = YieldDecision("quad1", Yield.WAIT)
MAKING_ROOM = YieldDecision("quad2", Yield.MAKE_ROOM, Pose2D(1.5, -2.25, 0.3))


def popped(schedule: RobotTopicSchedule, tick: Tick) -> dict:
    return {topic.name: dict(fields) for topic, fields in schedule.pop(tick)}


@pytest.mark.parametrize("topic", ROBOT_TOPICS, ids=lambda topic: topic.name)
def test_a_row_makes_messages_of_its_type_and_is_on_the_page(topic) -> None:
    fields = topic.fields(RobotStatus(State.PLANNING, MAKING_ROOM, "quad3"))
    message = messages.stamped(topic.kind, fields, 1)
    back = messages.decode(messages.encode(message), topic.kind)
    assert {name: getattr(back, name) for name in fields} == dict(fields)
    assert f"| `{topic.name}` | {topic.kind}, latched" in PAGE.read_text()


def test_names_are_unique() -> None:
    assert len({topic.name for topic in ROBOT_TOPICS}) == len(ROBOT_TOPICS)


def test_all_are_published_at_first_and_each_on_its_change() -> None:
    schedule = RobotTopicSchedule()
    first = popped(schedule, Tick(1.0))
    assert set(first) == {topic.name for topic in ROBOT_TOPICS}
    assert first["state"] == {"data": "idle"}
    assert popped(schedule, Tick(1.1, command=Twist2D())) == {}
    assert popped(schedule, Tick(1.2, State.PLANNING)) == {"state": {"data": "planning"}}
    waiting = popped(schedule, Tick(1.3, State.PLANNING, yielding=WAITING))
    assert set(waiting) == {"right_of_way"} and waiting["right_of_way"]["kind"] == Kind.WAITS
    assert popped(schedule, Tick(1.4, State.PLANNING, yielding=WAITING)) == {}
    free = popped(schedule, Tick(1.5, State.PLANNING))
    assert free["right_of_way"]["kind"] == Kind.FREE


def test_a_limit_lasts_until_a_command_is_not_limited() -> None:
    schedule = RobotTopicSchedule()
    schedule.pop(Tick(1.0))
    limited = popped(schedule, Tick(1.1, command=Twist2D(), limited_by="quad3"))
    assert limited["right_of_way"]["limited_by"] == "quad3"
    assert popped(schedule, Tick(1.125)) == {}  # a tick between two control cycles
    free = popped(schedule, Tick(1.2, command=Twist2D()))
    assert free["right_of_way"]["limited_by"] == ""
