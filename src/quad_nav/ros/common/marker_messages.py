"""Convert markers to messages for RViz; apart from ``conversions`` for nodes that show nothing."""

from __future__ import annotations

from typing import Sequence

from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from quad_nav.geometry import quaternion_from_yaw
from quad_nav.ros.common.conversions import time_message
from quad_nav.topics import markers


def marker_array(shown: Sequence[markers.Marker], stamp_s: float = 0.0) -> MarkerArray:
    """Convert markers; with a stamp of 0 they hold at any time."""
    return MarkerArray([_marker_message(marker, stamp_s) for marker in shown])


def replacing_markers(shown: Sequence[markers.Marker]) -> MarkerArray:
    """Convert markers, preceded by an order to delete all markers that were shown before."""
    clear = Marker(action=Marker.DELETEALL)
    clear.header.frame_id = "map"
    return MarkerArray([clear, *marker_array(shown).markers])


def _marker_message(marker: markers.Marker, stamp_s: float) -> Marker:
    message = Marker(
        ns=marker.namespace,
        id=marker.number,
        type=marker.kind,
        action=Marker.ADD,
        pose=Pose(Point(*marker.place_m), Quaternion(*quaternion_from_yaw(marker.yaw_rad))),
        scale=Vector3(*marker.size_m),
        color=ColorRGBA(*marker.rgba),
        text=marker.text,
        frame_locked=marker.frame_locked,
        points=[Point(*point) for point in marker.points_m],
    )
    message.header.frame_id, message.header.stamp = marker.frame, time_message(stamp_s)
    return message
