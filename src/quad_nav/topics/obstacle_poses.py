"""Where the moving obstacles of a scene are: ``geometry_msgs/PoseArray`` for programs.

The simulator publishes them every ``OBSTACLES_PERIOD_S`` in ``map``, in the order of
``scene.moving_shapes``. RViz shows the markers on ``OBSTACLES_TOPIC``.
"""

from __future__ import annotations

import math
from typing import Any, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.sim.scene import Scene

OBSTACLES_TOPIC, POSES_TOPIC = "/simulation/obstacles", "/simulation/obstacle_poses"
POSES_KIND = "geometry_msgs/PoseArray"
OBSTACLES_PERIOD_S = 0.1


def moving_poses(poses: Sequence[Any], count: int) -> NDArray[np.float64]:
    """Read the poses of a message of rospy or of a recording.

    Args:
        poses: Of type ``geometry_msgs/Pose``; the obstacles turn about z only.
        count: Number of moving obstacles of the scene.

    Returns:
        float64[count, 3], (x_m, y_m, yaw_rad) in ``map``.

    Raises:
        ValueError: There are more or fewer of them, or one is nowhere.
    """
    if len(poses) != count:
        raise ValueError(f"{len(poses)} poses; expected {count}, as the scene has moving obstacles")
    rows = np.array(
        [
            (p.position.x, p.position.y, 2.0 * math.atan2(p.orientation.z, p.orientation.w))
            for p in poses
        ]
    ).reshape(-1, 3)
    if not np.isfinite(rows).all():
        raise ValueError(f"pose {int(np.argmin(np.isfinite(rows).all(axis=1)))} is not finite")
    return rows


def people_positions(poses: Sequence[Any], scene: Scene) -> NDArray[np.float64]:
    """Return where a message says that a scene's people are.

    Returns:
        float64[n, 2], metres in ``map``.

    Raises:
        ValueError: As ``moving_poses``.
    """
    return moving_poses(poses, len(scene.moving_shapes))[scene.walker_rows, :2]
