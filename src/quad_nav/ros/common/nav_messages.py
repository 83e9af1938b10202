"""Convert the navigator's arrays to standard messages, and goals from messages."""

from __future__ import annotations

import math

import numpy as np
import rospy
from geometry_msgs.msg import Point32, PolygonStamped, Pose, PoseStamped
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid, Path
from sensor_msgs.msg import PointCloud2, PointField

from quad_nav.costmap.cost_grid import occupancy
from quad_nav.costmap.static import StaticMap
from quad_nav.errors import InvalidGoal
from quad_nav.geometry import Pose2D, Pose3D, quaternion_from_yaw
from quad_nav.grid import GridSpec
from quad_nav.plan.wavefront import NOT_REACHED
from quad_nav.ros.common.conversions import pose_from_message, pose_message
from quad_nav.topics.validation import MAX_MAGNITUDE

INVALID_QUATERNION = "Aborting on goal because it was sent with an invalid quaternion"


def goal_from_message(message: Pose) -> Pose3D:
    """Return the pose of a goal with its quaternion normalised.

    Raises:
        InvalidGoal: If the position is not finite or too large, or the rotation is not about z.
            The text for quaternions is that of C++ move_base.
    """
    pose = pose_from_message(message)
    if not (np.abs(pose.translation) <= MAX_MAGNITUDE).all():
        raise InvalidGoal(
            f"Aborting on goal because its position is not finite or beyond {MAX_MAGNITUDE:g} m"
        )
    length = math.sqrt(sum(part * part for part in pose.quaternion))
    if not math.isfinite(length) or length < 1e-3:
        raise InvalidGoal(INVALID_QUATERNION)
    x, y, z, w = pose.quaternion
    upright = Pose3D(pose.x_m, pose.y_m, pose.z_m, (x / length, y / length, z / length, w / length))
    if abs(upright.rotation[2, 2] - 1.0) > 1e-3:
        raise InvalidGoal(INVALID_QUATERNION)
    return upright


def planar_pose(pose: Pose2D, z_m: float = 0.0) -> Pose3D:
    """Return a planar pose at a height."""
    return Pose3D(pose.x_m, pose.y_m, z_m, quaternion_from_yaw(pose.yaw_rad))


def pose_stamped(pose: Pose3D, frame: str, stamp: rospy.Time) -> PoseStamped:
    """Convert a pose with its frame and stamp."""
    message = PoseStamped(pose=pose_message(pose))
    message.header.frame_id, message.header.stamp = frame, stamp
    return message


def path_message(plan: np.ndarray, frame: str, stamp: rospy.Time) -> Path:
    """Convert a plan to a path; every pose has the same stamp.

    Args:
        plan: float64, shape (n, 3): x and y in m, yaw in rad, in `frame`.
        frame: Frame of the plan.
        stamp: Time of the plan.
    """
    path = Path()
    path.header.frame_id, path.header.stamp = frame, stamp
    path.poses = [pose_stamped(planar_pose(Pose2D(*row)), frame, stamp) for row in plan.tolist()]
    return path


def polygon_message(points: np.ndarray, frame: str, stamp: rospy.Time) -> PolygonStamped:
    """Convert a footprint to a polygon.

    Args:
        points: float64, shape (n, 2), x and y in m, in `frame`.
        frame: Frame of the points.
        stamp: Time of the robot's pose.
    """
    message = PolygonStamped()
    message.header.frame_id, message.header.stamp = frame, stamp
    message.polygon.points = [Point32(x, y, 0.0) for x, y in points.tolist()]
    return message


def grid_message(spec: GridSpec, costs: np.ndarray, frame: str, stamp: rospy.Time) -> OccupancyGrid:
    """Convert the master grid of a costmap to occupancies from 0 to 100 and -1.

    Args:
        spec: Size and place of the grid.
        costs: uint8, shape (height, width).
        frame: Global frame of the costmap.
        stamp: Time of the grid.
    """
    return _occupancy_grid(spec, occupancy(costs), frame, stamp)


def map_message(static_map: StaticMap, stamp: rospy.Time) -> OccupancyGrid:
    """Convert a map."""
    return _occupancy_grid(static_map.spec, static_map.occupancy, static_map.frame, stamp)


def potential_message(
    spec: GridSpec, potential: np.ndarray, scale: int, frame: str, stamp: rospy.Time
) -> OccupancyGrid:
    """Convert the potential of a global planner; cells that it did not reach become -1.

    Args:
        spec: Size and place of the grid.
        potential: float32, shape (height, width).
        scale: Value of the greatest potential in the message.
        frame: Global frame of the costmap.
        stamp: Time of the plan.
    """
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
    """Convert a window of a costmap.

    Args:
        costs: uint8, shape (height, width) of the window.
        x0: First column of the window in the costmap.
        y0: First row of the window in the costmap.
        frame: Global frame of the costmap.
        stamp: Time of the costmap.
    """
    message = OccupancyGridUpdate(x=x0, y=y0, width=costs.shape[1], height=costs.shape[0])
    message.header.frame_id, message.header.stamp = frame, stamp
    message.data = occupancy(costs).ravel().tolist()
    return message


CLOUD_FIELDS = ("x", "y", "z", "path_cost", "goal_cost", "occ_cost", "total_cost")


def cost_cloud_message(
    points: np.ndarray, cells: int, frame: str, stamp: rospy.Time
) -> PointCloud2:
    """Convert the scored cells of a local planner.

    As in C++ move_base, the cloud has one point for each cell of the window, the scored ones
    first. Points without a score are NaN; viewers skip them.

    Args:
        points: float32, shape (n, 7), columns as in `CLOUD_FIELDS`.
        cells: Number of cells of the window.
        frame: Global frame of the local costmap.
        stamp: Time of the control cycle.
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
