"""Convert markers to messages, and goal markers to spheres for pybullet's window."""

from __future__ import annotations

from typing import List, Sequence

from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from quad_nav.geometry import quaternion_from_yaw
from quad_nav.sim.body import GoalSphere
from quad_nav.topics import markers


def marker_array(shown: Sequence[markers.Marker]) -> MarkerArray:
    """Convert markers."""
    return MarkerArray([_message(marker) for marker in shown])


def replacing_markers(shown: Sequence[markers.Marker]) -> MarkerArray:
    """Convert markers, preceded by an order to delete all markers that were shown before."""
    clear = Marker(action=Marker.DELETEALL)
    clear.header.frame_id = "map"
    return MarkerArray([clear, *marker_array(shown).markers])


def goal_spheres(message: MarkerArray) -> List[GoalSphere]:
    """Return the spheres among markers in `map`: centre, radius and colour."""
    return [
        (
            (m.pose.position.x, m.pose.position.y, m.pose.position.z),
            m.scale.x / 2,
            (m.color.r, m.color.g, m.color.b, m.color.a),
        )
        for m in message.markers
        if m.type == Marker.SPHERE and m.action == Marker.ADD
    ]


def _message(marker: markers.Marker) -> Marker:
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
    message.header.frame_id = marker.frame
    return message
