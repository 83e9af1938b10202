"""Make the items of a page from scenes, poses, plans, scans and costmaps.

All sources use these functions, so a page shows the same of running nodes, of an offline flight
and of a recording. ``rows`` has the items that are tables, ``cells`` the Voronoi cells.
"""

from __future__ import annotations

import collections
import math
from typing import Any, Deque, Dict, Iterable, List, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D, Pose3D, Scan, Twist2D
from quad_nav.grid import GridSpec
from quad_nav.sim.colours import robot_rgba
from quad_nav.sim.obstacles import Obstacle
from quad_nav.sim.scene import Scene
from quad_web.view.state import Item

Floats = NDArray[np.float64]

TRAIL_POINTS = 300
TRAIL_SPACING_M = 0.1
_STANDS_M, _JUMP_M = 1e-3, 1.0  # of a person, from one item to the next
_MAP = Pose2D(0.0, 0.0)


def scene_item(scene: Scene) -> Item:
    """Return the item ``scene``: arena, walls and obstacles.

    Those that move are in ``moving``, in the order of ``Scene.moving_shapes``. Where they are is in
    the item ``obstacles``; people among them have ``person``.
    """
    moving = [_solid(shape, scene.altitude_m) for shape in scene.moving_shapes]
    for number, solid in enumerate(moving):
        solid["person"] = number >= len(scene.moving)
    return Item(
        "scene",
        {
            "size_m": [scene.size_x_m, scene.size_y_m],
            "origin_m": [scene.origin_x_m, scene.origin_y_m],
            "altitude_m": scene.altitude_m,
            "walls": [_solid(wall, scene.altitude_m) for wall in scene.wall_boxes()],
            "solids": [_solid(solid, scene.altitude_m) for solid in scene.obstacles],
            "moving": moving,
        },
    )


class ObstacleItems:
    """Makes the item ``obstacles`` when obstacles have moved."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Begin anew: the item was removed."""
        self._poses: Floats = np.zeros((0, 3))
        self._headings: Floats = np.zeros(0)

    def items(self, scene: Scene, poses: Any) -> List[Item]:
        """Return the item if it differs from the last one.

        Args:
            scene: The scene.
            poses: float[m, 3], x, y and yaw in ``map`` of ``Scene.moving_shapes``; NaN where it is
                unknown. People have no yaw: they get the direction in which they walk.
        """
        poses = np.array(poses, np.float64).reshape(-1, 3)
        if np.array_equal(poses, self._poses, equal_nan=True):
            return []
        headings = np.full(len(poses), np.nan)
        if len(poses) == len(self._poses):
            dx_m, dy_m = (poses - self._poses)[:, :2].T
            steps_m = np.hypot(dx_m, dy_m)
            walks = (steps_m > _STANDS_M) & (steps_m < _JUMP_M)
            headings = np.where(steps_m <= _STANDS_M, self._headings, headings)
            headings[walks] = np.arctan2(dy_m, dx_m)[walks]
        self._poses, self._headings = poses, headings
        shown = poses.astype(np.float32)
        people = scene.walker_rows
        shown[people, 2] = headings[people]
        return [Item("obstacles", None, {"poses": shown})]


def moving_solids(scene: Scene, poses: Any) -> List[Obstacle]:
    """Return the moving obstacles at poses float[m, 3]; those with NaN are left out."""
    known: Any = np.isfinite(np.asarray(poses, np.float64)).all(axis=1)
    return [shape.placed(pose) for shape, pose, at in zip(scene.moving_shapes, poses, known) if at]


def robots_item(
    names: Sequence[str],
    radius_m: float,
) -> Item:
    """Return the item ``robots``: names of robot 0, 1, ..., and the radius of their hulls."""
    return Item(
        "robots",
        {
            "names": list(names),
            "colours": [colour_of(robot) for robot in range(len(names))],
            "radius_m": radius_m,
        },
    )


def colour_of(robot: int) -> str:
    """Return a robot's colour as the page has it, as ``#2078dc``."""
    red, green, blue, _ = robot_rgba(robot)
    return f"#{round(255 * red):02x}{round(255 * green):02x}{round(255 * blue):02x}"


def body_row(map_from_base: Pose3D, twist: Twist2D) -> List[float]:
    """Return one row of ``poses_item`` from a pose and a velocity in ``base_link``."""
    vx_mps, vy_mps = Pose2D(0.0, 0.0, map_from_base.yaw_rad).rotate(twist.vx_mps, twist.vy_mps)
    x_m, y_m, z_m = map_from_base.x_m, map_from_base.y_m, map_from_base.z_m
    velocities = (vx_mps, vy_mps, 0.0, 0.0, 0.0, twist.vyaw_radps)
    return [x_m, y_m, z_m, *map_from_base.quaternion, *velocities]


UNKNOWN_BODY = [math.nan] * 13
"""Row of ``poses_item`` for a robot that has not been heard of."""


