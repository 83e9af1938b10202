"""Convert maps to messages and back."""

from __future__ import annotations

import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose, Quaternion
from nav_msgs.msg import MapMetaData, OccupancyGrid
from std_msgs.msg import Header

from quad_localization.map_files import GridMap
from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D, quaternion_from_yaw, yaw_from_quaternion
from quad_nav.topics.validation import grid_problem


def grid_message(grid: GridMap, frame: str) -> OccupancyGrid:
    """Convert a map, without a stamp."""
    height, width = grid.occupancy.shape
    place = Point(grid.origin.x_m, grid.origin.y_m, 0.0)
    origin = Pose(place, Quaternion(*quaternion_from_yaw(grid.origin.yaw_rad)))
    info = MapMetaData(rospy.Time(), grid.resolution_m, width, height, origin)
    return OccupancyGrid(Header(0, rospy.Time(), frame), info, grid.occupancy.ravel().tolist())


def grid_from_message(message: OccupancyGrid) -> GridMap:
    """Return the map of a message.

    The resolution of a message is a float32; the shortest decimal number that it stands for is
    what its sender has read.

    Raises:
        InputError: Sizes or numbers are not valid.
    """
    info, origin = message.info, message.info.origin
    size, corner = (info.width, info.height), (origin.position.x, origin.position.y)
    problem = grid_problem(*size, info.resolution, len(message.data), corner)
    if problem:
        raise InputError([f"map: {problem}"])
    turn = origin.orientation
    yaw_rad = yaw_from_quaternion((turn.x, turn.y, turn.z, turn.w))
    cells = np.array(message.data, np.int8).reshape(info.height, info.width)
    return GridMap(cells, float(str(np.float32(info.resolution))), Pose2D(*corner, yaw_rad))
