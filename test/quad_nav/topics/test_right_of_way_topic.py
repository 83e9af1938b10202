"""The topic of the right of way: when it changes, and that its values can be read back."""

from __future__ import annotations

import pytest

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.tick import Tick
from quad_nav.peers.right_of_way import Yield, YieldDecision
from quad_nav.topics.right_of_way import (
    RightOfWay,
    RightOfWaySchedule,
    right_of_way_from_values,
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
    assert kinds == ["", None, "waits", None, "makes room", ""]


def test_a_limit_lasts_until_a_command_is_not_limited() -> None:
    schedule = RightOfWaySchedule()
    schedule.pop(Tick(1.0))
    limited = schedule.pop(Tick(1.1, command=Twist2D(), limited_by="quad3"))
    assert limited == RightOfWay("limited", "quad3", None, "quad3", "limited by quad3")
    assert schedule.pop(Tick(1.125)) is None  # a tick between two control cycles
    assert schedule.pop(Tick(1.2, command=Twist2D())) == RightOfWay()


def test_a_robot_that_makes_room_names_its_holding_point_and_who_limits_it() -> None:
    tick = Tick(1.0, command=Twist2D(), limited_by="quad3", yielding=MAKING_ROOM)
    changed = RightOfWaySchedule().pop(tick)
    assert changed is not None
    assert changed.values == {
        "kind": "makes room",
        "peer": "quad2",
        "hold_x_m": "1.5",
        "hold_y_m": "-2.25",
        "limited_by": "quad3",
    }
    assert right_of_way_from_values(changed.text, changed.values) == changed


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({}, "no valid 'kind'"),
        ({"kind": "dances"}, "kind 'dances', expected 'waits'"),
        ({"hold_x_m": "nan", "hold_y_m": "0"}, "finite"),
        ({"hold_x_m": "1"}, "could not convert"),
        ({"peer": "q" * 300}, "longer than"),
    ],
)
def test_values_of_others_are_checked(values: dict, problem: str) -> None:
    given = {**RightOfWay().values, **values} if values else {}
    with pytest.raises(ValueError, match=problem):
        right_of_way_from_values("", given)
