"""Parameters of move_base itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from quad_nav.navigator.control_supervisor import ProgressParams


@dataclass(frozen=True)
class NavigatorParams:
    """Parameters of the state machine.

    Those without an entry below are move_base's own, see ``docs/parameters.md``.

    Attributes:
        recovery_behaviors: (name, type) of each recovery behaviour, None for the default ones.
        sensor_timeout_s: The robot stops when a sensor of the local costmap has sent nothing
            for so long; 0 restores upstream behaviour, which leaves the limit to the sensor's
            own period and keeps recovering without sensor data.
        escape_collision: A round robot without a legal trajectory moves to where costs are
            lower; False restores upstream behaviour.
        command_in_first_cycle: The cycle that takes a goal also plans and commands; False
            restores upstream behaviour, which commands one control period later.
        stop_while_planning: A robot without a plan stops; False restores upstream behaviour,
            which leaves the last command in force.
        plan_inside_map: Plans keep the robot off the edge of a global costmap that does not roll;
            False restores upstream behaviour, whose plans may lead along the edge.
        progress: Detection of a robot that makes no progress.
    """

    base_global_planner: str = "navfn/NavfnROS"
    base_local_planner: str = "base_local_planner/TrajectoryPlannerROS"
    recovery_behaviors: Optional[Tuple[Tuple[str, str], ...]] = None
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
    command_in_first_cycle: bool = True
    stop_while_planning: bool = True
    plan_inside_map: bool = True
    progress: ProgressParams = ProgressParams()
