"""Costs of positions that moving obstacles are predicted to be near at the same time.

``control/prediction.py`` has the predictions. The costs are those of costmap cells, so a planner
weighs a pass near something that moves as it weighs cells near a wall. Planners look at these costs
pose by pose, each at its own time, so a rollout may lead through a place that an obstacle has left.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.collision import COLLIDES
from quad_nav.files.kernel_cache import njit
from quad_nav.grid import INSCRIBED

_CERTAIN_M = 0.3  # standard deviation up to which a predicted collision makes a rollout illegal
_FAR = 3.0  # standard deviations at which the costs end


class MovingDiscs(NamedTuple):
    """Predicted moving obstacles over the time of a rollout.

    The predictions are evenly spaced in time, from now to the end of a rollout.
    """

    discs: NDArray[np.float64]  # [t, n, 4]: x, y, radius with the robot's, standard deviation
    clearance_m: float


@njit(cache=True, nogil=True)
def passing_cost(moving: MovingDiscs, share: float, x: float, y: float) -> float:
    """Return the cost of a position, 0 to 252, COLLIDES where an obstacle is predicted.

    Within the clearance the cost is 252. Beyond, it falls off as a Gaussian with the uncertainty
    of the prediction. Where that is too uncertain the robot may pass at the cost of the clearance.

    Args:
        moving: The predicted obstacles.
        share: Share of the rollout's time that has passed, 0 to 1.
        x: Position in the frame of the discs, metres.
        y: Position in the frame of the discs, metres.
    """
    k = int(share * (moving.discs.shape[0] - 1) + 0.5)
    highest = 0.0
    for n in range(moving.discs.shape[1]):
        dx, dy = x - moving.discs[k, n, 0], y - moving.discs[k, n, 1]
        radius, sigma = moving.discs[k, n, 2], moving.discs[k, n, 3]
        squared = dx * dx + dy * dy
        if squared >= (radius + moving.clearance_m + _FAR * sigma) ** 2:
            continue
        distance = math.sqrt(squared)
        if distance < radius and sigma <= _CERTAIN_M:
            return COLLIDES
        beyond = max(distance - radius - moving.clearance_m, 0.0)
        highest = max(highest, (INSCRIBED - 1.0) * math.exp(-0.5 * (beyond / sigma) ** 2))
    return highest
