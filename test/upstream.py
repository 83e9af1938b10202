"""Upstream behaviour: the switches of the group ``fixes`` that are off where tests want it."""

from __future__ import annotations

UPSTREAM = {
    "progress_timeout": 0.0,
    "stuck_cost_factor": 1.0,
    "sensor_timeout": 0.0,
    "reject_implausible_scans": False,
    "clear_any_obstacle_layer": False,
    "redraw_cleared_costmaps": False,
    "limit_all_speeds": False,
    "reject_colliding_escape": False,
    "end_blocked_escape": False,
    "plan_inside_map": False,
    "escape_collision": False,
    "command_in_first_cycle": False,
    "stop_while_planning": False,
    "predict_goal_turn": False,
    "stop_after_rotation": False,
    "avoid_peers": False,
    "yield_when_idle": False,
    "roundabouts": False,
    "notice_silence_at_once": False,
    "draw_all_map_updates": False,
    "restore_static_map": False,
    "transform_map_bounds": False,
    "clip_voxel_rays": False,
    "redraw_emptied_voxels": False,
}
