"""Parameters of move_base itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from quad_nav.navigator.progress_checker import ProgressParams


@dataclass(frozen=True)
class NavigatorParams:
    """move_base's own parameters.

    The last three are ours. ``sensor_timeout_s``: the robot stops when a sensor has sent
    nothing for so long; 0 leaves it to the sensor's own period. ``escape_collision``: a round
    robot without a legal trajectory moves to where costs are lower.
    """

    base_global_planner: str = "navfn/NavfnROS"
    base_local_planner: str = "base_local_planner/TrajectoryPlannerROS"
    recovery_behaviors: Optional[Tuple[Tuple[str, str], ...]] = None  # (name, type); None: default
    controller_frequency_hz: float = 20.0
    planner_frequency_hz: float = 0.0
    planner_patience_s: float = 5.0
    controller_patience_s: float = 15.0
    max_planning_retries: int = -1
    oscillation_timeout_s: float = 0.0
    oscillation_distance_m: float = 0.5
    conservative_reset_dist_m: float = 3.0
    recovery_behavior_enabled: bool = True
    clearing_rotation_allowed: bool = True
    shutdown_costmaps: bool = False
    make_plan_clear_costmap: bool = True
    make_plan_add_unreachable_goal: bool = True
    sensor_timeout_s: float = 1.0
    escape_collision: bool = True
    progress: ProgressParams = ProgressParams()
