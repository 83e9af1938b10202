"""Paths as the bytes of ``nav_msgs/Path``: a plan has hundreds of poses, 20 times a second.

All poses of a path have records of one size, so that numpy writes them at once.
"""

from __future__ import annotations

import functools
from typing import Iterable

import numpy as np

from quad_nav.geometry import Pose3D
from quad_nav.recording.messages import encode, header, pose_stamped

_NS = 10**9


def plan_bytes(plan: np.ndarray, frame: str, stamp: int) -> bytes:
    """A plan float64[n, 3], rows (x, y, yaw); every pose carries the stamp."""
    records = np.zeros(len(plan), dtype=_record(len(frame.encode())))
    records["sec"], records["nsec"] = stamp // _NS, stamp % _NS
    records["length"], records["frame"] = len(frame.encode()), frame.encode()
    records["place"][:, :2] = plan[:, :2]
    half_rad = plan[:, 2] / 2.0
    records["quaternion"][:, 2] = np.sin(half_rad)
    records["quaternion"][:, 3] = np.cos(half_rad)
    return _path(frame, stamp, len(plan), records.tobytes())


def pose_bytes(pose: Pose3D, frame: str, stamp: int) -> bytes:
    """One pose of a path, for ``path_bytes``."""
    return encode(pose_stamped(pose, frame, stamp))


def path_bytes(poses: Iterable[bytes], frame: str, stamp: int) -> bytes:
    parts = list(poses)
    return _path(frame, stamp, len(parts), b"".join(parts))


def _path(frame: str, stamp: int, count: int, poses: bytes) -> bytes:
    return encode(header(frame, stamp)) + count.to_bytes(4, "little") + poses


@functools.lru_cache(maxsize=None)
def _record(frame_length: int) -> np.dtype:
    """``geometry_msgs/PoseStamped`` with a frame's name of so many bytes."""
    return np.dtype(
        [
            ("seq", "<u4"),
            ("sec", "<u4"),
            ("nsec", "<u4"),
            ("length", "<u4"),
            ("frame", f"S{frame_length}"),
            ("place", "<f8", 3),
            ("quaternion", "<f8", 4),
        ]
    )
