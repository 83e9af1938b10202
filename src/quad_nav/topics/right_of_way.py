"""What a robot does for its peers, as `/move_base{i}/right_of_way` tells it.

The topic holds one latched ``quad/RightOfWay``; this module has its fields.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any, Dict, Optional, Tuple

from quad_nav.geometry import Pose2D
from quad_nav.peers.right_of_way import Yield, YieldDecision
from quad_nav.topics.validation import MAX_FRAME_ID, MAX_MAGNITUDE, shown_text


class Kind(enum.IntEnum):
    """What a robot does, numbered as in ``quad/RightOfWay``."""

    FREE, WAITS, MAKES_ROOM, LIMITED = range(4)


_KIND_OF = {Yield.WAIT: Kind.WAITS, Yield.MAKE_ROOM: Kind.MAKES_ROOM}
_YIELD_OF = {kind: action for action, kind in _KIND_OF.items()}


@dataclass(frozen=True)
class RightOfWay:
    """What a robot does for its peers at present.

    Attributes:
        kind: What it does; `LIMITED` if only its command is limited.
        peer: Name of the robot that goes first or limits the command, "" if free.
        hold_m: Holding point (x, y) in ``map``, None without one.
        limited_by: Name of the robot whose Voronoi cell limits the command, "" if none does.
        text: One line for people.
    """

    kind: Kind = Kind.FREE
    peer: str = ""
    hold_m: Optional[Tuple[float, float]] = None
    limited_by: str = ""
    text: str = "free"

    @property
    def fields(self) -> Dict[str, Any]:
        """The fields of a ``quad/RightOfWay``, apart from its header."""
        x_m, y_m = (0.0, 0.0) if self.hold_m is None else self.hold_m
        return {
            "kind": int(self.kind),
            "peer": self.peer,
            "has_hold": self.hold_m is not None,
            "hold_x": x_m,
            "hold_y": y_m,
            "limited_by": self.limited_by,
            "text": self.text,
        }

    @property
    def decision(self) -> Optional[YieldDecision]:
        """The decision to yield; None if the robot does not yield."""
        action = _YIELD_OF.get(self.kind)
        if action is None:
            return None
        return YieldDecision(self.peer, action, self.hold_m and Pose2D(*self.hold_m))


def right_of_way(yielding: Optional[YieldDecision], limited_by: str) -> RightOfWay:
    """Return the right of way of a robot by its decision and the peer that limits its command."""
    if yielding is None:
        if not limited_by:
            return RightOfWay()
        return RightOfWay(Kind.LIMITED, limited_by, None, limited_by, f"limited by {limited_by}")
    point = yielding.holding_point
    hold_m = None if point is None else (float(point.x_m), float(point.y_m))
    kind = _KIND_OF[yielding.action]
    return RightOfWay(kind, yielding.peer, hold_m, limited_by, str(yielding))


def right_of_way_from_message(message: Any) -> RightOfWay:
    """Read a ``quad/RightOfWay``, of rospy or of a recording.

    Raises:
        ValueError: A field is not valid.
    """
    hold_m = (float(message.hold_x), float(message.hold_y)) if message.has_hold else None
    if hold_m is not None and not all(abs(value) <= MAX_MAGNITUDE for value in hold_m):
        raise ValueError(f"holding point {hold_m}, expected finite coordinates")
    if max(len(message.peer), len(message.limited_by)) > MAX_FRAME_ID:
        raise ValueError(f"a name is longer than {MAX_FRAME_ID} characters")
    return RightOfWay(
        Kind(message.kind), message.peer, hold_m, message.limited_by, shown_text(message.text)
    )
