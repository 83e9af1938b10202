"""Peers in the costmaps: areas of cost around them, and no obstacles from their LIDAR points.

In the global costmap, places near a stationary peer and along the path of a peer of higher
priority cost more, so plans avoid them where there is room. So does the circle of a roundabout with
all to its left: plans keep right. In the local costmap, stationary
peers and the circle are obstacles. Obstacle layers ignore LIDAR points on known peers.
"""

from __future__ import annotations

import math
from typing import List

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import Square
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.peer_layer import PeerArea, PeerLayer
from quad_nav.geometry import Pose2D
from quad_nav.grid import LETHAL
from quad_nav.peers.peer_tracker import TOLERANCE_M, PeerTracker
from quad_nav.peers.right_of_way import HORIZON_S, TIME_TOLERANCE_S, places_reached, predict_peer
from quad_nav.peers.roundabout import Roundabout

_SAME_FRAME = Pose2D(0.0, 0.0, 0.0)
_LIDAR_TOLERANCE_M = 0.15  # points so far outside of a peer's circle still belong to it
_OUTSIDE_M = 0.05
_STATIONARY_COST, _PATH_COST = 120, 100
_PATH_TIMES_S = np.arange(0.0, HORIZON_S + TIME_TOLERANCE_S, 0.25)


class PeerCosts:
    """Writes the tracked peers to the layers of a robot's two costmaps."""

    def __init__(
        self,
        tracker: PeerTracker,
        roundabout: Roundabout,
        global_costmap: LayeredCostmap,
        local_costmap: LayeredCostmap,
    ) -> None:
        """Write to the peer layers and obstacle layers of both costmaps."""
        self._tracker, self._roundabout = tracker, roundabout
        self._global, self._local = global_costmap, local_costmap

    def update(self, pose: Pose2D, local_from_global: Pose2D, priority: float) -> None:
        """Update the layers; they take effect with the costmaps' next update."""
        peers = self._tracker.peers
        newcomers = [k for k, peer in enumerate(peers) if peer.name in self._tracker.newcomers]
        self._tracker.newcomers = []
        radius_m = self._tracker.radius_m + _LIDAR_TOLERANCE_M
        in_global = np.array([(peer.x_m, peer.y_m, radius_m) for peer in peers]).reshape(-1, 3)
        in_local = in_global
        if local_from_global != _SAME_FRAME:
            in_local = in_global.copy()
            in_local[:, :2] = local_from_global.transform_points(in_global[:, :2])
        costly = self._areas(in_global[:, :2], pose, priority)
        for costmap, circles, areas in (
            (self._global, in_global, costly),
            (self._local, in_local, self._obstacles(in_local[:, :2], pose, local_from_global)),
        ):
            for layer in costmap.layers.values():
                if isinstance(layer, PeerLayer):
                    layer.set_areas(areas)
                elif isinstance(layer, ObstacleLayer):
                    layer.excluded_circles = circles
                    for x_m, y_m, _ in circles[newcomers].tolist():  # marked until now
                        layer.free_square(Square(x_m, y_m, 2.0 * radius_m))

    def _areas(
        self, positions: NDArray[np.float64], pose: Pose2D, priority: float
    ) -> List[PeerArea]:
        """Return the areas of the global costmap: stationary peers, paths that go first, circles.

        Of a path only those places count that the robot can reach before the peer has passed them:
        so it plans to pass behind the peer. The peers are at positions float64[n, 2] in ``map``.
        """
        tracker = self._tracker
        radius_m = tracker.min_separation_m + TOLERANCE_M
        areas: List[PeerArea] = []
        for k, peer in enumerate(tracker.peers):
            if peer.name in tracker.stationary:
                areas.append(PeerArea(positions[k : k + 1], radius_m, _STATIONARY_COST))
            elif peer.intention.priority > priority and peer.name not in self._roundabout.members:
                path = predict_peer(peer, tracker.cruise_mps, _PATH_TIMES_S)
                at, speed_mps = (pose.x_m, pose.y_m), tracker.cruise_mps
                met = places_reached(path, _PATH_TIMES_S, at, radius_m, speed_mps, TIME_TOLERANCE_S)
                areas += [PeerArea(met, radius_m, _PATH_COST)] if len(met) else []
        if self._roundabout.centre is not None:
            barrier = self._roundabout.barrier(pose)
            areas.append(PeerArea(barrier, self._roundabout.radius_m, _PATH_COST))
        return areas

    def _obstacles(
        self, positions: NDArray[np.float64], pose: Pose2D, local_from_global: Pose2D
    ) -> List[PeerArea]:
        """Return the obstacles of the local costmap: stationary peers, and a circle.

        They keep the robot's centre off. No area contains the robot itself, because then no
        trajectory would be legal. The peers are at positions float64[n, 2] in the local costmap's
        frame.
        """
        tracker, here = self._tracker, (pose.x_m, pose.y_m)
        kept_off = [
            (positions[k], math.dist((peer.x_m, peer.y_m), here), 2.0 * tracker.safety_radius_m)
            for k, peer in enumerate(tracker.peers)
            if peer.name in tracker.stationary
        ]
        centre, circle_m = self._roundabout.centre, self._roundabout.radius_m
        if centre is not None:
            in_local = local_from_global.transform_points(centre[None, :])[0]
            kept_off.append((in_local, math.dist(centre, here), circle_m - TOLERANCE_M))
        obstacles = []
        for place, away_m, keep_m in kept_off:
            radius_m = min(keep_m, away_m - _OUTSIDE_M) - tracker.radius_m
            if radius_m > 0.0:
                obstacles.append(PeerArea(place[None, :], radius_m, LETHAL))
        return obstacles
