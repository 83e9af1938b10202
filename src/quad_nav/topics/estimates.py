"""Topics of robots that find their places: where they believe themselves, and where they are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

TRUTH_TOPIC = "/quad/truth"
"""True states of all robots in ``map``, of a simulation that leaves localization to others."""
TRUTH_KIND = "sensor_msgs/MultiDOFJointState"
ESTIMATE_KIND = "geometry_msgs/PoseWithCovarianceStamped"
_PLANAR = np.ix_((0, 1, 5), (0, 1, 5))


def planar_covariance(values: Any) -> NDArray[np.float64]:
    """Return the covariance float64[3, 3] of x, y in metres and yaw in radians of a message."""
    return np.array(values, np.float64).reshape(6, 6)[_PLANAR]
