"""Part of a global plan that lies near the robot.

Mirrors ``control/plan_follower.py``.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit


@njit(cache=True, nogil=True)
def stretch_near(
    plan: NDArray[np.float64],
    x: float,
    y: float,
    radius_m: float,
    translation: Tuple[float, float],
    rotation: Tuple[float, float],
    yaw: float,
) -> NDArray[np.float64]:
    """Return a plan's first stretch near a point, in another frame.

    It begins with the first pose that is near and ends with the first far one after it.

    Args:
        plan: float64[n, 3], rows x, y, yaw in its own frame.
        x: The point in the plan's frame, metres.
        y: Likewise.
        radius_m: Up to which a pose is near.
        translation: x, y of the plan's frame in the other frame, metres.
        rotation: Cosine and sine of its yaw.
        yaw: Its yaw, radians.

    Returns:
        float64[m, 3], in the other frame; empty if no pose is near.
    """
    first = 0
    while first < plan.shape[0] and not _distance2(plan, first, x, y) <= radius_m * radius_m:
        first += 1
    end = first
    while end < plan.shape[0] and _distance2(plan, end, x, y) <= radius_m * radius_m:
        end += 1
    end = min(end + 1, plan.shape[0])
    cos, sin = rotation
    stretch = np.empty((end - first, 3))
    for k in range(end - first):
        from_x, from_y = plan[first + k, 0], plan[first + k, 1]
        stretch[k, 0] = cos * from_x - sin * from_y + translation[0]
        stretch[k, 1] = sin * from_x + cos * from_y + translation[1]
        stretch[k, 2] = plan[first + k, 2] + yaw
    return stretch


@njit(cache=True, nogil=True)
def count_farther(plan: NDArray[np.float64], x: float, y: float, distance2_m2: float) -> int:
    """Count the poses at a plan's beginning, float64[n, 3], that are so far from a point or more.

    The distance is given squared.
    """
    count = 0
    while count < plan.shape[0] and not _distance2(plan, count, x, y) < distance2_m2:
        count += 1
    return count


@njit(cache=True, nogil=True)
def _distance2(plan: NDArray[np.float64], k: int, x: float, y: float) -> float:
    dx, dy = x - plan[k, 0], y - plan[k, 1]
    return dx * dx + dy * dy
