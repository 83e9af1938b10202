"""Windows, plans and footprints that the tests of both local planners share."""

from __future__ import annotations

import numpy as np

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import LETHAL, GridSpec

REST = Twist2D()
ORIGIN = Pose2D(0.0, 0.0)
SQUARE = np.array([[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]])
# 3 m x 3 m of 5 cm cells around (0, 0)
WINDOW = GridSpec(60, 60, 0.05, -1.5, -1.5)


def free() -> np.ndarray:
    return np.zeros(WINDOW.shape, dtype=np.uint8)


def boxed_in(inner_cells: int) -> np.ndarray:
    """A lethal ring, one cell wide, around 2 x inner_cells free cells in the middle."""
    costs, outer, inner = free(), inner_cells + 1, inner_cells
    costs[30 - outer : 30 + outer, 30 - outer : 30 + outer] = LETHAL
    costs[30 - inner : 30 + inner, 30 - inner : 30 + inner] = 0
    return costs


def line(x0, y0, x1, y1, yaw=0.0, count=41):
    return np.column_stack(
        (np.linspace(x0, x1, count), np.linspace(y0, y1, count), np.full(count, yaw))
    )
