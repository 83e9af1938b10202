"""The transforms of a localization on `/tf`."""

from __future__ import annotations

from typing import Dict

import rospy
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from quad_nav.ros.navigator.costmap_publisher import NewSubscriber, Publish


class TransformTopic:
    """Sends a node that subscribes the latest transforms: a paused simulation sends no others."""

    def __init__(self) -> None:
        self._latest: Dict[str, TransformStamped] = {}
        self._publisher = rospy.Publisher(
            "/tf", TFMessage, NewSubscriber(self._send_latest), queue_size=100
        )

    def _send_latest(self, send: Publish) -> None:
        if self._latest:
            send(TFMessage(list(self._latest.values())))

    def send(self, transform: TransformStamped) -> None:
        """Publish a transform."""
        self._latest[transform.child_frame_id] = transform
        self._publisher.publish(TFMessage([transform]))

    def forget(self) -> None:
        """Forget the latest transforms, after a reset."""
        self._latest = {}
