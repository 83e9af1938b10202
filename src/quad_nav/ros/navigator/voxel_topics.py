"""Publish a voxel layer: its voxels as costmap_2d does and as markers, and the ends of its rays."""

from __future__ import annotations

from typing import Any

import genpy.dynamic
import rospy
from geometry_msgs.msg import Point, Point32, Vector3
from sensor_msgs.msg import PointCloud
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

from quad_nav.costmap.voxel import VoxelLayer
from quad_nav.ros.common.conversions import time_message

_COLOUR = ColorRGBA(0.8, 0.3, 0.1, 0.6)
_GRID_TYPE = "costmap_2d/VoxelGrid"
_GRID_TEXT = """\
Header header
uint32[] data  # columns, row by row; bit k: voxel k is not free, bit 16 + k: it is marked
geometry_msgs/Point32 origin
geometry_msgs/Vector3 resolutions
uint32 size_x
uint32 size_y
uint32 size_z
"""
_SEPARATOR = 80 * "=" + "\n"
# Debian has no package costmap_2d. ROS compares the types of messages by name and fields.
VoxelGrid = genpy.dynamic.generate_dynamic(
    _GRID_TYPE,
    _GRID_TEXT
    + "".join(
        f"{_SEPARATOR}MSG: {part._type}\n{part._full_text}\n" for part in (Header, Point32, Vector3)
    ),
)[_GRID_TYPE]


class VoxelTopics:
    """Publishes one voxel layer below the layer's namespace."""

    def __init__(self, namespace: str, layer: VoxelLayer, frame: str) -> None:
        """Advertise the topics; those of voxels only with ``publish_voxel_map``, as upstream."""
        self._layer, self._frame = layer, frame
        self._ends = rospy.Publisher(f"{namespace}/clearing_endpoints", PointCloud, queue_size=1)
        topics = ("voxel_grid", VoxelGrid, voxel_grid), ("voxel_markers", Marker, voxel_marker)
        self._voxels = [
            (rospy.Publisher(f"{namespace}/{name}", kind, queue_size=1), make)
            for name, kind, make in (topics if layer.params.publish_voxel_map else ())
        ]

    def publish(self, stamp: rospy.Time) -> None:
        """Publish what somebody listens to, after an update of the costmap."""
        if not self._layer.params.enabled:
            return
        for publisher, make in self._voxels:
            if publisher.get_num_connections() > 0:
                publisher.publish(make(self._layer, self._frame, stamp))
        if self._ends.get_num_connections() == 0:
            return
        for stamp_s, ends in self._layer.clearing_ends():
            points = [Point32(*end) for end in ends.tolist()]
            header = Header(0, time_message(stamp_s), self._frame)
            self._ends.publish(PointCloud(header=header, points=points))


def voxel_grid(layer: VoxelLayer, frame: str, stamp: rospy.Time) -> Any:
    """Return all voxels as a message of costmap_2d."""
    spec, params = layer.grid.spec, layer.params
    return VoxelGrid(
        Header(0, stamp, frame),
        layer.packed_voxels().ravel().tolist(),
        Point32(spec.origin_x_m, spec.origin_y_m, params.origin_z_m),
        Vector3(spec.resolution_m, spec.resolution_m, params.z_resolution_m),
        spec.size_x,
        spec.size_y,
        params.z_voxels,
    )


def voxel_marker(layer: VoxelLayer, frame: str, stamp: rospy.Time) -> Marker:
    """Return the marked voxels as one list of cubes, which replaces the previous one."""
    resolution_m = layer.grid.spec.resolution_m
    marker = Marker(
        type=Marker.CUBE_LIST,
        action=Marker.ADD,
        ns="voxels",
        color=_COLOUR,
        scale=Vector3(resolution_m, resolution_m, layer.params.z_resolution_m),
    )
    marker.header.frame_id, marker.header.stamp = frame, stamp
    marker.pose.orientation.w = 1.0
    marker.points = [Point(*centre) for centre in layer.marked_voxels().tolist()]
    return marker
