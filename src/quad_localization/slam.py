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
from quad_localization.map_files import CELL_M
from quad_nav.costmap.projection import scan_points
from quad_nav.geometry import Pose2D, Pose3D, Scan, angle_difference

Floats = NDArray[np.float64]

_ITERATIONS = 4
_LARGEST_STEP = 0.2
"""In m and rad. Far from the fit the equations, which are linear, lead too far."""
_BEAMS = 180
"""Points of a scan that are fitted; more cost time and tell nothing new."""
_GAP_M = 0.3
"""Neighbouring ends of beams that are nearer are on one surface. Those further apart, as of beams
that graze a wall, tell where the beams were rather than where the wall is."""
_SEARCH_M, _SEARCH_RAD = 2.0, 0.5
_ENOUGH_KNOWN = 0.3
"""Share of a scan that must be on the map to be fitted to it."""
_FAR_M = 100.0
"""Farther than a LIDAR sees; a map that holds such a place may not fit into memory."""


@dataclass(frozen=True)
class SlamParams:
    """Parameters of the method.

    Attributes:
        resolution_m: Size of the map's cells.
        odom_per_m: Standard deviation of odometry after 1 m, in m.
        odom_per_rad: Standard deviation of odometry after 1 rad, in rad.
        start_m: Standard deviation of the positions of the odometry frames at the start.
        start_rad: Standard deviation of their headings.
        peer_m: Radius around a peer in which beams end on it, and are left out.
        band_m: Height above and below the LIDAR in which ends of beams count: a quadcopter tilts,
            and its beams may hit the floor.
        insert_m: Way after which a scan is inserted.
        insert_rad: Turn after which a scan is inserted.
        lost_below: Mean occupancy at the ends of beams below which the robot is lost. Where a scan
            fits, it is 0.6 or more; in free space it is near 0.
        lost_above_m: Standard deviation above which a robot whose scan is off the map is lost.
    """

    resolution_m: float = CELL_M
    odom_per_m: float = 0.1
    odom_per_rad: float = 0.1
    start_m: float = 0.15
    start_rad: float = 0.05
    peer_m: float = 0.6
    band_m: float = 0.3
    insert_m: float = 0.2
    insert_rad: float = 0.2
    lost_below: float = 0.4
    lost_above_m: float = 0.5


@dataclass
class SlamPose:
    """Estimate of a robot's place.

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
        frames: Roughly the odometry frames in ``map``, of robots without a place.
        poses: The robots' places by number, after their first scans.
    """

    def __init__(self, frames: Dict[int, Pose2D], params: SlamParams = SlamParams()) -> None:
        """Start with an empty map."""
        self._params, self.frames = params, frames
        self.map = GrowingMap(params.resolution_m)
        self.poses: Dict[int, SlamPose] = {}

    def add_scan(
        self, robot: int, scan: Scan, odom_from_base: Pose2D, odom_from_lidar: Pose3D
    ) -> SlamPose:
        """Find a robot's place by a scan, and let the map grow.

        Args:
            robot: Number of the robot.
            scan: The scan.
            odom_from_base: The robot's pose by odometry at the scan's stamp.
            odom_from_lidar: Its LIDAR's pose.
        """
        place, is_first = self._predicted(robot, odom_from_base), robot not in self.poses
        self.poses[robot] = place
        in_odom = self._points(robot, scan, odom_from_lidar)
        points, surfaces = on_surfaces(
            odom_from_base.inverse_transform_points(in_odom), self._params.resolution_m
        )
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
            found, place.fit, place.is_lost = prior, 0.0, self._is_astray(place, prior)
        sensor = odom_from_base.inverse_transform(odom_from_lidar.x_m, odom_from_lidar.y_m)
        self._insert(place, _pose(found), sensor, surfaces)
        return place

    def set_pose(self, robot: int, map_from_base: Pose2D) -> None:
        """Tell where a robot roughly is, as a person sees it; its next scan finds the place."""
        place = self.poses.pop(robot, None)
        if place is not None and place.odom_from_base is not None:
            self.frames[robot] = map_from_base.compose(place.odom_from_base.inverse())

    def _points(self, robot: int, scan: Scan, odom_from_lidar: Pose3D) -> Floats:
        """Return the ends of beams float64[n, 2] in the odometry frame, without those on peers."""
        params, height_m = self._params, odom_from_lidar.z_m
        map_from_odom, circles = self.poses[robot].map_from_odom, []
        for number, peer in self.poses.items():
            if number != robot and peer.odom_from_base is not None:
                here = peer.map_from_odom.compose(peer.odom_from_base)
                place = map_from_odom.inverse_transform(here.x_m, here.y_m)
                circles.append((*place, params.peer_m))
        heights_m = height_m - params.band_m, height_m + params.band_m
        excluded = np.array(circles).reshape(-1, 3)
        points = scan_points(scan, False, odom_from_lidar, heights_m, excluded)
        return points[:, :2].astype(np.float64)

    def _predicted(self, robot: int, odom_from_base: Pose2D) -> SlamPose:
        """Return a robot's place by odometry alone, its covariance grown by the way."""
        params, place = self._params, self.poses.get(robot)
        if place is None or place.odom_from_base is None:
            map_from_odom = self.frames[robot]
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
                found = found + np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
        place.fit = fit(self.map.views[-1], found, points)[0]
        place.is_lost = place.fit < self._params.lost_below
        if place.is_lost:
            return prior
        place.covariance = np.linalg.inv(hessian + information)
        return found

    def _is_astray(self, place: SlamPose, prior: Floats) -> bool:
        """Tell whether a robot whose scan is off the map is lost: unsure, or far away."""
        is_unsure = np.trace(place.covariance[:2, :2]) > self._params.lost_above_m**2
        return bool(is_unsure or self.map.distance_m(prior[:2]) > _FAR_M)

    def _searched(self, prior: Floats, place: SlamPose, points: Floats) -> Floats:
        """Return the best of the poses around one, within two standard deviations of it.

        A robot that is lost for long is not searched in the whole map: that takes time.
        """
        view = self.map.views[-1]
        deviations = np.sqrt(np.diag(place.covariance))
        reach_m, reach_rad = np.minimum(2.0 * deviations[[0, 2]], (_SEARCH_M, _SEARCH_RAD))
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
