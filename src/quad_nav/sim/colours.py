"""One colour per quadcopter: the window, the markers, the goals and the report show the same."""

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
"""RGB in 0..255 of quadcopter 0, 1, ...; the colours of further ones are computed."""

_GOLDEN = 0.618034  # steps of this part of a turn never come near an earlier hue soon
_LIGHTNESSES = (0.25, 0.62, 0.42)


def robot_rgba(robot: int, alpha: float = 1.0) -> Tuple[float, float, float, float]:
    """A quadcopter's colour, each part in 0..1."""
    if robot < len(ROBOT_COLOURS):
        red, green, blue = (part / 255.0 for part in ROBOT_COLOURS[robot])
    else:
        further = robot - len(ROBOT_COLOURS)
        red, green, blue = colorsys.hls_to_rgb(
            further * _GOLDEN % 1.0, _LIGHTNESSES[further % len(_LIGHTNESSES)], 0.65
        )
    return (red, green, blue, alpha)
