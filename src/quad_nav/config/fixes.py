"""The parameter group ``fixes``: upstream bugs fixed by default, and how to restore each.

In YAML and dynamic_reconfigure the switches are one group. In the code each switch belongs to
the dataclass of the part that it changes; ``_SWITCHES`` maps the group to these owners. The
defaults of the table and of the dataclasses are the same; a test compares them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Mapping, Tuple, TypeVar, cast

from quad_nav.config.reader import fields
from quad_nav.config.spec import RESTORE_DEFAULTS, Parameter, Table, double, flag
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.scan_validator import ScanValidatorParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.costmap.voxel import VoxelLayerParams
from quad_nav.navigator.control_supervisor import ProgressParams
from quad_nav.navigator.params import NavigatorParams
from quad_nav.peers.coordinator import PeerParams
from quad_nav.recovery import ClearCostmapParams, MoveSlowAndClearParams, RotateParams

FIXES = "fixes"  # the name of the group below the node's own namespace

_Params = TypeVar("_Params")
Switch = Tuple[Parameter, Tuple[type, ...]]
"""A parameter of the group and the dataclasses that own it."""

# The switches in the order of dynamic_reconfigure, each with the dataclasses that own it.
_SWITCHES: Tuple[Switch, ...] = (
    (
        double(
            "progress_timeout",
            10.0,
            "timeout_s",
            "seconds",
            "A robot that has not moved by progress_distance for so long replans, and after the"
            " same time again runs the recoveries; 0 disables the check.",
            low=0,
            high=100,
        ),
        (ProgressParams,),
    ),
    (
        double(
            "progress_distance",
            0.1,
            "distance_m",
            "metres",
            "A robot that has moved so far makes progress.",
            low=0,
            high=10,
        ),
        (ProgressParams,),
    ),
    (
        double(
            "stuck_cost_factor",
            0.1,
            "stuck_cost_factor",
            "",
            "Without progress, occdist_scale is multiplied by this until the robot has moved"
            " oscillation_distance.",
            low=0,
            high=1,
        ),
        (ProgressParams,),
    ),
    (
        double(
            "sensor_timeout",
            1.0,
            "sensor_timeout_s",
            "seconds",
            "The robot stops when a sensor has sent nothing for so long; 0 leaves the limit to"
            " expected_update_rate.",
            low=0,
            high=100,
        ),
        (NavigatorParams,),
    ),
    (
        flag(
            "reject_implausible_scans",
            True,
            "reject_implausible_scans",
            "Reject scans that cannot be true, as of a LIDAR that is frozen, late or half blind.",
        ),
        (ScanValidatorParams,),
    ),
    (
        flag(
            "clear_any_obstacle_layer",
            True,
            "clear_any_obstacle_layer",
            "Clearing recoveries without layer_names clear every obstacle layer, not only one"
            " called obstacles.",
        ),
        (ClearCostmapParams, MoveSlowAndClearParams),
    ),
    (
        flag(
            "redraw_cleared_costmaps",
            True,
            "redraw_cleared_costmaps",
            "The robot waits until the costmaps that a recovery cleared are drawn again.",
        ),
        (ClearCostmapParams, MoveSlowAndClearParams),
    ),
    (
        flag(
            "limit_all_speeds",
            True,
            "limit_all_speeds",
            "move_slow_and_clear limits all speeds of the local planner and raises none, instead"
            " of setting two named parameters.",
        ),
        (MoveSlowAndClearParams,),
    ),
    (
        flag(
            "reject_colliding_escape",
            True,
            "reject_colliding_escape",
            "Escape backwards only out of a collision, not into one.",
        ),
        (TrajectoryPlannerParams,),
    ),
    (
        flag(
            "end_blocked_escape",
            True,
            "end_blocked_escape",
            "End an escape backwards where neither turns nor the way back are valid, and try"
            " forward trajectories again.",
        ),
        (TrajectoryPlannerParams,),
    ),
    (
        flag(
            "escape_collision",
            True,
            "escape_collision",
            "A round robot without a legal trajectory moves to where costs are lower.",
        ),
        (NavigatorParams,),
    ),
    (
        flag(
            "command_in_first_cycle",
            True,
            "command_in_first_cycle",
            "Publish the first command of a goal in the control cycle that takes it, not one period"
            " later.",
        ),
        (NavigatorParams,),
    ),
    (
        flag(
            "stop_while_planning",
            True,
            "stop_while_planning",
            "Publish a stop in each control cycle without a plan.",
        ),
        (NavigatorParams,),
    ),
    (
        flag(
            "plan_inside_map",
            True,
            "plan_inside_map",
            "Plans keep the robot's inscribed radius from the edge of a global costmap that does"
            " not roll, if start and goal do.",
        ),
        (NavigatorParams,),
    ),
    (
        flag(
            "predict_goal_turn",
            True,
            "predict_goal_turn",
            "Turn no farther in one control period than is left to the goal's heading.",
        ),
        (TrajectoryPlannerParams, DwaParams),
    ),
    (
        flag(
            "respect_meter_scoring",
            False,
            "respect_meter_scoring",
            "Respect meter_scoring. Upstream scores in metres whatever is set.",
        ),
        (TrajectoryPlannerParams,),
    ),
    (
        flag(
            "stop_after_rotation",
            True,
            "stop_after_rotation",
            "Publish a stop after a rotation recovery.",
        ),
        (RotateParams,),
    ),
    (
        flag(
            "avoid_peers",
            True,
            "avoid_peers",
            "Avoid the other robots whose poses are known, and yield by priority.",
        ),
        (PeerParams,),
    ),
    (
        double(
            "peer_margin",
            0.05,
            "margin_m",
            "metres",
            "Distance that each of two robots keeps its footprint from the bisector between them.",
            low=0,
            high=2,
        ),
        (PeerParams,),
    ),
    (
        double(
            "peer_timeout",
            0.5,
            "timeout_s",
            "seconds",
            "A peer whose state is older than this is left to the LIDAR.",
            low=0,
            high=60,
        ),
        (PeerParams,),
    ),
    (
        flag(
            "yield_when_idle",
            True,
            "yield_when_idle",
            "A robot without a goal leaves the path of a peer, and comes back.",
        ),
        (PeerParams,),
    ),
    (
        flag(
            "roundabouts",
            True,
            "roundabouts",
            "Where the ways of four robots or more meet, all keep right of a circle.",
        ),
        (PeerParams,),
    ),
    (
        flag(
            "yield_to_moving_obstacles",
            False,
            "yield_to_moving_obstacles",
            "A robot makes room for a tracked obstacle that keeps it from its goal.",
        ),
        (PeerParams,),
    ),
    (
        double(
            "moving_obstacle_patience",
            3.0,
            "moving_obstacle_patience_s",
            "seconds",
            "Time without progress until a robot makes room for a moving obstacle; up to twice as"
            " much is added at random.",
            low=0.1,
            high=60,
        ),
        (PeerParams,),
    ),
    (
        flag(
            "notice_silence_at_once",
            True,
            "notice_silence_at_once",
            "A costmap is out of date as soon as a sensor is overdue, not from its next update on.",
        ),
        (ObstacleLayerParams, VoxelLayerParams),
    ),
    (
        flag(
            "draw_all_map_updates",
            True,
            "draw_all_map_updates",
            "Draw every map update of a static layer, not only the last one before an update of the"
            " costmap.",
        ),
        (StaticLayerParams,),
    ),
    (
        flag(
            "restore_static_map",
            True,
            "restore_static_map",
            "clear_costmaps restores the map of a static layer and draws all of it.",
        ),
        (StaticLayerParams,),
    ),
    (
        flag(
            "transform_map_bounds",
            True,
            "transform_map_bounds",
            "Draw a map in another frame than a rolling costmap's wherever it is in that costmap.",
        ),
        (StaticLayerParams,),
    ),
    (
        flag(
            "clip_voxel_rays",
            True,
            "clip_voxel_rays",
            "Rays that leave the voxels clear up to their borders, also where upstream clears"
            " nothing.",
        ),
        (VoxelLayerParams,),
    ),
    (
        flag(
            "redraw_emptied_voxels",
            True,
            "redraw_emptied_voxels",
            "Draw a voxel layer again after a reconfiguration that empties it.",
        ),
        (VoxelLayerParams,),
    ),
)

FIXES_TABLE = Table(
    reconfigurable=(
        *(parameter for parameter, _ in _SWITCHES),
        RESTORE_DEFAULTS,
    )
)


def switches_of(owner: type) -> Tuple[Parameter, ...]:
    """The switches of the group that a dataclass of parameters owns."""
    return tuple(parameter for parameter, owners in _SWITCHES if owner in owners)


def with_fixes(params: _Params, tree: Mapping[str, Any]) -> _Params:
    """Set the switches that a dataclass of parameters owns to those of a normalised tree.

    Args:
        params: The parameters of one part; what owns no switch is returned unchanged.
        tree: The parameter tree, at the node's level.
    """
    switches = switches_of(type(params))
    if not switches:
        return params
    # mypy cannot know that the type variable stands for a dataclass.
    changed: _Params = replace(cast(Any, params), **fields(tree.get(FIXES, {}), switches))
    return changed
