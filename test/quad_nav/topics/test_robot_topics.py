"""Topics of a robot: the rows, and when they are published."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Optional

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


ON_CHANGE = {topic.name for topic in ROBOT_TOPICS if topic.is_latched}


def popped(schedule: RobotTopicSchedule, tick: Tick, pose: Optional[Pose2D] = None) -> dict:
    """Return the fields of what is published at a change."""
    due = {topic.name: dict(fields) for topic, fields in schedule.pop(tick, pose)}
    return {name: fields for name, fields in due.items() if name in ON_CHANGE}


@pytest.mark.parametrize("topic", ROBOT_TOPICS, ids=lambda topic: topic.name)
def test_a_row_makes_messages_of_its_type_and_is_on_the_page(topic) -> None:
    status = RobotStatus(State.PLANNING, MAKING_ROOM, "quad3", Pose2D(1.0, 2.0), Pose2D(4.0, 6.0))
    fields = topic.fields(status)
    message = messages.stamped(topic.kind, fields, 1)
    back = messages.decode(messages.encode(message), topic.kind)
    assert {name: getattr(back, name) for name in fields} == dict(fields)
    rate = "latched" if topic.is_latched else f"{1.0 / topic.period_s:g} Hz"
    assert f"| `{topic.name}` | {topic.kind}, {rate} |" in PAGE.read_text()
    said = topic.read(back)
    assert said == {"state": State.PLANNING, "goal_distance": 5.0}.get(topic.name, said)
    assert getattr(said, "fields", fields) == fields


def test_names_are_unique() -> None:
    assert len({topic.name for topic in ROBOT_TOPICS}) == len(ROBOT_TOPICS)


def test_all_are_published_at_first_and_each_on_its_change() -> None:
    schedule = RobotTopicSchedule()
    first = popped(schedule, Tick(1.0))
    assert set(first) == ON_CHANGE
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
    popped(schedule, Tick(1.0))
    limited = popped(schedule, Tick(1.1, command=Twist2D(), limited_by="quad3"))
    assert limited["right_of_way"]["limited_by"] == "quad3"
    assert popped(schedule, Tick(1.125)) == {}  # a tick between two control cycles
    free = popped(schedule, Tick(1.2, command=Twist2D()))
    assert free["right_of_way"]["limited_by"] == ""


def test_a_number_is_published_at_its_rate_and_nan_without_a_goal() -> None:
    schedule, pose = RobotTopicSchedule(), Pose2D(0.0, 0.0)
    said = {}
    for k in range(9):
        now_s = 10.0 + 0.25 * k
        goal = Pose2D(0.5 * k, 0.0) if k else None
        for topic, fields in schedule.pop(Tick(now_s, goal=goal), pose):
            said.setdefault(topic.name, {})[k] = fields.get("data")
    assert math.isnan(said["goal_distance"].pop(0))
    assert said["goal_distance"] == {2: 1.0, 4: 2.0, 6: 3.0, 8: 4.0}
    again = [topic.name for topic, _ in schedule.pop(Tick(1.0), pose)]  # the clock was reset
    assert "goal_distance" in again
