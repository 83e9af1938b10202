"""The pose that a person gives a robot, as of RViz's "2D Pose Estimate"."""

from __future__ import annotations

from typing import Tuple

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from numpy.typing import NDArray

from quad_nav.errors import excerpt
from quad_nav.geometry import Pose3D
from quad_nav.ros.common.conversions import pose_from_message
from quad_nav.topics.validation import pose_problem


def given_pose(
    message: PoseWithCovarianceStamped, wanted: str
) -> Tuple[Pose3D, NDArray[np.float64]]:
    """Return a pose in the frame ``wanted``, and its covariance float64[3, 3] of x, y and yaw.

    Raises:
        ValueError: It is in another frame, or not valid; says why.
    """
    pose, frame = pose_from_message(message.pose.pose), message.header.frame_id.lstrip("/")
    matrix = np.array(message.pose.covariance, np.float64).reshape(6, 6)
    covariance = np.zeros((3, 3))
    covariance[:2, :2], covariance[2, 2] = matrix[:2, :2], matrix[5, 5]
    problem = pose_problem(pose)
    if frame not in ("", wanted):
        problem = f"frame '{excerpt(frame)}', expected '{wanted}'"
    elif not _is_covariance(covariance):
        problem = "the covariance is not positive semidefinite"
    if problem:
        raise ValueError(problem)
    return pose, covariance


def _is_covariance(matrix: NDArray[np.float64]) -> bool:
    """Tell whether float64[3, 3] is finite and, rounding apart, positive semidefinite."""
    if not np.all(np.isfinite(matrix)):
        return False
    values = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))
    return bool(values[0] >= -1e-9 * max(1.0, abs(float(values[-1]))))
