"""Take the footprint of a costmap from a topic: robots that unfold an arm change their outline.

As in costmap_2d, a costmap hears a Polygon and publishes a PolygonStamped on topics that have the
same name by default. ROS connects nodes by type, so a client sends or receives on that name.
"""

from __future__ import annotations

from collections import deque
from typing import Deque, Optional

import numpy as np
import rospy
from geometry_msgs.msg import Polygon
from numpy.typing import NDArray

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.rospy_repairs import ignore_own_publisher
from quad_nav.topics.publishing import Names, topic_below
from quad_nav.topics.validation import footprint_problem


class FootprintTopic:
    """The newest footprint that came for a costmap.

    Attributes:
        costmap: The costmap.
    """

    def __init__(self, robot: str, name: str, costmap: LayeredCostmap, names: Names) -> None:
        """Subscribe to the topic of costmap ``name``; its publisher must be made later."""
        self.costmap = costmap
        self._robot, self._warnings = robot, ThrottledWarnings()
        self._waiting: Deque[NDArray[np.float64]] = deque(maxlen=1)
        topic = topic_below(names(f"~{name}"), costmap.params.footprint_topic)
        self._subscriber = rospy.Subscriber(topic, Polygon, self._store, queue_size=1)
        ignore_own_publisher(self._subscriber)

    def _store(self, message: Polygon) -> None:
        points = np.array([(point.x, point.y) for point in message.points]).reshape(-1, 2)
        problem = footprint_problem(points)
        if problem:
            topic = self._subscriber.resolved_name
            self._warnings.warn(f"{self._robot}: {topic}: footprint dropped: {problem}")
        else:
            self._waiting.append(points)

    def pop(self) -> Optional[NDArray[np.float64]]:
        """Return a new footprint, float64[n, 2] without padding in the robot's frame, once."""
        return self._waiting.pop() if self._waiting else None
