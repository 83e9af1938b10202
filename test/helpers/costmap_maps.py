"""Maps in ASCII for the costmap's tests: top row first, as one reads them."""

from __future__ import annotations

import numpy as np

from quad_nav.grid import FREE, INSCRIBED, LETHAL, UNKNOWN

_COSTS = {".": FREE, "i": INSCRIBED, "#": LETHAL, "?": UNKNOWN}
_SIGNS = {cost: sign for sign, cost in _COSTS.items()}


def costs_of(text: str) -> np.ndarray:
    """uint8[H, W], lowest row first."""
    rows = text.split()[::-1]
    return np.array([[_COSTS[sign] for sign in row] for row in rows], dtype=np.uint8)


def picture(costs: np.ndarray) -> str:
    """A grid as ASCII; costs between free and inscribed are '+'."""
    return "\n".join("".join(_SIGNS.get(cost, "+") for cost in row) for row in costs[::-1].tolist())


def drawn(text: str) -> str:
    """An indented map as ``picture`` writes it."""
    return "\n".join(text.split())