def poses_item(stamp_s: float, wall_s: float, bodies: Any) -> Item:
    """Return the item ``poses``.

    Args:
        stamp_s: Time of the poses on the flight's clock.
        wall_s: Wall time, ``time.time()``, at which the poses held.
        bodies: float64[n, 13], in ``map``: x, y, z, quaternion (x, y, z, w), velocity (x, y, z),
            angular velocity (x, y, z). The simulation's ``BodyState.rows`` are such.
    """
    x, y, z, qx, qy, qz, qw, vx, vy, _, _, _, yaw_rate = np.asarray(bodies, np.float64).T
    roll = np.arctan2(2.0 * (qw * qx + qy * qz), 1.0 - 2.0 * (qx * qx + qy * qy))
    pitch = np.arcsin(np.clip(2.0 * (qw * qy - qz * qx), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
    pose = np.column_stack((x, y, z, roll, pitch, yaw, vx, vy, yaw_rate)).astype(np.float32)
    return Item("poses", {"stamp_s": stamp_s, "wall_s": wall_s}, {"pose": pose})


def line_item(layer: str, robot: int, points: Any) -> Item:
    """Return a plan, trail or cell of a robot: points float64[k, 2 or more] in ``map``."""
    plane = np.zeros((len(points), 2), np.float32)
    if len(points):
        plane[:] = np.asarray(points)[:, :2]
    return Item(f"{layer}/{robot}", None, {"points": plane})


def track_item(robot: int, rows: Any, map_from_frame: Pose2D = _MAP) -> Item:
    """Return the tracks of a robot, float64[k, 6] as of ``tracked_obstacles.track_rows``."""
    placed = np.array(rows, np.float64)
    placed[:, :2] = map_from_frame.transform_points(placed[:, :2])
    placed[:, 2:4] = Pose2D(0.0, 0.0, map_from_frame.yaw_rad).transform_points(placed[:, 2:4])
    return Item(f"track/{robot}", None, {"rows": placed.astype(np.float32)})


def scan_item(robot: int, scan: Scan, map_from_lidar: Pose3D) -> Item:
    """Return the hit points of a scan in ``map``; beams without a return are left out."""
    hits = np.isfinite(scan.ranges_m)
    ranges_m = scan.ranges_m[hits].astype(np.float64)
    angles = scan.angle_min_rad + np.nonzero(hits)[0] * scan.angle_increment_rad
    points = np.column_stack(
        (ranges_m * np.cos(angles), ranges_m * np.sin(angles), np.zeros(len(angles)))
    )
    points = map_from_lidar.transform_points(points).astype(np.float32)
    return Item(f"scan/{robot}", {"stamp_s": scan.stamp_s}, {"points": points})


def costmap_item(
    layer: str,
    robot: int,
    spec: GridSpec,
    costs: NDArray[np.int8],
    map_from_frame: Pose2D = _MAP,
) -> Item:
    """Return a costmap.

    Args:
        layer: "global_costmap" or "local_costmap".
        robot: Number of the robot.
        spec: The grid, in the costmap's frame.
        costs: int8[rows, columns] as of ``nav_msgs/OccupancyGrid``: -1 unknown, 0 free, 99
            inscribed, 100 lethal. ``costmap.cost_grid.occupancy`` makes them from costs. They are
            not copied; the caller does not change them afterwards.
        map_from_frame: The costmap's frame in ``map``.
    """
    x_m, y_m = map_from_frame.transform(spec.origin_x_m, spec.origin_y_m)
    data = {
        "x": x_m,
        "y": y_m,
        "yaw": map_from_frame.yaw_rad,
        "resolution_m": spec.resolution_m,
    }
    return Item(f"{layer}/{robot}", data, {"costs": costs})


class Trails:
    """The last positions of each robot, ``TRAIL_SPACING_M`` apart, at most ``TRAIL_POINTS``."""

    def __init__(self) -> None:
        self._points: Dict[int, Deque[Tuple[float, float]]] = {}
        self._changed: Dict[int, bool] = {}

    def add(self, robot: int, x_m: float, y_m: float) -> None:
        """Add a position in ``map`` unless it is near the last one, or unknown (NaN)."""
        points = self._points.setdefault(robot, collections.deque(maxlen=TRAIL_POINTS))
        far = not points or math.dist(points[-1], (x_m, y_m)) >= TRAIL_SPACING_M
        if far and math.isfinite(x_m) and math.isfinite(y_m):
            points.append((x_m, y_m))
            self._changed[robot] = True

    def clear(self) -> None:
        """Forget all positions, as after a reset or a jump in time."""
        self._points.clear()
        self._changed.clear()

    def items(self, robots: Iterable[int]) -> List[Item]:
        """Return the trails of these robots that have grown since they were last returned."""
        return [
            line_item("trail", robot, self._points[robot])
            for robot in robots
            if self._changed.pop(robot, False)
        ]


def _solid(solid: Obstacle, altitude_m: float) -> Dict[str, Any]:
    return {
        "shape": solid.shape,
        "outline": np.round(solid.corners_m(), 4).tolist(),  # to 0.1 mm, in its own frame
        "x": solid.x_m,
        "y": solid.y_m,
        "yaw": solid.yaw_rad,
        "bottom": solid.bottom_m,
        "height": solid.height_m,
        "reach": solid.reach_m,
        "name": solid.name,
        "crosses": solid.crosses(altitude_m),
    }
