"""Bad messages for a flight: odometry that turns into NaN, a transform from the future."""

from __future__ import annotations

import math
from typing import Any

TRUE_ODOMETRY = "/true/odom0"
AHEAD_S = 20.0


class OdometryRelay:
    """Forward the odometry of robot 0 from the simulator of ``relayed.launch``.

    Attributes:
        is_nan: Whether position and velocity are replaced by NaN.
    """

    def __init__(self) -> None:
        import rospy
        from nav_msgs.msg import Odometry

        self.is_nan = False
        self._publisher = rospy.Publisher("/odom0", Odometry, queue_size=10)
        self._subscriber = rospy.Subscriber(TRUE_ODOMETRY, Odometry, self._forward)

    def _forward(self, message: Any) -> None:
        if self.is_nan:
            for vector in (message.pose.pose.position, message.twist.twist.linear):
                vector.x = vector.y = vector.z = math.nan
        self._publisher.publish(message)


class FutureTransform:
    """Publish a transform of robot 0 that is 20 s ahead of the clock."""

    def __init__(self, listeners: int) -> None:
        """Advertise the topic; ``listeners`` is the number of nodes to wait for."""
        import rospy
        from tf2_msgs.msg import TFMessage

        self._publisher = rospy.Publisher("/tf", TFMessage, queue_size=1)
        self._listeners = listeners

    @property
    def is_connected(self) -> bool:
        """Return whether the nodes would receive the transform."""
        return self._publisher.get_num_connections() >= self._listeners

    def publish(self, now_s: float) -> None:
        """Publish it once."""
        import rospy
        from geometry_msgs.msg import TransformStamped
        from tf2_msgs.msg import TFMessage

        transform = TransformStamped(child_frame_id="base_link0")
        transform.header.frame_id = "odom0"
        transform.header.stamp = rospy.Time.from_sec(now_s + AHEAD_S)
        transform.transform.rotation.w = 1.0
        self._publisher.publish(TFMessage([transform]))
