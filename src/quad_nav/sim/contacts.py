"""Contacts: the definition that the simulator, the offline runner and the sequencer share.

A touch is one physics step in which a robot presses on something. A contact is a series of
touches of the same pair. It begins with a touch when the pair has not touched for
``CONTACT_GAP_S``, lasts while touches come at most ``CONTACT_GAP_S`` apart, and ends
``CONTACT_GAP_S`` after the last one. So a robot that scrapes along a wall makes one contact,
and touches 0.7 s apart are one contact each.

``ContactLog`` turns touches into contacts. Offline they go straight into the flight log; the ROS
simulator publishes each contact once, when it begins, and the sequencer counts the messages.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List, Sequence, Tuple

CONTACT_GAP_S = 0.5
"""Time without a touch after which a contact has ended."""


@dataclass(frozen=True)
class Touch:
    """Touch of a robot in the present physics step.

    ``robot`` is the robot's number. ``other`` names the obstacle, the wall, the floor or the other
    robot, which then has a higher number. ``position_m`` is (x, y, z) in ``map``.
    """

    robot: int
    other: str
    position_m: Tuple[float, float, float]


@dataclass(frozen=True)
class Contact:
    """Begin of a contact between a robot and another robot, an obstacle, a wall or the floor.

    ``time_s`` and the position in ``map`` are those of the first touch.
    """

    time_s: float
    robot: str
    other: str
    x_m: float
    y_m: float

    def __str__(self) -> str:
        return f"{self.robot} touches {self.other}"

    def involves(self, robot: str) -> bool:
        """Return whether the robot of this name is one of the two."""
        return robot in (self.robot, self.other)


class ContactLog:
    """Turn the touches of successive physics steps into contacts."""

    def __init__(self) -> None:
        self.contacts: List[Contact] = []
        self._last_touch_s: Dict[Tuple[int, str], float] = {}

    def update(self, now_s: float, touches: Sequence[Touch]) -> List[Contact]:
        """Add the touches of a step; return the contacts that begin with them."""
        begun = []
        for touch in touches:
            pair = (touch.robot, touch.other)
            last_s = self._last_touch_s.get(pair)
            if last_s is None or now_s - last_s > CONTACT_GAP_S:
                x_m, y_m, _ = touch.position_m
                begun.append(Contact(now_s, f"quad{touch.robot}", touch.other, x_m, y_m))
            self._last_touch_s[pair] = now_s
        self.contacts.extend(begun)
        return begun
