"""Adaptive Monte Carlo localisation of one robot: odometry and scans in, pose and transform out.

``Amcl`` is the node without ROS. Calls come in the order of events; times are the caller's.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Dict, Optional

import numpy as np
from numpy.typing import NDArray

from quad_localization.laser import Laser
from quad_localization.occupancy_map import OccupancyMap, obstacle_distances
from quad_localization.odometry_models import angle_difference, moved
from quad_localization.parameters import AmclParams
from quad_localization.particle_filter import ParticleFilter
from quad_localization.place_search import PlaceSearch
from quad_localization.random_numbers import seeded
from quad_localization.scan_beams import Beams, beams_of, levelled, tilted_yaw
from quad_nav.geometry import Pose2D, Pose3D, Scan

Floats = NDArray[np.float64]

_SURE = 0.5
"""Weight of a cluster below which another place is as likely."""
_FOUND = np.diag((0.05**2, 0.05**2, 0.02**2))
"""Covariance of a pose that a search has found, in m and rad."""
_PATIENCE = 5
"""Scans in a row that do not fit before the whole map is searched: particles that were spread about
a pose that is roughly known need some."""


@dataclass(frozen=True)
class PoseEstimate:
    """A pose in the map, and its covariance float64[3, 3] of x, y in metres and yaw in radians."""

    pose: Pose2D
    covariance: Floats


@dataclass(frozen=True)
class Observation:
    """A scan, and where the robot was.

    Attributes:
        laser: Name of the laser: the scan's frame.
        scan: The scan.
        base_from_laser: Mount of the laser.
        odom_from_base: Pose by odometry at the stamp of the scan.
        peers: float64[k, 2], places of known peers in the map, metres.
    """

    laser: str
    scan: Scan
    base_from_laser: Pose3D
    odom_from_base: Pose3D
    peers: Floats = field(default_factory=lambda: np.empty((0, 2)))


@dataclass(frozen=True)
class Update:
    """Result of a scan.

    Attributes:
        is_moved: Whether the particles moved with the odometry.
        is_weighed: Whether the scan weighed them.
        is_resampled: Whether they were resampled.
        estimate: A new estimate; None between.
        shows_cloud: Whether the particles are to be published.
    """

    is_moved: bool = False
    is_weighed: bool = False
    is_resampled: bool = False
    estimate: Optional[PoseEstimate] = None
    shows_cloud: bool = False


class Amcl:
    """Localisation of one robot.

    Attributes:
        params: Parameters in force.
        has_map: Whether a map has come; before it, there are no particles.
        particles: The particle filter.
        estimate: Latest estimate, None before the first.
        map_from_odom: Latest transform.
        fit: Share of the last scan's beams that end near an obstacle of the map; None without any.
        search: The search of the whole map, on while scans do not fit the estimate.
        is_update_requested: Whether the next scan updates without motion.
        update_count: Updates since the last initialisation.
    """

    def __init__(self, params: AmclParams, seed: int) -> None:
        """Start without a map; upstream's seeds are the numbers of its initialisations."""
        self.params = params
        self.has_map = False
        self.estimate: Optional[PoseEstimate] = None
        self.map_from_odom: Optional[Pose3D] = None
        self.fit: Optional[float] = None
        self.is_update_requested = False
        self.update_count = 0
        self._random, self._spreads = seeded(seed), 0
        self._grid = OccupancyMap.from_occupancy(np.empty((0, 0), np.int8), 1.0, 0.0, 0.0)
        self._distances_m = np.empty((0, 0))  # of its cells to obstacles
        self.search = PlaceSearch(self._grid, self._random)
        self.particles = ParticleFilter(params, self._grid.free_places, self._random)
        self._lasers: Dict[str, Laser] = {}
        self._given: Optional[PoseEstimate] = None  # before the map
        self._misfits = 0  # scans in a row that do not fit the estimate
        self._has_begun = False  # since the last initialisation
        self._odometry = Pose2D(0.0, 0.0)  # at the last update

    @property
    def is_lost(self) -> bool:
        """The robot does not know its place, so that it has to hover until scans tell it."""
        return self.search.is_on or self._misfits > 0 or self._is_spread

    @property
    def cloud(self) -> Floats:
        """Poses float64[n, 3] to show: the particles, or the places that a search considers."""
        if self.search.is_on and len(self.search.poses):
            return self.search.poses
        return self.particles.poses

    @property
    def _is_spread(self) -> bool:
        """The heaviest cluster is light or wide: random particles of the recovery spread all."""
        limit_m = self.params.lost_above_m
        if not self.has_map or limit_m == 0.0 or self.params.upstream:
            return False
        statistics = self.particles.statistics
        if statistics.best < 0 or statistics.weights[statistics.best] < _SURE:
            return True
        return bool(np.trace(statistics.covariances[statistics.best][:2, :2]) > limit_m**2)

    def set_map(self, grid: OccupancyMap, initial: PoseEstimate) -> None:
        """Take a map, and begin at a pose, or at the one that was given before.

        A further map leaves the particles where they are; upstream begins anew.
        """
        self._make_sensors(grid)
        if self.has_map and not self.params.upstream:
            self.particles.free_places = grid.free_places
            return
        self.has_map = True
        self.particles = ParticleFilter(self.params, grid.free_places, self._random)
        self._spread(initial)
        if self._given is not None:
            self.set_pose(self._given)

    def set_pose(self, given: PoseEstimate) -> None:
        """Begin anew at a pose; without a map, when it comes."""
        self._given = None if self.has_map else given
        if self.has_map:
            self._spread(given)

    def set_uniform(self) -> bool:
        """Begin anew all over the free cells; return false if there are none."""
        if not len(self.particles.free_places):
            return False
        self.particles.spread_uniformly()
        self._has_begun, self._misfits = False, 0
        if self._is_judged:
            self.search.begin()
        return True

    def seed(self, seed: int) -> None:
        """Set the state of the random numbers."""
        self._random[:] = seeded(seed)

    def reconfigure(self, params: AmclParams) -> None:
        """Take other parameters; the particles stay.

        Upstream begins anew at its last estimate, or at the origin before the first.
        """
        self.params = self.particles.params = params
        self._make_sensors(self._grid)
        if params.upstream and self.has_map:
            self.particles = ParticleFilter(params, self._grid.free_places, self._random)
            last = self.estimate or PoseEstimate(Pose2D(0.0, 0.0), np.zeros((3, 3)))
            self._spread(PoseEstimate(last.pose, np.diag(np.diag(last.covariance))))

    def _make_sensors(self, grid: OccupancyMap) -> None:
        """Measure a map, and forget the lasers."""
        self._grid, self._lasers = grid, {}
        self._distances_m = obstacle_distances(grid, self.params.laser_likelihood_max_dist_m)
        was_searching = self.search.is_on
        self.search = PlaceSearch(grid, self._random)
        if was_searching:
            self.search.begin()

    def _spread(self, about: PoseEstimate) -> None:
        self._spreads += 1
        if self.params.upstream:
            self.seed(self._spreads)
        mean = np.array((about.pose.x_m, about.pose.y_m, about.pose.yaw_rad))
        self.particles.spread_normally(mean, about.covariance)
        self._has_begun, self._misfits = False, 0
        self.search.is_on = False

    def update(self, seen: Observation) -> Optional[Update]:
        """Take a scan; return None if nothing was done with it."""
        if not self.has_map:
            return None
        params, mount, at = self.params, seen.base_from_laser, seen.odom_from_base
        beams = beams_of(seen.scan, mount, params.laser_min_range_m, params.laser_max_range_m)
        if not params.upstream:
            if beams is None:
                return None
            beams = levelled(beams, at.quaternion)
        if seen.laser not in self._lasers:  # whose mount stays that of its first scan
            place = (float(mount.x_m), float(mount.y_m))
            self._lasers[seen.laser] = Laser(params, self._grid, self._distances_m, place)
        laser = self._lasers[seen.laser]
        odometry = Pose2D(at.x_m, at.y_m, tilted_yaw(at.quaternion))
        if beams is not None:
            self._leave_out_peers(beams, seen)
        update: Optional[Update] = Update(shows_cloud=True)
        if not self.search.is_on:
            update = self._filter(laser, beams, odometry, at)
        if beams is None or update is None or not self._is_judged:
            return update
        found = self._judge(laser.ends(beams), odometry, at)
        return update if found is None else replace(update, estimate=found)

    def _filter(
        self, laser: Laser, beams: Optional[Beams], odometry: Pose2D, odom_from_base: Pose3D
    ) -> Optional[Update]:
        """Move, weigh and resample the particles, if that is due."""
        begins, particles = not self._has_begun, self.particles
        if begins:
            self._odometry, self._has_begun, self.update_count = odometry, True, 0
        if begins or self._is_update_due(odometry):
            for one in self._lasers.values():
                one.is_due = True
        if not laser.is_due:
            return Update()
        if not begins:
            self._move(odometry)
        if beams is None:  # upstream has moved the particles, and will move them again
            return None
        laser.is_due = False
        factors = laser.factors(particles.poses, particles.is_converged, beams)
        if factors is not None:
            particles.weigh(factors)
        self._odometry = odometry
        self.update_count += 1
        is_resampled = self.update_count % max(self.params.resample_interval, 1) == 0
        if is_resampled:
            particles.resample()
        estimate = self._estimate(odom_from_base) if is_resampled or begins else None
        shows_cloud = not self.is_update_requested
        return Update(not begins, factors is not None, is_resampled, estimate, shows_cloud)

    @property
    def _is_judged(self) -> bool:
        return self.params.lost_below > 0.0 and not self.params.upstream

    def _judge(
        self, points: Floats, odometry: Pose2D, odom_from_base: Pose3D
    ) -> Optional[PoseEstimate]:
        """Compare the ends of beams with the map; return the place if a search has found it.

        While a search goes on, the particles wait at the last estimate, which may be right.
        """
        search = self.search
        if not len(points):
            self.fit = None
            return None
        if self._has_begun and self.map_from_odom is not None:
            here = self.map_from_odom.compose(odom_from_base).to_2d()
            self.fit = search.fit(here, points)
            if self.fit >= self.params.lost_below or self._is_spread:
                search.is_on, self._misfits = False, 0
            else:
                self._misfits += 1
            if self._misfits > _PATIENCE and not search.is_on:
                search.begin()
        if not search.is_on:
            return None
        place = search.add_scan(points, odometry)
        if place is None or search.fit(place, points) < self.params.lost_below:
            return None
        self._spread(PoseEstimate(place, _FOUND))
        return self._estimate(odom_from_base)

    def _is_update_due(self, odometry: Pose2D) -> bool:
        """Tell whether the robot has moved enough, or an update was requested."""
        before, params = self._odometry, self.params
        # A robot that is lost hovers: without motion its scans have to count all the same.
        is_requested, self.is_update_requested = self.is_update_requested or self.is_lost, False
        return (
            is_requested
            or abs(odometry.x_m - before.x_m) > params.update_min_d_m
            or abs(odometry.y_m - before.y_m) > params.update_min_d_m
            or abs(angle_difference(odometry.yaw_rad, before.yaw_rad)) > params.update_min_a_rad
        )

    def _move(self, odometry: Pose2D) -> None:
        before, particles = self._odometry, self.particles
        turn_rad = float(angle_difference(odometry.yaw_rad, before.yaw_rad))
        delta = (odometry.x_m - before.x_m, odometry.y_m - before.y_m, turn_rad)
        old_yaw_rad = odometry.yaw_rad - turn_rad
        particles.poses = moved(self.params, particles.poses, old_yaw_rad, delta, self._random)

    def _leave_out_peers(self, beams: Beams, seen: Observation) -> None:
        """Take the ranges of beams that end on peers out; the latest transform says where."""
        if self.map_from_odom is None or not len(seen.peers):
            return
        base = self.map_from_odom.compose(seen.odom_from_base).to_2d()
        mount = seen.base_from_laser.x_m, seen.base_from_laser.y_m
        with np.errstate(over="ignore", invalid="ignore"):  # of ranges without a return
            ends = base.transform_points(beams.ends(mount))
            away_m = np.linalg.norm(ends[:, None] - seen.peers, axis=2).min(axis=1)
        beams.ranges_m[away_m < self.params.peer_radius_m] = np.nan

    def _estimate(self, odom_from_base: Pose3D) -> Optional[PoseEstimate]:
        """Return the mean of the heaviest cluster, and note the transform that follows."""
        statistics = self.particles.statistics
        best = statistics.best
        if best < 0:
            return None
        pose = Pose2D(*statistics.means[best].tolist())
        self.estimate = PoseEstimate(pose, statistics.covariance)
        if not self.params.upstream:  # which puts a quadcopter, and its LIDAR, on the floor
            odom_from_base = odom_from_base.to_2d().to_3d()
        self.map_from_odom = pose.to_3d().compose(odom_from_base.inverse())
        return self.estimate
