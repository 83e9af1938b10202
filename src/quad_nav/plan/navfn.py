"""NavFn: a wavefront planner over the global costmap."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class NavfnParams:
    """Parameters of ``navfn/NavfnROS``."""

    allow_unknown: bool = True
    default_tolerance_m: float = 0.0
    visualize_potential: bool = False
    planner_window_x_m: float = 0.0  # read by the original as well, and never used
    planner_window_y_m: float = 0.0
