"""The navigator's arrays as standard messages, and goals back from them."""

from __future__ import annotations

import math

import numpy as np
import rospy
from geometry_msgs.msg import Point32, PolygonStamped, Pose, PoseStamped
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid, Path
from sensor_msgs.msg import PointCloud2, PointField

from quad_nav.costmap.occupancy import occupancy
from quad_nav.errors import InvalidGoal
from quad_nav.geometry import Pose2D, Pose3D, quaternion_from_yaw
from quad_nav.grid import GridSpec
from quad_nav.plan.navfn import NOT_REACHED
from quad_nav.ros.common.convert import pose_from_message, pose_message

INVALID_QUATERNION = "Aborting on goal because it was sent with an invalid quaternion"


def goal_from_message(message: Pose) -> Pose3D:
    """A message's pose with its quaternion normalised.

    Raises:
        InvalidGoal: not finite, or not a turn about z: with the original's sentence
            for quaternions, and ours for positions.
    """
    pose = pose_from_message(message)
    if not np.isfinite(pose.translation).all():
        raise InvalidGoal("Aborting on goal because its position is not finite")
    length = math.sqrt(sum(part**2 for part in pose.quaternion))
    if not math.isfinite(length) or length < 1e-3:
        raise InvalidGoal(INVALID_QUATERNION)
    x, y, z, w = pose.quaternion
    upright = Pose3D(pose.x_m, pose.y_m, pose.z_m, (x / length, y / length, z / length, w / length))
    if abs(upright.rotation[2, 2] - 1.0) > 1e-3:
        raise InvalidGoal(INVALID_QUATERNION)
    return upright


def planar_pose(pose: Pose2D, z_m: float = 0.0) -> Pose3D:
    return Pose3D(pose.x_m, pose.y_m, z_m, quaternion_from_yaw(pose.yaw_rad))


def pose_stamped(pose: Pose3D, frame: str, stamp: rospy.Time) -> PoseStamped:
    message = PoseStamped(pose=pose_message(pose))
    message.header.frame_id, message.header.stamp = frame, stamp
    return message


def path_message(plan: np.ndarray, frame: str, stamp: rospy.Time) -> Path:
    """A plan float64[n, 3] (x, y, yaw) as a path; every pose carries the stamp."""
    path = Path()
    path.header.frame_id, path.header.stamp = frame, stamp
    path.poses = [pose_stamped(planar_pose(Pose2D(*row)), frame, stamp) for row in plan.tolist()]
    return path


def polygon_message(points: np.ndarray, frame: str, stamp: rospy.Time) -> PolygonStamped:
    """A footprint float64[n, 2] already in ``frame``."""
    message = PolygonStamped()
    message.header.frame_id, message.header.stamp = frame, stamp
    message.polygon.points = [Point32(x, y, 0.0) for x, y in points.tolist()]
    return message


def grid_message(spec: GridSpec, costs: np.ndarray, frame: str, stamp: rospy.Time) -> OccupancyGrid:
    """A costmap's master grid uint8[H, W] in occupancies."""
    return _occupancy_grid(spec, occupancy(costs), frame, stamp)


def potential_message(
    spec: GridSpec, potential: np.ndarray, scale: int, frame: str, stamp: rospy.Time
) -> OccupancyGrid:
    """A planner's potential float32[H, W], from 0 to ``scale``; -1 where it did not come."""
    reached = potential < NOT_REACHED
    highest = potential[reached].max(initial=0.0)
    values = np.full(potential.shape, -1, dtype=np.int8)
    if highest > 0.0:
        values[reached] = potential[reached] * (scale / highest)
    return _occupancy_grid(spec, values, frame, stamp)


def _occupancy_grid(
    spec: GridSpec, values: np.ndarray, frame: str, stamp: rospy.Time
) -> OccupancyGrid:
    message = OccupancyGrid()
    message.header.frame_id, message.header.stamp = frame, stamp
    message.info.resolution = spec.resolution_m
    message.info.width, message.info.height = spec.size_x, spec.size_y
    message.info.origin.position.x = spec.origin_x_m
    message.info.origin.position.y = spec.origin_y_m
    message.info.origin.orientation.w = 1.0
    message.data = values.ravel().tolist()
    return message


def update_message(
    costs: np.ndarray, x0: int, y0: int, frame: str, stamp: rospy.Time
) -> OccupancyGridUpdate:
    """A window uint8[h, w] of a costmap whose lower left cell is (x0, y0)."""
    message = OccupancyGridUpdate(x=x0, y=y0, width=costs.shape[1], height=costs.shape[0])
    message.header.frame_id, message.header.stamp = frame, stamp
    message.data = occupancy(costs).ravel().tolist()
    return message


CLOUD_FIELDS = ("x", "y", "z", "path_cost", "goal_cost", "occ_cost", "total_cost")


def cost_cloud_message(
    points: np.ndarray, cells: int, frame: str, stamp: rospy.Time
) -> PointCloud2:
    """Scored cells float32[n, 7] in the order of ``CLOUD_FIELDS``.

    As the original's, the cloud has one point for each of the window's ``cells``, the
    scored ones first. The points without a score are nan, which viewers leave out.
    """
    data = np.full((cells, len(CLOUD_FIELDS)), np.nan, dtype=np.float32)
    data[: len(points)] = points
    message = PointCloud2()
    message.header.frame_id, message.header.stamp = frame, stamp
    message.height, message.width = 1, len(data)
    message.fields = [
        PointField(name, 4 * k, PointField.FLOAT32, 1) for k, name in enumerate(CLOUD_FIELDS)
    ]
    message.point_step = 4 * len(CLOUD_FIELDS)
    message.row_step = message.point_step * len(data)
    message.is_dense = False
    message.data = data.tobytes()
    return message
