"""Contacts: from bodies that touch at each step to events that can be counted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

SEPARATION_S = 0.5


@dataclass(frozen=True)
class Touch:
    """A quadcopter touches something at this very step.

    ``other`` names an obstacle, a wall, the floor or "quadcopter 1"; then
    ``other_robot`` is its number, which is above ``robot``.
    """

    robot: int
    other: str
    other_robot: Optional[int]
    position_m: Tuple[float, float, float]


@dataclass(frozen=True)
class Contact:
    """The begin of a contact. Two quadcopters that touch make one contact."""

    time_s: float
    robot: int
    other: str
    other_robot: Optional[int]
    position_m: Tuple[float, float, float]

    def __str__(self) -> str:
        return f"quadcopter {self.robot} touches {self.other}"

    def involves(self, robot: int) -> bool:
        return robot in (self.robot, self.other_robot)


class ContactLog:
    """Contacts so far.

    A body that rubs along another touches it on and off: a new contact of the
    same two begins only after they were apart for ``SEPARATION_S``.
    """

    def __init__(self) -> None:
        self.contacts: List[Contact] = []
        self._last_touch_s: Dict[Tuple[int, str], float] = {}

    def update(self, now_s: float, touches: Sequence[Touch]) -> List[Contact]:
        """Note what touches now; returns the contacts that begin."""
        begun = []
        for touch in touches:
            pair = (touch.robot, touch.other)
            last_s = self._last_touch_s.get(pair)
            if last_s is None or now_s - last_s > SEPARATION_S:
                begun.append(
                    Contact(now_s, touch.robot, touch.other, touch.other_robot, touch.position_m)
                )
            self._last_touch_s[pair] = now_s
        self.contacts.extend(begun)
        return begun
