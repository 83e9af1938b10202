"""Compile the kernels before anything flies.

numba compiles a kernel at its first call, which takes seconds, and caches the result beside the
sources, or in the user's cache if that folder is not writable. ``python -m
quad_nav.scenario.warm_up`` fills the cache at installation. A node warms up its own configuration
before it accepts goals, which is quick with a full cache.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Dict, Iterable, List, Tuple

import numpy as np

from quad_nav import config
from quad_nav.config.robot_tree import RobotSource, robot_tree
from quad_nav.control.dwa_planner import DwaPlanner
from quad_nav.control.trajectory_planner import TrajectoryPlanner
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.scan_filter import ScanFilters, ScanSituation
from quad_nav.costmap.voxel import VoxelLayer
from quad_nav.errors import InputError
from quad_nav.files.shipped import config_names
from quad_nav.geometry import Pose2D, Pose3D, Scan, Twist2D
from quad_nav.navigator.navigator import Navigator
from quad_nav.navigator.tick import RobotPoses
from quad_nav.peers.peer import HIGHEST_PRIORITY, Intention, Peer
from quad_nav.scenario.navigator_host import NavigatorHost

_AHEAD_M = 1.0
_LIDAR: Dict[str, Any] = {
    "data_type": "LaserScan",
    "marking": True,
    "clearing": True,
    "inf_is_valid": True,
    "max_obstacle_height": 2.0,
}
_COSTMAP: Dict[str, Any] = {"observation_sources": "scan", "scan": _LIDAR}
_VOXELS: Dict[str, Any] = {**_COSTMAP, "map_type": "voxel"}
# Together they call every planner, both kinds of search and path, and both obstacle layers.
_SEARCH: Dict[str, Any] = {"base_global_planner": "global_planner/GlobalPlanner"}
_MISSIONS: Tuple[Tuple[Dict[str, Any], Dict[str, Any]], ...] = (  # costmap, the node's own
    (_COSTMAP, {}),
    (_COSTMAP, {"base_local_planner": "dwa_local_planner/DWAPlannerROS", **_SEARCH}),
    (_VOXELS, {"GlobalPlanner": {"use_dijkstra": False, "use_grid_path": True}, **_SEARCH}),
    (_COSTMAP, {"base_global_planner": "carrot_planner/CarrotPlanner"}),
)


def warm_up(configuration: config.Configuration) -> None:
    """Fly a second of a small mission with a navigator of this configuration."""
    host = NavigatorHost(configuration)
    navigator = host.navigator
    spec = navigator.global_costmap.spec
    here = Pose2D(
        spec.origin_x_m + 0.5 * spec.size_x * spec.resolution_m,
        spec.origin_y_m + 0.5 * spec.size_y * spec.resolution_m,
    )
    _add_scans(navigator, here)
    _filter_scans(host.scan_filters, here)
    navigator.set_goal(Pose2D(here.x_m + _AHEAD_M, here.y_m), 0.0)
    for now_s in (0.0, 0.5):
        host.tick(now_s, RobotPoses(here, here), Twist2D(vx_mps=0.1), ())
    peers = [_oncoming_peer(here, 1.0)]
    host.tick(1.0, RobotPoses(here, here), Twist2D(vx_mps=0.1), peers)
    _add_scans(navigator, here)  # again, with the points of a peer to remove
    if isinstance(navigator.controller, TrajectoryPlanner) and navigator.controller.rollout:
        navigator.controller.rollout.score(np.zeros((1, 3)))  # of strafing, the last resort
    if isinstance(navigator.controller, DwaPlanner):
        navigator.controller.pop_trajectories()
    for layer in navigator.local_costmap.layers.values():
        if isinstance(layer, VoxelLayer):
            list(layer.clearing_ends())


def distinct(configurations: Iterable[config.Configuration]) -> List[config.Configuration]:
    """Return one configuration for each choice of plugins: the others use the same kernels."""
    kinds: Dict[Tuple[object, ...], config.Configuration] = {}
    for one in configurations:
        layers = tuple(
            type(layer)
            for costmap in (one.global_costmap, one.local_costmap)
            for _, layer in costmap.layers
        )
        kinds.setdefault((type(one.global_planner), type(one.local_planner), layers), one)
    return list(kinds.values())


def _filter_scans(filters: ScanFilters, here: Pose2D) -> None:
    """Show the filters an obstacle that crosses free space, so that they call every kernel."""
    lidar = Pose3D(here.x_m, here.y_m, 1.0)
    for step in range(12):
        now_s, heights_m = 0.1 * step - 0.2, (-math.inf, math.inf)
        ranges = np.full(256, 6.0, np.float32)
        ranges[100 + 4 * step : 112 + 4 * step] = 3.0
        scan = Scan(now_s, -math.pi, 2 * math.pi / 256, 0.02, 60.0, ranges)
        situation = ScanSituation(now_s, "scan", lidar, True, 0.0, heights_m, np.empty((0, 3)))
        filters.filter(scan, situation)


def _oncoming_peer(here: Pose2D, now_s: float) -> Peer:
    """A peer with higher priority that the robot has to make room for."""
    path = np.array([[here.x_m + 2.0, here.y_m], [here.x_m, here.y_m]])
    intention = Intention(HIGHEST_PRIORITY + 1.0, path)
    return Peer("peer", here.x_m + 2.0, here.y_m, 0.0, 0.0, now_s, intention)


def _add_scans(navigator: Navigator, here: Pose2D) -> None:
    """Add a cloud, and a scan with an obstacle 2 m behind the robot, to every obstacle layer."""
    angles = np.linspace(-math.pi, math.pi, 64, endpoint=False)
    ranges = np.where(np.abs(angles) > 3.0, 2.0, np.inf).astype(np.float32)
    scan = Scan(0.0, -math.pi, 2 * math.pi / 64, 0.02, 60.0, ranges)
    lidar = Pose3D(here.x_m, here.y_m, 1.0)
    is_moving = np.zeros(len(ranges), np.bool_)  # beams that clear only, as on moving obstacles
    for costmap in (navigator.global_costmap, navigator.local_costmap):
        for layer in costmap.layers.values():
            if isinstance(layer, ObstacleLayer):
                for source in layer.params.sources:
                    cloud = np.zeros((1, 3), np.float32)
                    layer.add_cloud(source.name, cloud, lidar, 0.0, 0.0)
                    seen = layer.observe_scan(source.name, scan, lidar, None, is_moving)
                    layer.buffers[source.name].add(seen, 0.0)


def simulate() -> None:
    """Run steps and scans of one quadcopter and of two, whose rows make other array layouts.

    The last scenes have an obstacle and people that move. The simulator is imported here, because
    navigators do not need it.
    """
    from quad_nav.sim.map_file import rectangles_of
    from quad_nav.sim.motion import Motion, Walkers
    from quad_nav.sim.obstacles import Cylinder
    from quad_nav.sim.robot_state import RobotStates
    from quad_nav.sim.scene import MovingObstacle, Scene, Walls
    from quad_nav.sim.simulation import Simulation

    rectangles_of(np.ones((2, 2), np.bool_))
    starts = (Pose2D(5.0, 5.0), Pose2D(5.2, 5.0))  # so near that the engine moves both
    resting = Scene("warm-up", 10.0, 10.0, 1.0, Walls(), (), starts)
    cart = MovingObstacle(
        Cylinder("cart", 2.0, 2.0, 0.3, 2.0),
        Motion((0.0, 1.0), ((2.0, 2.0, 0.0), (3.0, 2.0, 0.0))),
    )
    moving = replace(resting, moving=(cart,), walkers=Walkers(2))
    reacting = replace(resting, walkers=Walkers(2, reacting=True))
    for scene, robots in ((resting, 1), (resting, 2), (moving, 2), (reacting, 2)):
        simulation = Simulation(scene, robots)
        simulation.step()
        simulation.scans(range(robots))
        assert RobotStates(simulation.body_state).poses.shape == (robots, 3)
        simulation.close()


def fly_missions() -> None:
    """Call every kernel that any configuration may call."""
    simulate()
    for costmap, node in _MISSIONS:
        rolling = {**costmap, "rolling_window": True, "width": 3.0, "height": 3.0}
        tree = {**node, "global_costmap": dict(costmap), "local_costmap": rolling}
        warm_up(config.load(tree))


def fly_shipped() -> None:
    """Warm up each shipped configuration, with the filters of the add-ons that are installed."""
    for name in config_names():
        try:
            configuration = config.load(robot_tree(RobotSource(name, 0)))
        except InputError:  # its add-on is not installed
            continue
        warm_up(configuration)


if __name__ == "__main__":
    fly_missions()
    fly_shipped()
