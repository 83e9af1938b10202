"""The topic of the right of way: when it changes, and that its values can be read back."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.tick import Tick
from quad_nav.peers.right_of_way import Yield, YieldDecision
from quad_nav.topics.right_of_way import (
    Kind,
    RightOfWay,
    RightOfWaySchedule,
    right_of_way_from_message,
)

WAITING = YieldDecision("quad1", Yield.WAIT)
MAKING_ROOM = YieldDecision("quad2", Yield.MAKE_ROOM, Pose2D(1.5, -2.25, 0.3))


def test_it_is_published_at_first_and_on_each_change() -> None:
    schedule = RightOfWaySchedule()
    ticks = [
        Tick(1.0),
        Tick(1.1, command=Twist2D()),
        Tick(1.2, yielding=WAITING),
        Tick(1.3, yielding=WAITING),
        Tick(1.4, yielding=MAKING_ROOM),
        Tick(1.5),
    ]
    kinds = [changed.kind if changed else None for changed in map(schedule.pop, ticks)]
    assert kinds == [Kind.FREE, None, Kind.WAITS, None, Kind.MAKES_ROOM, Kind.FREE]


def test_a_limit_lasts_until_a_command_is_not_limited() -> None:
    schedule = RightOfWaySchedule()
    schedule.pop(Tick(1.0))
    limited = schedule.pop(Tick(1.1, command=Twist2D(), limited_by="quad3"))
    assert limited == RightOfWay(Kind.LIMITED, "quad3", None, "quad3", "limited by quad3")
    assert schedule.pop(Tick(1.125)) is None  # a tick between two control cycles
    assert schedule.pop(Tick(1.2, command=Twist2D())) == RightOfWay()


def test_a_robot_that_makes_room_names_its_holding_point_and_who_limits_it() -> None:
    tick = Tick(1.0, command=Twist2D(), limited_by="quad3", yielding=MAKING_ROOM)
    changed = RightOfWaySchedule().pop(tick)
    assert changed is not None
    fields = {
        "kind": Kind.MAKES_ROOM,
        "peer": "quad2",
        "has_hold": True,
        "hold_x": 1.5,
        "hold_y": -2.25,
        "limited_by": "quad3",
        "text": "making room for quad2 (higher priority) at (1.50, -2.25)",
    }
    assert changed.fields == fields
    assert right_of_way_from_message(SimpleNamespace(**fields)) == changed
    assert changed.decision is not None
    assert changed.decision.holding_point == Pose2D(1.5, -2.25)


@pytest.mark.parametrize(
    ("changed", "problem"),
    [
        ({"kind": 4}, "4 is not a valid Kind"),
        ({"has_hold": True, "hold_x": math.nan}, "finite"),
        ({"peer": "q" * 300}, "longer than"),
    ],
)
def test_fields_of_others_are_checked(changed: dict, problem: str) -> None:
    message = SimpleNamespace(**{**RightOfWay().fields, **changed})
    with pytest.raises(ValueError, match=problem):
        right_of_way_from_message(message)
