"""What a robot does for its peers, as `/move_base{i}/right_of_way` tells it.

The topic holds one latched `diagnostic_msgs/DiagnosticStatus`, published on each change. This
module has its values and decides when it changes; `docs/topics.md` lists them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Mapping, Optional, Tuple

from quad_nav.errors import excerpt
from quad_nav.navigator.tick import Tick
from quad_nav.peers.right_of_way import Yield
from quad_nav.topics.validation import MAX_FRAME_ID, MAX_MAGNITUDE

RIGHT_OF_WAY_STATUS = "right of way"
FREE, WAITS, MAKES_ROOM, LIMITED = "", "waits", "makes room", "limited"
_KIND_OF = {Yield.WAIT: WAITS, Yield.MAKE_ROOM: MAKES_ROOM}


@dataclass(frozen=True)
class RightOfWay:
    """What a robot does for its peers at present.

    Attributes:
        kind: `FREE`, `WAITS`, `MAKES_ROOM` or `LIMITED`, when only its command is limited.
        peer: Name of the robot that goes first or limits the command, "" if free.
        hold_m: Holding point (x, y) in ``map``, None without one.
        limited_by: Name of the robot whose Voronoi cell limits the command, "" if none does.
        text: One line for people.
    """

    kind: str = FREE
    peer: str = ""
    hold_m: Optional[Tuple[float, float]] = None
    limited_by: str = ""
    text: str = "free"

    @property
    def values(self) -> Dict[str, str]:
        """The diagnostic values."""
        x_m, y_m = map(repr, self.hold_m) if self.hold_m is not None else ("", "")
        return {
            "kind": self.kind,
            "peer": self.peer,
            "hold_x_m": x_m,
            "hold_y_m": y_m,
            "limited_by": self.limited_by,
        }


class RightOfWaySchedule:
    """Tells when a robot's right of way has changed."""

    def __init__(self) -> None:
        """Start with nothing published."""
        self._published: Optional[RightOfWay] = None
        self._limited_by = ""

    def pop(self, tick: Tick) -> Optional[RightOfWay]:
        """Return the right of way of a tick if it is another one than before, else None."""
        if tick.command is not None:
            self._limited_by = tick.limited_by
        present = _of(tick, self._limited_by)
        if present == self._published:
            return None
        self._published = present
        return present


def _of(tick: Tick, limited_by: str) -> RightOfWay:
    decision = tick.yielding
    if decision is None:
        if not limited_by:
            return RightOfWay()
        return RightOfWay(LIMITED, limited_by, None, limited_by, f"limited by {limited_by}")
    point = decision.holding_point
    hold_m = None if point is None else (float(point.x_m), float(point.y_m))
    kind = _KIND_OF[decision.action]
    return RightOfWay(kind, decision.peer, hold_m, limited_by, str(decision))


def right_of_way_from_values(text: str, values: Mapping[str, str]) -> RightOfWay:
    """Read a right of way from its diagnostic values.

    Args:
        text: The line for people.
        values: Values by their keys.

    Raises:
        ValueError: If a value is missing or not valid.
    """
    try:
        kind, peer, limited_by = values["kind"], values["peer"], values["limited_by"]
        x_text, y_text = values["hold_x_m"], values["hold_y_m"]
        hold_m = (float(x_text), float(y_text)) if x_text or y_text else None
    except (KeyError, ValueError) as error:
        raise ValueError(
            f"right of way has no valid {error}; expected the values kind, peer, hold_x_m,"
            " hold_y_m, limited_by"
        ) from error
    if kind not in (FREE, WAITS, MAKES_ROOM, LIMITED):
        raise ValueError(
            f"kind '{excerpt(kind)}', expected '{WAITS}', '{MAKES_ROOM}', '{LIMITED}' or ''"
        )
    if hold_m is not None and not all(abs(one) <= MAX_MAGNITUDE for one in hold_m):
        raise ValueError(f"holding point {hold_m}, expected finite coordinates")
    if max(len(peer), len(limited_by)) > MAX_FRAME_ID:
        raise ValueError(f"a name is longer than {MAX_FRAME_ID} characters")
    return RightOfWay(kind, peer, hold_m, limited_by, text)
