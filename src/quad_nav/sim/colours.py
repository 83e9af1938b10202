"""One colour per quadcopter: the window, the markers and the goals show the same."""
from __future__ import annotations

from typing import Tuple

ROBOT_COLOURS = ((32, 120, 220), (230, 110, 20), (40, 160, 60), (200, 50, 160),
                 (0, 170, 170), (210, 40, 50), (150, 140, 0), (120, 80, 200))
"""RGB in 0..255 of quadcopter 0, 1, ...; then round again."""


def robot_rgba(robot: int, alpha: float = 1.0) -> Tuple[float, float, float, float]:
    """A quadcopter's colour, each part in 0..1."""
    red, green, blue = ROBOT_COLOURS[robot % len(ROBOT_COLOURS)]
    return (red / 255.0, green / 255.0, blue / 255.0, alpha)
