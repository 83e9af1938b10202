"""Where robots believe themselves, as the page shows it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Dict, Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D, angle_difference
from quad_web.view.state import Item

GIVEN_COVARIANCE: NDArray[np.float64] = np.diag([0.25, 0.25, (math.pi / 12.0) ** 2])
"""Of a pose that a person gives: that of RViz's "2D Pose Estimate"."""
SEARCHES = "searches the whole map"
LOST = "its localisation is lost"
_MOST_PARTICLES = 250


@dataclass(frozen=True, eq=False)
class Located:
    """Where a robot believes itself.

    Attributes:
        pose: In ``map``, None before the first estimate.
        covariance: float64[3, 3] of x, y in metres and yaw in radians.
        is_lost: It does not know its place, and hovers.
        searches: It can search the whole map.
        particles: float[n, 2 or more], their places in ``map``; None without any.
        truth: Where it is, None if nobody knows.
    """

    pose: Optional[Pose2D] = None
    covariance: NDArray[np.float64] = field(default_factory=lambda: np.full((3, 3), np.nan))
    is_lost: bool = False
    searches: bool = False
    particles: Optional[NDArray[Any]] = None
    truth: Optional[Pose2D] = None

    def item(self, robot: int) -> Item:
        """Return the item ``localization/i``, with some of the particles."""
        pose, matrix = self.pose or Pose2D(math.nan, math.nan, math.nan), self.covariance
        row = (pose.x_m, pose.y_m, pose.yaw_rad, *matrix[[0, 0, 1, 2], [0, 1, 1, 2]])
        points = np.zeros((0, 2)) if self.particles is None else self.particles[:, :2]
        points = points[:: -(-len(points) // _MOST_PARTICLES) or 1]
        arrays = {"pose": np.array(row, "f4"), "points": points.astype("f4")}
        return Item(f"localization/{robot}", {"is_lost": self.is_lost}, arrays)

    def row(self) -> Dict[str, Any]:
        """Return the numbers for the item ``status``, without those that are not known."""
        variance_m2 = float(np.trace(self.covariance[:2, :2]))
        numbers = {"deviation_m": math.sqrt(variance_m2) if variance_m2 >= 0.0 else math.nan}
        if self.pose is not None:
            numbers["yaw"] = self.pose.yaw_rad
        if self.pose is not None and self.truth is not None:
            numbers["error_m"] = self.pose.distance_to(self.truth)
            turn_rad = angle_difference(self.pose.yaw_rad, self.truth.yaw_rad)
            numbers["error_rad"] = abs(float(turn_rad))
        known = {name: value for name, value in numbers.items() if math.isfinite(value)}
        return {"is_lost": self.is_lost, "searches": self.searches, **known}


def given_text(pose: Pose2D) -> str:
    """Return what was done with a pose that a person gave."""
    return f"pose set to ({pose.x_m:.2f}, {pose.y_m:.2f}), {math.degrees(pose.yaw_rad):.0f}°"
