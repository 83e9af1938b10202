"""Parameters of the recovery behaviours."""

from __future__ import annotations

from quad_nav.config.spec import Domain, Table, double, flag, text

_POSITIVE = Domain.POSITIVE


CLEAR_COSTMAP_TABLE = Table(
    fixed=(
        double(
            "reset_distance",
            3.0,
            "reset_distance_m",
            "metres",
            "Side of the square around the robot outside of which costs are cleared.",
        ),
        flag(
            "invert_area_to_clear",
            False,
            "invert_area_to_clear",
            "Clear the inside of the square instead.",
        ),
        flag("force_updating", False, "force_updating", "Update the costmaps after clearing."),
        text(
            "affected_maps",
            "both",
            "affected_maps",
            "local, global or both",
            "Which costmaps are cleared.",
        ),
    )
)


ROTATE_TABLE = Table(
    fixed=(
        double("frequency", 20.0, "frequency_hz", "Hz", "Rate of commands.", _POSITIVE),
        double(
            "sim_granularity",
            0.017,
            "sim_granularity_rad",
            "radians",
            "Step of the collision check along the turn.",
            _POSITIVE,
        ),
    )
)


# RotateRecovery reads these from TrajectoryPlannerROS, with its own defaults.
ROTATE_FROM_PLANNER = (
    double("yaw_goal_tolerance", 0.10, "yaw_goal_tolerance_rad", "radians", ""),
    double("acc_lim_theta", 3.2, "acc_lim_theta_radps2", "rad/s^2", ""),
    double("max_vel_theta", 1.0, "max_vel_theta_radps", "rad/s", ""),
    double("min_in_place_vel_theta", 0.4, "min_in_place_vel_theta_radps", "rad/s", ""),
)


MOVE_SLOW_TABLE = Table(
    fixed=(
        double(
            "clearing_distance",
            0.5,
            "clearing_distance_m",
            "metres",
            "Distance around the robot within which obstacles are cleared.",
        ),
        double(
            "limited_trans_speed",
            0.25,
            "limited_trans_speed_mps",
            "m/s",
            "Maximum translational speed after clearing.",
            _POSITIVE,
        ),
        double(
            "limited_rot_speed",
            0.45,
            "limited_rot_speed_radps",
            "rad/s",
            "Maximum rotational speed after clearing.",
            _POSITIVE,
        ),
        double(
            "limited_distance",
            0.3,
            "limited_distance_m",
            "metres",
            "The limits end when the robot has moved this far.",
        ),
        text(
            "planner_namespace",
            "",
            "",
            "a planner's namespace",
            "Counts without fixes/limit_all_speeds only: the planner whose speeds are set.",
        ),
        text(
            "max_trans_param_name",
            "",
            "",
            "a parameter's name",
            "Another parameter of the planner that limited_trans_speed limits.",
        ),
        text(
            "max_rot_param_name",
            "",
            "",
            "a parameter's name",
            "Another parameter of the planner that limited_rot_speed limits.",
        ),
    )
)
