"""Marks that several figures have: contacts and close encounters at places or times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Sequence, Tuple

from quad_nav.report.encounters import LETTERS, Encounter, separation_text
from quad_nav.sim.contacts import Contact

Hover = Tuple[str, ...]
"""Lines of a text that is shown while a part of a plot is hovered; the first one is bold."""


@dataclass(frozen=True)
class Marks:
    """Marks of one kind.

    Attributes:
        kind: ``start``, ``goal``, ``contact``, ``encounter`` or ``recovery``.
        x: Where they are, in metres on a map and in seconds in a chart.
        y: See ``x``; in metres, or the number of a row.
        hovers: Texts of the marks.
        texts: Short texts in the marks, or beside them.
        number: Number of their colour; None for the colour of the kind.
        filled: Whether each is filled with its colour; all are if it is empty.
        label: Name in the legend; empty if it is not listed there.
        group: Name of the parts that are shown and hidden together.
    """

    kind: str
    x: Sequence[float]
    y: Sequence[float]
    hovers: Sequence[Hover]
    texts: Sequence[str] = ()
    number: Optional[int] = None
    filled: Sequence[bool] = ()
    label: str = ""
    group: str = ""


def contact_hover(contact: Contact) -> Hover:
    """Return who touches whom, and when."""
    return f"{contact.robot} touches {contact.other}", f"{contact.time_s:.1f} s"


def encounter_marks(
    marked: Sequence[Encounter], x: Sequence[float], y: Sequence[float]
) -> Tuple[Marks, ...]:
    """Return letters, in the order of the encounters; NaN is the place of one that has none."""
    if not marked:
        return ()
    hovers = [
        (
            f"{letter}: {' and '.join(encounter.names)}",
            f"{separation_text(encounter.separation_m)} at {encounter.time_s:.1f} s",
        )
        for letter, encounter in zip(LETTERS, marked)
    ]
    label = "close encounter" if any(one.is_close for one in marked) else "closest moment"
    return (Marks("encounter", x, y, hovers, LETTERS[: len(marked)], label=label),)
