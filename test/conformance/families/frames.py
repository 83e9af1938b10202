"""Transforms between frames, with the order of operations of tf2."""

from __future__ import annotations

import math
from typing import Dict, List, Optional, Tuple

from quad_nav.geometry import Pose3D, multiply_quaternions


def inverted(pose: Pose3D) -> Pose3D:
    """The inverse, to the last bit as tf2 computes it for planar poses.

    tf2 turns the translation by two quaternion products.
    """
    qx, qy, qz, qw = pose.quaternion
    back = (-qx, -qy, -qz, qw)
    x, y, z, _ = multiply_quaternions(
        multiply_quaternions(back, (-pose.x_m, -pose.y_m, -pose.z_m, 0.0)), (qx, qy, qz, qw)
    )
    return Pose3D(x, y, z, back)


class Frames:
    """A tree of frames, each with its latest pose in its parent."""

    def __init__(self) -> None:
        self._parents: Dict[str, Tuple[str, Pose3D]] = {}

    def set_transform(self, parent: str, child: str, parent_from_child: Pose3D) -> None:
        self._parents[child] = (parent, parent_from_child)

    def lookup(self, to_frame: str, from_frame: str) -> Optional[Pose3D]:
        """Pose of one frame in another; None when they are not connected."""
        up, down = self._ancestors(from_frame), self._ancestors(to_frame)
        common = next((frame for frame, _ in up if frame in dict(down)), None)
        if common is None:
            return None
        common_from, common_to = dict(up)[common], dict(down)[common]
        if to_frame == common:
            return common_from
        if from_frame == common:
            return inverted(common_to)
        return inverted(common_to).compose(common_from)

    def _ancestors(self, frame: str) -> List[Tuple[str, Pose3D]]:
        """The frame and those above it, each with the pose of the frame in it."""
        found = [(frame, Pose3D(0.0, 0.0, 0.0))]
        while frame in self._parents:
            parent, pose = self._parents[frame]
            found.append((parent, pose if len(found) == 1 else pose.compose(found[-1][1])))
            frame = parent
        return found


def yaw_of_inverse(pose: Pose3D) -> float:
    """The yaw of the inverse, by way of a matrix and back as tf2 does it."""
    rotation = inverted(pose).rotation
    root = math.sqrt(rotation.trace() + 1.0)
    return 2.0 * math.atan2((rotation[1, 0] - rotation[0, 1]) * (0.5 / root), root * 0.5)
