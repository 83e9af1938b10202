"""Obstacles that a quadcopter at its altitude touches, and its LIDAR does not see.

The LIDAR measures in the plane through the hull's middle. What the hull reaches, but the plane
misses, such as the top of a table, is flown into without a stop.
"""

from __future__ import annotations

from typing import List

import numpy as np
from numpy.typing import NDArray

from quad_nav.sim.scene import MOUNT_HEIGHT_M, Scene, hull_heights_m

_STEP_M, _FAR_M, _LOWEST_M = 0.05, 2.0, 0.3
"""Altitudes that are tried: how fine, how far from the scene's own, and the lowest one."""
_TILT_M = 0.05
"""Beams of a tilted LIDAR pass above or below what its plane hardly cuts."""
_NAMED = 5


def unseen_obstacles(scene: Scene) -> List[str]:
    """Return a line on the obstacles of a scene that are touched and not seen, with a way out."""
    solids = [*scene.obstacles, *scene.moving_shapes]
    bottoms_m = np.array([one.bottom_m for one in solids])
    tops_m = np.array([one.top_m for one in solids])
    unseen = _is_unseen(bottoms_m, tops_m, scene.altitude_m)
    if not unseen.any():
        return []
    names = [one.name for one, is_one in zip(solids, unseen) if is_one]
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    steps = np.arange(1, round(_FAR_M / _STEP_M) + 1) * _STEP_M
    free = [
        next((one for one in altitudes.tolist() if _is_free(bottoms_m, tops_m, one)), None)
        for altitudes in (scene.altitude_m - steps, scene.altitude_m + steps)
    ]
    named = " or ".join(f"{one:.2f} m" for one in free if one is not None)
    advice = f"expected an altitude of {named}" if named else "no altitude is better"
    return [
        f"altitude {scene.altitude_m:g} m: quadcopters touch {', '.join(names[:_NAMED])}{more}, "
        f"which their LIDARs do not see; {advice}"
    ]


def _is_free(
    bottoms_m: NDArray[np.float64], tops_m: NDArray[np.float64], altitude_m: float
) -> bool:
    return altitude_m >= _LOWEST_M and not _is_unseen(bottoms_m, tops_m, altitude_m, _TILT_M).any()


def _is_unseen(
    bottoms_m: NDArray[np.float64],
    tops_m: NDArray[np.float64],
    altitude_m: float,
    margin_m: float = 0.0,
) -> NDArray[np.bool_]:
    """Tell of solids between these heights, float64[n] each, whether they are touched unseen."""
    plane_m = altitude_m + MOUNT_HEIGHT_M
    lowest_m, highest_m = hull_heights_m(altitude_m)
    is_touched = (bottoms_m < highest_m) & (tops_m > lowest_m)
    return is_touched & ((plane_m < bottoms_m + margin_m) | (plane_m > tops_m - margin_m))
