"""Localization in offline flights, and how far it is from the truth, which a simulation has."""

from __future__ import annotations

from typing import Any, Dict, List, Optional

import numpy as np
from numpy.typing import NDArray

from quad_localization.localizer import Amcl, Observation, PoseEstimate
from quad_localization.map_files import CELL_M
from quad_localization.occupancy_map import OccupancyMap
from quad_localization.parameters import read_params
from quad_localization.slam import Slam
from quad_nav.errors import InputError
from quad_nav.files.document import read_yaml
from quad_nav.files.shipped import shipped
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.mission.localization_errors import error_figures, pose_errors
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.scenario.scene_map import scene_map
from quad_nav.sim.localization import Estimate, Localization, believed_states
from quad_nav.sim.scene import Scene


class SlamLocalization(Localization):
    """``Slam`` for the loop. A map that grows cannot be searched as a whole."""

    name = "slam"

    def __init__(self, _scene: Scene, robots: int) -> None:
        """Start without a map; the odometry frames begin at ``map``."""
        self.slam = Slam({robot: Pose2D(0.0, 0.0) for robot in range(robots)})

    def add_scan(
        self, robot: int, scan: Scan, odom_from_base: Pose3D, odom_from_lidar: Pose3D
    ) -> None:
        """Take a scan."""
        self.slam.add_scan(robot, scan, odom_from_base.to_2d(), odom_from_lidar)

    def map_from_odom(self, robot: int) -> Pose2D:
        """Return where a robot's odometry frame is."""
        place = self.slam.poses.get(robot)
        return self.slam.frames[robot] if place is None else place.map_from_odom

    def is_lost(self, robot: int) -> bool:
        """Return whether a robot does not know its place."""
        return robot not in self.slam.poses or self.slam.poses[robot].is_lost

    def estimate(self, robot: int) -> Optional[Estimate]:
        """Return where a robot believed itself at its last scan."""
        place = self.slam.poses.get(robot)
        if place is None or place.odom_from_base is None:
            return None
        return place.map_from_odom.compose(place.odom_from_base), place.covariance

    def set_pose(self, robot: int, pose: Pose2D, covariance: NDArray[np.float64]) -> bool:
        """Tell a robot roughly where it is; the covariance is that of the start."""
        self.slam.set_pose(robot, pose)
        return True


class AmclLocalization(Localization):
    """``Amcl`` of each robot for the loop, on the map of the scene.

    Attributes:
        amcls: By the robots' numbers.
    """

    name = "amcl"

    def __init__(self, scene: Scene, robots: int) -> None:
        """Begin at the scene's start poses, from which robots may be displaced.

        Raises:
            InputError: The shipped parameters have faults.
        """
        path = shipped("localization", "amcl.yaml")
        params, faults = read_params(read_yaml(path))
        if faults:
            raise InputError([f"{path}: {fault}" for fault in faults])
        drawn = scene_map(scene, CELL_M)
        spec = drawn.spec
        grid = OccupancyMap.from_occupancy(
            drawn.occupancy, spec.resolution_m, spec.origin_x_m, spec.origin_y_m
        )
        spread = np.diag([params.initial_cov_xx, params.initial_cov_yy, params.initial_cov_aa])
        self.amcls = [Amcl(params, seed=robot) for robot in range(robots)]
        for amcl, start in zip(self.amcls, scene.starts):
            amcl.set_map(grid, PoseEstimate(start, spread))
        self._odom_from_base: Dict[int, Pose3D] = {}

    def add_scan(
        self, robot: int, scan: Scan, odom_from_base: Pose3D, odom_from_lidar: Pose3D
    ) -> None:
        """Take a scan; beams that end on peers are left out."""
        self._odom_from_base[robot] = odom_from_base
        places = [self._place(peer) for peer in self._odom_from_base if peer != robot]
        base_from_lidar = odom_from_base.inverse().compose(odom_from_lidar)
        peers = np.array([(one.x_m, one.y_m) for one in places]).reshape(-1, 2)
        self.amcls[robot].update(Observation("lidar", scan, base_from_lidar, odom_from_base, peers))

    def _place(self, robot: int) -> Pose2D:
        return self.map_from_odom(robot).compose(self._odom_from_base[robot].to_2d())

    def map_from_odom(self, robot: int) -> Pose2D:
        """Return where a robot's odometry frame is."""
        pose = self.amcls[robot].map_from_odom
        return Pose2D(0.0, 0.0) if pose is None else pose.to_2d()

    def is_lost(self, robot: int) -> bool:
        """Return whether a robot does not know its place, so that it has to hover."""
        return self.amcls[robot].estimate is None or self.amcls[robot].is_lost

    def estimate(self, robot: int) -> Optional[Estimate]:
        """Return where a robot believed itself at its last scan."""
        last = self.amcls[robot].estimate
        return None if last is None else (self._place(robot), last.covariance)

    def particles(self, robot: int) -> Optional[NDArray[np.float64]]:
        """Return the particles, or the places that a search considers."""
        return self.amcls[robot].cloud

    def set_pose(self, robot: int, pose: Pose2D, covariance: NDArray[np.float64]) -> bool:
        """Tell a robot where it is."""
        self.amcls[robot].set_pose(PoseEstimate(pose, covariance))
        return True

    def set_uniform(self, robot: int) -> bool:
        """Let a robot search the whole map."""
        return self.amcls[robot].set_uniform()


MAKERS = {"amcl": AmclLocalization, "slam": SlamLocalization}
"""By the names of the option ``--localization``."""


class LocalizationErrors(FlightObserver):
    """Differences of all robots' believed poses to the true ones, at every odometry.

    Attributes:
        errors: float64[n, 2] of the robots at each, in m and rad.
    """

    needs_single_process = True

    def __init__(self) -> None:
        self.errors: List[NDArray[np.float64]] = []

    def on_start(self, flight: Flight) -> None:
        """Note the errors of the start."""
        self.on_move(flight)

    def on_move(self, flight: Flight) -> None:
        """Note the errors of now."""
        believed = believed_states(flight.states, flight.loop.group.localization)
        self.errors.append(pose_errors(believed.poses, flight.states.poses))

    @property
    def facts(self) -> Dict[str, Any]:
        """The figures for the summary."""
        return {"localization": self.figures()}

    def figures(self) -> Dict[str, Any]:
        """Return the figures of all errors."""
        return error_figures(self.errors or [np.zeros((1, 2))])
