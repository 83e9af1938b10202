"""Simultaneous localization and mapping: all robots of a flight find their poses and one map.

Each scan is fitted to the map that grows, from where odometry expects it. Odometry and the fit are
weighed by their covariances, so that a corridor, along which a scan fits everywhere, leaves that
direction to odometry. There is no loop closure.

Sources: the fit is that of Kohlbrecher and others (``growing_map``); the search over poses, for
robots that start somewhere in the map of others and for those that are lost, is that of Olson,
"Real-time correlative scan matching", ICRA 2009, at one resolution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Dict, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_localization.growing_map import GrowingMap
from quad_localization.growing_map_kernel import fit, normal_equations, search
from quad_nav.geometry import Pose2D, angle_difference

Floats = NDArray[np.float64]

_ITERATIONS = 4
_BEAMS = 180
"""Points of a scan that are fitted; more cost time and tell nothing new."""
_GAP_M = 0.3
"""Neighbouring ends of beams that are nearer are on one surface. Those further apart, as of beams
that graze a wall, tell where the beams were rather than where the wall is."""
_ENOUGH_KNOWN = 0.3
"""Share of a scan that must be on the map to be fitted to it."""


@dataclass(frozen=True)
class SlamParams:
    """Parameters of the method.

    Attributes:
        resolution_m: Size of the map's cells.
        odom_per_m: Standard deviation of odometry after 1 m, in m.
        odom_per_rad: Standard deviation of odometry after 1 rad, in rad.
        start_m: Standard deviation of the start positions.
        start_rad: Standard deviation of the start headings.
        insert_m: Way after which a scan is inserted.
        insert_rad: Turn after which a scan is inserted.
        lost_below: Mean occupancy at the ends of beams below which the robot is lost.
    """

    resolution_m: float = 0.05
    odom_per_m: float = 0.1
    odom_per_rad: float = 0.1
    start_m: float = 0.15
    start_rad: float = 0.05
    insert_m: float = 0.2
    insert_rad: float = 0.2
    lost_below: float = 0.4


@dataclass
class SlamPose:
    """What is known of a robot's place.

    Attributes:
        map_from_odom: Where its odometry frame is.
        covariance: float64[3, 3] of (x_m, y_m, yaw_rad) of the robot in ``map``.
        is_lost: The last scan does not fit the map.
        fit: Mean occupancy at the ends of its beams, 1 at best.
    """

    map_from_odom: Pose2D
    covariance: Floats
    is_lost: bool = False
    fit: float = 1.0
    odom_from_base: Optional[Pose2D] = field(default=None, repr=False)
    inserted: Optional[Pose2D] = field(default=None, repr=False)


class Slam:
    """One map and the poses of all robots in it.

    Attributes:
        map: The map.
        poses: The robots' places by number, after their first scans.
    """

    def __init__(self, starts: Dict[int, Pose2D], params: SlamParams = SlamParams()) -> None:
        """Start with an empty map; ``starts`` are roughly the poses in ``map`` at first."""
        self._params, self._starts = params, starts
        self.map = GrowingMap(params.resolution_m)
        self.poses: Dict[int, SlamPose] = {}

    def add_scan(
        self, robot: int, odom_from_base: Pose2D, sensor: Tuple[float, float], points: Floats
    ) -> SlamPose:
        """Find a robot's place by a scan, and let the map grow.

        Args:
            robot: Number of the robot.
            odom_from_base: Its pose by odometry at the scan's stamp.
            sensor: The LIDAR's position (x_m, y_m) in the robot's frame.
            points: float64[n, 2], ends of neighbouring beams in the robot's frame, projected to the
                ground.
        """
        points, surfaces = on_surfaces(points, self._params.resolution_m)
        place, is_first = self._predicted(robot, odom_from_base), robot not in self.poses
        self.poses[robot] = place
        if not len(points):
            place.fit, place.is_lost = 0.0, True
            return place
        few = points[:: max(1, len(points) // _BEAMS)]
        prior = _row(place.map_from_odom.compose(odom_from_base))
        start = self._searched(prior, place, few) if is_first or place.is_lost else prior
        if fit(self.map.views[-1], start, few)[1] >= _ENOUGH_KNOWN:
            found = self._fitted(start, prior, place, few)
            place.map_from_odom = _pose(found).compose(odom_from_base.inverse())
        else:
            found, place.is_lost = prior, False
        self._insert(place, _pose(found), sensor, surfaces)
        return place

    def _predicted(self, robot: int, odom_from_base: Pose2D) -> SlamPose:
        """Return a robot's place by odometry alone, its covariance grown by the way."""
        params, place = self._params, self.poses.get(robot)
        if place is None or place.odom_from_base is None:
            map_from_odom = self._starts[robot].compose(odom_from_base.inverse())
            deviations = params.start_m, params.start_m, params.start_rad
            place = SlamPose(map_from_odom, np.diag(np.square(deviations)))
        else:
            before = place.odom_from_base
            way_m = before.distance_to(odom_from_base)
            turn_rad = abs(angle_difference(odom_from_base.yaw_rad, before.yaw_rad))
            across = params.odom_per_m**2 * way_m
            growth = across, across, params.odom_per_rad**2 * (turn_rad + way_m)
            place.covariance = place.covariance + np.diag(growth)
        place.odom_from_base = odom_from_base
        return place

    def _fitted(self, start: Floats, prior: Floats, place: SlamPose, points: Floats) -> Floats:
        """Return the pose float64[3] that fits best; update covariance, fit and ``is_lost``.

        The steps begin at ``start``; ``prior`` is the pose by odometry.
        """
        information = np.linalg.inv(place.covariance)
        found, hessian = start, information
        for view in reversed(self.map.views):
            for _ in range(_ITERATIONS):
                hessian, gradient = normal_equations(view, found, points)
                pull = information @ _difference(prior, found)
                step = np.linalg.solve(hessian + information, gradient + pull)
                found = found + np.clip(step, -0.2, 0.2)
        place.fit = fit(self.map.views[-1], found, points)[0]
        place.is_lost = place.fit < self._params.lost_below
        if place.is_lost:
            return prior
        place.covariance = np.linalg.inv(hessian + information)
        return found

    def _searched(self, prior: Floats, place: SlamPose, points: Floats) -> Floats:
        """Return the best of the poses around one, within two standard deviations of it."""
        view = self.map.views[-1]
        reach_m, reach_rad = 2.0 * np.sqrt(np.diag(place.covariance))[[0, 2]]
        steps = np.arange(-reach_m, reach_m + view.resolution_m, view.resolution_m)
        turns = np.arange(-reach_rad, reach_rad + 0.05, 0.05)
        offsets = np.stack(np.meshgrid(steps, steps, turns, indexing="ij"), axis=-1)
        poses = prior + offsets.reshape(-1, 3)
        best: Floats = poses[search(view, poses, points)]
        return best

    def _insert(
        self, place: SlamPose, found: Pose2D, sensor: Tuple[float, float], points: Floats
    ) -> None:
        """Insert a scan if its robot has moved far enough since its last one, and is not lost."""
        last, params = place.inserted, self._params
        if place.is_lost:
            return
        if last is not None:
            turn_rad = abs(angle_difference(found.yaw_rad, last.yaw_rad))
            if last.distance_to(found) < params.insert_m and turn_rad < params.insert_rad:
                return
        place.inserted = found
        self.map.insert(np.array(found.transform(*sensor)), found.transform_points(points))


