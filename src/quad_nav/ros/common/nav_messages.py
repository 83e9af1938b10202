"""Convert the navigator's arrays to standard messages, and goals from messages."""

from __future__ import annotations

import math
from typing import Sequence

import numpy as np
import rospy
from geometry_msgs.msg import (
    Point,
    Point32,
    Polygon,
    PolygonStamped,
    Pose,
    PoseStamped,
    Quaternion,
)
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import MapMetaData, OccupancyGrid, Path
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

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
    """
    pose = pose_from_message(message)
    if not (np.abs(pose.translation) <= MAX_MAGNITUDE).all():
        raise InvalidGoal(
            f"Aborting on goal because its position is not finite or beyond {MAX_MAGNITUDE:g} m"
        )
    return upright(pose)


def upright(pose: Pose3D) -> Pose3D:
    """Return a pose with its quaternion normalised.

    Raises:
        InvalidGoal: If the rotation is not about z. The text is that of C++ move_base.
    """
    length = math.sqrt(sum(part * part for part in pose.quaternion))
    if not math.isfinite(length) or length < 1e-3:
        raise InvalidGoal(INVALID_QUATERNION)
    x, y, z, w = pose.quaternion
    unit = Pose3D(pose.x_m, pose.y_m, pose.z_m, (x / length, y / length, z / length, w / length))
    if abs(unit.rotation[2, 2] - 1.0) > 1e-3:
        raise InvalidGoal(INVALID_QUATERNION)
    return unit


def planar_pose(pose: Pose2D, z_m: float = 0.0) -> Pose3D:
    """Return a planar pose at a height."""
    return Pose3D(pose.x_m, pose.y_m, z_m, quaternion_from_yaw(pose.yaw_rad))


def pose_stamped(pose: Pose3D, frame: str, stamp: rospy.Time) -> PoseStamped:
    """Convert a pose with its frame and stamp."""
    return PoseStamped(Header(0, stamp, frame), pose_message(pose))


def path_message(plan: np.ndarray, frame: str, stamp: rospy.Time) -> Path:
    """Convert a plan, float64[n, 3] of (x_m, y_m, yaw_rad); every pose has the path's stamp."""
    poses = [pose_stamped(planar_pose(Pose2D(*row)), frame, stamp) for row in plan.tolist()]
    return Path(Header(0, stamp, frame), poses)


def polygon_message(points: np.ndarray, frame: str, stamp: rospy.Time) -> PolygonStamped:
    """Convert a footprint, float64[n, 2] in metres."""
    corners = [Point32(x, y, 0.0) for x, y in points.tolist()]
    return PolygonStamped(Header(0, stamp, frame), Polygon(corners))


def grid_message(spec: GridSpec, costs: np.ndarray, frame: str, stamp: rospy.Time) -> OccupancyGrid:
    """Convert a costmap's master grid, uint8[height, width], to occupancies 0 to 100 and -1."""
    return _occupancy_grid(spec, occupancy(costs), frame, stamp)


def map_message(static_map: StaticMap, stamp: rospy.Time) -> OccupancyGrid:
    """Convert a map that is loaded at a time."""
    message = _occupancy_grid(static_map.spec, static_map.occupancy, static_map.frame, stamp)
    message.info.origin.orientation = Quaternion(*quaternion_from_yaw(static_map.yaw_rad))
    message.info.map_load_time = stamp
    return message


def potential_message(
    spec: GridSpec, potential: np.ndarray, scale: int, frame: str, stamp: rospy.Time
) -> OccupancyGrid:
    """Convert the potential of a global planner, float32[height, width].

    Its greatest value becomes ``scale``; cells that it did not reach become -1.
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
    origin = Pose(Point(spec.origin_x_m, spec.origin_y_m, 0.0), Quaternion(w=1.0))
    info = MapMetaData(rospy.Time(), spec.resolution_m, spec.size_x, spec.size_y, origin)
    return OccupancyGrid(Header(0, stamp, frame), info, values.ravel().tolist())


def update_message(
    costs: np.ndarray, x0: int, y0: int, frame: str, stamp: rospy.Time
) -> OccupancyGridUpdate:
    """Convert a window of a costmap, uint8[height, width], that begins at column x0 and row y0."""
    height, width = costs.shape
    data = occupancy(costs).ravel().tolist()
    return OccupancyGridUpdate(Header(0, stamp, frame), x0, y0, width, height, data)


COST_FIELDS = ("x", "y", "z", "path_cost", "goal_cost", "occ_cost", "total_cost")


def cost_cloud_message(
    points: np.ndarray, cells: int, frame: str, stamp: rospy.Time
) -> PointCloud2:
    """Convert the scored cells of a local planner, float32[n, 7] in columns of `COST_FIELDS`.

    As in C++ move_base, the cloud has one point for each of the ``cells`` of the window, the scored
    ones first. Points without a score are NaN; viewers skip them.
    """
    data = np.full((cells, len(COST_FIELDS)), np.nan, dtype=np.float32)
    data[: len(points)] = points
    return cloud_message(data, COST_FIELDS, frame, stamp)


def cloud_message(
    points: np.ndarray, fields: Sequence[str], frame: str, stamp: rospy.Time
) -> PointCloud2:
    """Convert points, float32[n, k] with a column for each of the ``fields``."""
    return PointCloud2(
        header=Header(0, stamp, frame),
        height=1,
        width=len(points),
        fields=[PointField(name, 4 * k, PointField.FLOAT32, 1) for k, name in enumerate(fields)],
        point_step=4 * len(fields),
        row_step=points.nbytes,
        data=points.tobytes(),
    )
