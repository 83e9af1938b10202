"""The topic of the right of way: its fields, and that they can be read back."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from quad_nav.geometry import Pose2D
from quad_nav.peers.right_of_way import Yield, YieldDecision
from quad_nav.topics.right_of_way import (
    Kind,
    RightOfWay,
    right_of_way,
    right_of_way_from_message,
)

WAITING = YieldDecision("quad1", Yield.WAIT)
MAKING_ROOM = YieldDecision("quad2", Yield.MAKE_ROOM, Pose2D(1.5, -2.25, 0.3))


def test_a_robot_is_free_or_its_command_is_limited() -> None:
    assert right_of_way(None, "") == RightOfWay()
    limited = RightOfWay(Kind.LIMITED, "quad3", None, "quad3", "limited by quad3")
    assert right_of_way(None, "quad3") == limited
    assert limited.decision is None


def test_a_robot_that_makes_room_names_its_holding_point_and_who_limits_it() -> None:
    changed = right_of_way(MAKING_ROOM, "quad3")
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
