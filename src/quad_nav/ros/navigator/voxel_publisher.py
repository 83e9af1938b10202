"""The marked voxels of voxel layers with ``publish_voxel_map``, as cubes for RViz.

The original publishes a message of its own, and has a node that turns it into such cubes.
"""

from __future__ import annotations

from typing import List

import rospy
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.voxel import VoxelLayer

COLOUR = ColorRGBA(0.8, 0.3, 0.1, 0.6)


class VoxelPublisher:
    """One layer's cubes on ``topic``; nothing is made without a listener."""

    def __init__(self, topic: str, layer: VoxelLayer):
        self._layer = layer
        self._publisher = rospy.Publisher(topic, Marker, queue_size=1)

    def publish(self, frame: str, stamp: rospy.Time) -> None:
        """To be called after each update of the costmap."""
        if self._publisher.get_num_connections() > 0:
            self._publisher.publish(marker_message(self._layer, frame, stamp))


def voxel_publishers(namespace: str, costmap: LayeredCostmap) -> List[VoxelPublisher]:
    """One on ``<namespace>/<layer>/voxel_markers`` for each layer that asks for it."""
    return [
        VoxelPublisher(f"{namespace}/{name}/voxel_markers", layer)
        for name, layer in costmap.layers.items()
        if isinstance(layer, VoxelLayer) and layer.params.publish_voxel_map
    ]


def marker_message(layer: VoxelLayer, frame: str, stamp: rospy.Time) -> Marker:
    """The marked voxels as one list of cubes; it replaces the one before."""
    resolution_m = layer.grid.spec.resolution_m
    marker = Marker(
        type=Marker.CUBE_LIST,
        action=Marker.ADD,
        ns="voxels",
        color=COLOUR,
        scale=Vector3(resolution_m, resolution_m, layer.params.z_resolution_m),
    )
    marker.header.frame_id, marker.header.stamp = frame, stamp
    marker.pose.orientation.w = 1.0
    marker.points = [Point(*centre) for centre in layer.marked_voxels().tolist()]
    return marker
