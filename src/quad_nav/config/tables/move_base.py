"""Parameters at the level of the node ``move_base``."""

from __future__ import annotations

from quad_nav.config.spec import RESTORE_DEFAULTS, Domain, Table, double, flag, integer, text

DEFAULT_GLOBAL_PLANNER = "navfn/NavfnROS"
DEFAULT_LOCAL_PLANNER = "base_local_planner/TrajectoryPlannerROS"
_POSITIVE = Domain.POSITIVE


MOVE_BASE_TABLE = Table(
    reconfigurable=(
        text(
            "base_global_planner",
            DEFAULT_GLOBAL_PLANNER,
            "base_global_planner",
            "a plugin's name",
            "The name of the plugin for the global planner to use with move_base.",
        ),
        text(
            "base_local_planner",
            DEFAULT_LOCAL_PLANNER,
            "base_local_planner",
            "a plugin's name",
            "The name of the plugin for the local planner to use with move_base.",
        ),
        double(
            "planner_frequency",
            0.0,
            "planner_frequency_hz",
            "Hz",
            "The rate in Hz at which to run the planning loop.",
            low=0,
            high=100,
        ),
        double(
            "controller_frequency",
            20.0,
            "controller_frequency_hz",
            "Hz",
            "The rate in Hz at which to run the control loop and send velocity commands to"
            " the base.",
            _POSITIVE,
            0,
            100,
        ),
        double(
            "planner_patience",
            5.0,
            "planner_patience_s",
            "seconds",
            "How long the planner will wait in seconds in an attempt to find a valid plan"
            " before space-clearing operations are performed.",
            low=0,
            high=100,
        ),
        double(
            "controller_patience",
            5.0,
            "controller_patience_s",
            "seconds",
            "How long the controller will wait in seconds without receiving a valid control"
            " before space-clearing operations are performed.",
            low=0,
            high=100,
            initial=15.0,
        ),
        integer(
            "max_planning_retries",
            -1,
            "max_planning_retries",
            "",
            "How many times we will recall the planner in an attempt to find a valid plan before"
            " space-clearing operations are performed",
            low=-1,
            high=1000,
        ),
        double(
            "conservative_reset_dist",
            3.0,
            "conservative_reset_dist_m",
            "metres",
            "The distance away from the robot in meters at which obstacles will be cleared"
            " from the costmap when attempting to clear space in the map.",
            low=0,
            high=50,
        ),
        flag(
            "recovery_behavior_enabled",
            True,
            "recovery_behavior_enabled",
            "Whether or not to enable the move_base recovery behaviors to attempt to clear out"
            " space.",
        ),
        flag(
            "clearing_rotation_allowed",
            True,
            "clearing_rotation_allowed",
            "Determines whether or not the robot will attempt an in-place rotation when"
            " attempting to clear out space.",
        ),
        flag(
            "shutdown_costmaps",
            False,
            "shutdown_costmaps",
            "Determines whether or not to shutdown the costmaps of the node when move_base is"
            " in an inactive state",
        ),
        double(
            "oscillation_timeout",
            0.0,
            "oscillation_timeout_s",
            "seconds",
            "How long in seconds to allow for oscillation before executing recovery behaviors.",
            low=0,
            high=60,
        ),
        double(
            "oscillation_distance",
            0.5,
            "oscillation_distance_m",
            "metres",
            "How far in meters the robot must move to be considered not to be oscillating.",
            low=0,
            high=10,
        ),
        flag(
            "make_plan_clear_costmap",
            True,
            "make_plan_clear_costmap",
            "Whether or not to clear the global costmap on make_plan service call.",
        ),
        flag(
            "make_plan_add_unreachable_goal",
            True,
            "make_plan_add_unreachable_goal",
            "Whether or not to add the original goal to the path if it is unreachable in the"
            " make_plan service call.",
        ),
        RESTORE_DEFAULTS,
    ),
    fixed=(
        double(
            "clearing_radius",
            0.46,
            "",
            "metres",
            "Half the side of the square that make_plan clears around the robot;"
            " local_costmap/circumscribed_radius if unset.",
        ),
        double(
            "body_radius",
            0.30,
            "",
            "metres",
            "Radius of the simulated robot's body, the disc that collides; the fit of another"
            " robot's configuration sets it. Not in upstream move_base; see other_robots.md.",
            _POSITIVE,
        ),
        integer(
            "robot",
            0,
            "",
            "",
            "Number of this robot in its fleet; if unset, the number in its node's name, its"
            " frames or its topics. Not in upstream move_base; see peers.md.",
            low=0,
        ),
        integer(
            "robots",
            0,
            "",
            "",
            "Number of robots in the fleet; the peers are the other numbers below it. 0: the peers"
            " are the robots that publish. Not in upstream move_base; see peers.md.",
            low=0,
        ),
        flag(
            "size_from_scene",
            False,
            "",
            "The global costmap has the size of the scene instead of the configuration's. Set"
            " by the launch files, to be logged; not in upstream move_base.",
        ),
    ),
)
