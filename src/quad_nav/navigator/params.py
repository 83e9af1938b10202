"""Parameters of move_base itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from quad_nav.navigator.control_supervisor import ProgressParams
from quad_nav.parameter import deviation, flag, number, positive, text, whole

DEFAULT_GLOBAL_PLANNER = "navfn/NavfnROS"
DEFAULT_LOCAL_PLANNER = "base_local_planner/TrajectoryPlannerROS"
_PLUGIN = "a plugin's name"


@dataclass(frozen=True)
class NavigatorParams:
    """Parameters of the state machine.

    Attributes:
        controller_patience_s: 15 until the first reconfiguration, as upstream.
        sensor_timeout_s: Holds for sensors of the local costmap and for odometry; 0 leaves the
            limit to the sensor's own period and keeps recovering without sensor data, as upstream.
        recovery_behaviors: (name, type) of each recovery behaviour, None for the default ones.
        command_in_first_cycle: The cycle that takes a goal also plans and commands; False
            restores upstream behaviour, which commands one control period later.
        stop_while_planning: A robot without a plan stops; False restores upstream behaviour,
            which leaves the last command in force.
        interrupt_recoveries: A goal or cancel ends a recovery, and a robot that oscillates stops
            before one; False restores upstream behaviour, which waits for the recovery's end, and
            sends one more command before it.
        check_goals: A goal whose pose is not valid is aborted and the robot stops; False restores
            upstream behaviour, which tries it in every cycle or leaves the last command in force.
            So for ``make_plan``: its requests are checked too, and a refusal has a reason.
        progress: Detection of a robot that makes no progress.
    """

    base_global_planner: str = text(
        "base_global_planner", DEFAULT_GLOBAL_PLANNER, _PLUGIN, "Plugin of the global planner."
    )
    base_local_planner: str = text(
        "base_local_planner", DEFAULT_LOCAL_PLANNER, _PLUGIN, "Plugin of the local planner."
    )
    planner_frequency_hz: float = number(
        "planner_frequency", 0.0, "Hz", 0, 100, "Rate of plans; 0 for one plan per goal."
    )
    controller_frequency_hz: float = positive(
        "controller_frequency", 20.0, "Hz", 0, 100, "Rate of velocity commands."
    )
    planner_patience_s: float = number(
        "planner_patience", 5.0, "seconds", 0, 100, "Time without a plan until recoveries."
    )
    controller_patience_s: float = number(
        "controller_patience", 5.0, "seconds", 0, 100, "Time without a command.", initial=15.0
    )
    max_planning_retries: int = whole(
        "max_planning_retries", -1, "", -1, 1000, "Failed plans until recoveries; -1: any number."
    )
    conservative_reset_dist_m: float = number(
        "conservative_reset_dist", 3.0, "metres", 0, 50, "Distance beyond which costs are cleared."
    )
    recovery_behavior_enabled: bool = flag("recovery_behavior_enabled", True, "Run recoveries.")
    clearing_rotation_allowed: bool = flag(
        "clearing_rotation_allowed", True, "Recoveries may turn the robot in place."
    )
    shutdown_costmaps: bool = flag(
        "shutdown_costmaps", False, "Stop the costmaps while there is no goal."
    )
    oscillation_timeout_s: float = number(
        "oscillation_timeout", 0.0, "seconds", 0, 60, "Oscillation until recoveries run; 0: never."
    )
    oscillation_distance_m: float = number(
        "oscillation_distance", 0.5, "metres", 0, 10, "A robot that moves so far makes progress."
    )
    make_plan_clear_costmap: bool = flag(
        "make_plan_clear_costmap", True, "Clear the global costmap around the robot in make_plan."
    )
    make_plan_add_unreachable_goal: bool = flag(
        "make_plan_add_unreachable_goal", True, "Add an unreachable goal to the path of make_plan."
    )

    # Our own
    sensor_timeout_s: float = number(
        "sensor_timeout", 1.0, "seconds", 0, 100, "Stop after this time without data.", upstream=0.0
    )
    escape_collision: bool = flag(
        "escape_collision", True, "A round robot in contact moves out of it.", upstream=False
    )
    plan_inside_map: bool = flag(
        "plan_inside_map", True, "Plans keep a radius from the edge of the map.", upstream=False
    )
    progress: ProgressParams = ProgressParams()

    recovery_behaviors: Optional[Tuple[Tuple[str, str], ...]] = None

    # Deviations from upstream
    command_in_first_cycle: bool = deviation()
    stop_while_planning: bool = deviation()
    interrupt_recoveries: bool = deviation()
    check_goals: bool = deviation()
