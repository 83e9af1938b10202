"""The initial pose of amcl."""

from __future__ import annotations

from quad_localization.parameters import AmclParams
from quad_nav.geometry import Pose2D
from quad_nav.sim.scene_file import load_scene


def initial_pose(params: AmclParams, robot: int) -> Pose2D:
    """Return the pose of the parameters, or the start of a robot in the scene that they name.

    Raises:
        InputError: The scene has faults.
    """
    if params.scene:
        starts = load_scene(params.scene).starts
        if robot < len(starts):
            return starts[robot]
    return Pose2D(params.initial_pose_x_m, params.initial_pose_y_m, params.initial_pose_a_rad)
