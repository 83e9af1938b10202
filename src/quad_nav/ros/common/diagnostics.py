"""``/diagnostics``: publishes statuses and says in the log when one changes its level.

``diagnostic_updater`` would do most of it, on simulated time: it falls silent while the
simulation is paused, and its rates divide by a time that stands still. Here it is wall time.
"""

from __future__ import annotations

import threading
from typing import Callable, Dict, Sequence

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from quad_nav.topics.health import Health, Level

PERIOD_S = 1.0  # wall time

_LOG = {
    Level.OK: rospy.loginfo,
    Level.WARN: rospy.logwarn,
    Level.ERROR: rospy.logerr,
    Level.STALE: rospy.logwarn,
}


class DiagnosticsTopic:
    """A node's publisher on ``/diagnostics``."""

    def __init__(self) -> None:
        self._publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self._levels: Dict[str, int] = {}

    def publish(self, array: DiagnosticArray) -> None:
        """Every status is told each time; a change of its level is one line in the log."""
        for status in array.status:
            before = self._levels.get(status.name)
            self._levels[status.name] = status.level
            if before is not None and before != status.level:
                level = Level(status.level)
                _LOG[level](
                    "%s: %s -> %s: %s", status.name, Level(before).name, level.name, status.message
                )
        self._publisher.publish(array)


def diagnostic_array(healths: Sequence[Health]) -> DiagnosticArray:
    """A message of the time that it is."""
    array = DiagnosticArray(
        status=[
            DiagnosticStatus(
                level=int(one.level),
                name=one.name,
                message=one.message,
                hardware_id=one.hardware_id,
                values=[KeyValue(key, value) for key, value in one.values.items()],
            )
            for one in healths
        ]
    )
    array.header.stamp = rospy.Time.now()
    return array


def tell_every_second(report: Callable[[], Sequence[Health]]) -> None:
    """Publishes what ``report`` returns, from a thread of its own, until ROS shuts down.

    It goes on while simulated time stands, and while the node's own loop does.
    """
    topic = DiagnosticsTopic()

    def run() -> None:
        while not rospy.is_shutdown():
            rospy.rostime.wallsleep(PERIOD_S)
            try:
                topic.publish(diagnostic_array(report()))
            except rospy.ROSException:
                if not rospy.core.is_shutdown_requested():  # then rospy closes the topics
                    raise

    threading.Thread(target=run, name="diagnostics", daemon=True).start()
