"""Colours of the quadcopters in the simulator's window, RViz and reports."""

from __future__ import annotations

import colorsys
from typing import Tuple

ROBOT_COLOURS = (
    (32, 120, 220),
    (230, 110, 20),
    (40, 160, 60),
    (200, 50, 160),
    (0, 170, 170),
    (210, 40, 50),
    (150, 140, 0),
    (120, 80, 200),
    (110, 60, 20),
    (20, 45, 110),
    (240, 130, 170),
    (120, 200, 50),
    (0, 85, 80),
    (120, 10, 60),
    (120, 185, 250),
    (235, 180, 20),
)
"""RGB, 0 to 255, of quadcopters 0, 1, ...; the colours of further ones are computed."""

_GOLDEN = 0.618034  # golden ratio: steps of this part of a turn spread the hues evenly
_LIGHTNESSES = (0.25, 0.62, 0.42)


def robot_rgba(robot: int, alpha: float = 1.0) -> Tuple[float, float, float, float]:
    """Return a quadcopter's colour (red, green, blue, alpha), 0 to 1."""
    if robot < len(ROBOT_COLOURS):
        red, green, blue = (part / 255.0 for part in ROBOT_COLOURS[robot])
    else:
        extra = robot - len(ROBOT_COLOURS)
        red, green, blue = colorsys.hls_to_rgb(
            extra * _GOLDEN % 1.0, _LIGHTNESSES[extra % len(_LIGHTNESSES)], 0.65
        )
    return (red, green, blue, alpha)