def on_surfaces(points: Floats, step_m: float) -> Tuple[Floats, Floats]:
    """Return the ends of beams that have a near neighbour, and these with the surface between them.

    Args:
        points: float64[n, 2], ends of beams, in the order of their angles.
        step_m: Largest distance of points on a surface.

    Returns:
        float64[m, 2] and float64[k, 2].
    """
    if not len(points):
        return points, points
    gaps = np.roll(points, -1, axis=0) - points
    lengths_m = np.hypot(gaps[:, 0], gaps[:, 1])
    is_surface = lengths_m < _GAP_M
    steps = np.ceil(lengths_m[is_surface] / step_m).astype(np.int64)
    starts = np.repeat(np.flatnonzero(is_surface), steps)
    numbers = np.arange(len(starts)) - np.repeat(np.cumsum(steps) - steps, steps)
    between = points[starts] + gaps[starts] * (numbers / np.repeat(steps, steps))[:, None]
    return points[is_surface | np.roll(is_surface, 1)], between


def _row(pose: Pose2D) -> Floats:
    return np.array([pose.x_m, pose.y_m, pose.yaw_rad])


def _pose(row: Floats) -> Pose2D:
    return Pose2D(float(row[0]), float(row[1]), float(row[2]))


def _difference(to: Floats, of: Floats) -> Floats:
    """Return the difference of two poses, of which the angle is the shortest turn."""
    difference = to - of
    difference[2] = math.remainder(difference[2], 2.0 * math.pi)
    return difference
