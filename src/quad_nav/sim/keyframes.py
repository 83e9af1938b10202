"""Poses of bodies that move along keyframes.

``sim/motion.py`` has the formulas and their sources.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit


class Keyframes(NamedTuple):
    """Keyframes of m motions, one motion after the other.

    The keyframes of motion k are the rows ``first[k]:first[k + 1]``.
    """

    first: NDArray[np.int64]
    """int64[m + 1]"""
    times: NDArray[np.float64]
    """float64[n], seconds, increasing within a motion"""
    poses: NDArray[np.float64]
    """float64[n, 3], x, y in metres and yaw in radians"""
    tangents: NDArray[np.float64]
    """float64[n, 3], of the spline at each keyframe, per segment"""
    splines: NDArray[np.bool_]
    """bool[m], whether a spline leads through the keyframes, or straight lines"""
    loops: NDArray[np.bool_]
    """bool[m], whether a motion starts again after its last keyframe"""
    phases: NDArray[np.float64]
    """float64[m], seconds that a motion is ahead of the time"""


@njit(cache=True, nogil=True)
def fill_poses(
    keyframes: Keyframes, times: NDArray[np.float64], poses: NDArray[np.float64]
) -> None:
    """Compute the poses of all motions at some times.

    Args:
        keyframes: The motions.
        times: float64[t], seconds since the motions' common start.
        poses: float64[t, m, 3], filled with x, y in metres and yaw in radians.
    """
    for motion in range(keyframes.loops.shape[0]):
        begin, end = keyframes.first[motion], keyframes.first[motion + 1]
        stamps = keyframes.times[begin:end]
        rows, tangents = keyframes.poses[begin:end], keyframes.tangents[begin:end]
        last = end - begin - 1
        for k in range(times.shape[0]):
            time = times[k] + keyframes.phases[motion]
            if keyframes.loops[motion] and stamps[last] > 0.0:
                time %= stamps[last]
            if time <= stamps[0] or last == 0:
                poses[k, motion] = rows[0]
                continue
            if time >= stamps[last]:
                poses[k, motion] = rows[last]
                continue
            i = np.searchsorted(stamps, time, side="right") - 1
            u = (time - stamps[i]) / (stamps[i + 1] - stamps[i])
            if not keyframes.splines[motion]:
                for axis in range(3):
                    poses[k, motion, axis] = rows[i, axis] + u * (rows[i + 1, axis] - rows[i, axis])
                continue
            uu = u * u
            uuu = uu * u
            for axis in range(3):
                poses[k, motion, axis] = (
                    (2.0 * uuu - 3.0 * uu + 1.0) * rows[i, axis]
                    + (uuu - 2.0 * uu + u) * tangents[i, axis]
                    + (3.0 * uu - 2.0 * uuu) * rows[i + 1, axis]
                    + (uuu - uu) * tangents[i + 1, axis]
                )
