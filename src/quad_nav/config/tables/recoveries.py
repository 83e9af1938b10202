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
            "Side of the square around the robot whose outside is cleared.",
        ),
        flag("invert_area_to_clear", False, "invert_area_to_clear", "Clear the inside instead."),
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


# The turn also takes these from TrajectoryPlannerROS, with defaults of its own.
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
            "Obstacles are cleared so far to each side of the robot.",
        ),
        double(
            "limited_trans_speed",
            0.25,
            "limited_trans_speed_mps",
            "m/s",
            "Greatest speed afterwards.",
            _POSITIVE,
        ),
        double(
            "limited_rot_speed",
            0.45,
            "limited_rot_speed_radps",
            "rad/s",
            "Fastest turn afterwards.",
            _POSITIVE,
        ),
        double(
            "limited_distance",
            0.3,
            "limited_distance_m",
            "metres",
            "The limits are lifted when the robot has moved so far.",
        ),
        text(
            "planner_namespace",
            "",
            "",
            "a planner's namespace",
            "The planner that is limited: it is the local planner that flies, whatever is set.",
        ),
        text(
            "max_trans_param_name",
            "",
            "",
            "a parameter's name",
            "One more parameter of the planner that limited_trans_speed limits.",
        ),
        text(
            "max_rot_param_name",
            "",
            "",
            "a parameter's name",
            "One more parameter of the planner that limited_rot_speed limits.",
        ),
    )
)
