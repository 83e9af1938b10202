"""Publish statuses on `/diagnostics`, log every change of a level, and throttle warnings.

`diagnostic_updater` uses simulated time: it publishes nothing while the simulation is paused, and
its rates divide by an elapsed time of 0. This module uses wall time.
"""

from __future__ import annotations

import re
import threading
import time
from typing import Callable, Dict, Sequence

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from quad_nav.errors import excerpt
from quad_nav.topics.health import Health, Level, LevelChange, change_lines, logged_name

PERIOD_S = 1.0  # wall time
REPEAT_S = 5.0  # wall time
MAX_KINDS, MAX_WARNING = 20, 2000
_NUMBER = re.compile(r"-?\d+(\.\d+)?")

_LOG = {
    Level.OK: rospy.loginfo,
    Level.WARN: rospy.logwarn,
    Level.ERROR: rospy.logerr,
    Level.STALE: rospy.logwarn,
}


class DiagnosticsTopic:
    """A node's publisher on `/diagnostics`."""

    def __init__(self) -> None:
        self._publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self._levels: Dict[str, int] = {}

    def publish(self, array: DiagnosticArray) -> None:
        """Publish all statuses and log those whose level has changed."""
        changes = []
        for status in array.status:
            before = self._levels.get(status.name)
            self._levels[status.name] = status.level
            if before is not None and before != status.level:
                name = logged_name(status.name, status.hardware_id)
                level = Level(status.level)
                changes.append(LevelChange(name, Level(before), level, status.message))
        for level, line in change_lines(changes):
            _LOG[level]("%s", line)
        self._publisher.publish(array)


def diagnostic_array(healths: Sequence[Health]) -> DiagnosticArray:
    """Convert statuses to a message with the present time."""
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


def publish_health(report: Callable[[], Sequence[Health]]) -> None:
    """Publish statuses once a second from a separate thread until ROS shuts down.

    Publishing continues while simulated time or the node's own loop is stopped.

    Args:
        report: Returns the present statuses.
    """
    topic = DiagnosticsTopic()

    def run() -> None:
        while not rospy.is_shutdown():
            rospy.rostime.wallsleep(PERIOD_S)
            try:
                topic.publish(diagnostic_array(report()))
            except rospy.ROSException:
                if not rospy.core.is_shutdown_requested():  # at shutdown rospy closes the topics
                    raise

    threading.Thread(target=run, name="diagnostics", daemon=True).start()


class ThrottledWarnings:
    """Log a repeated warning at once and then every `REPEAT_S` of wall time.

    Warnings that differ only in their numbers count as the same one. Of different ones, `MAX_KINDS`
    are logged in `REPEAT_S`: their texts may contain strings of messages. These are escaped and
    cut.
    """

    def __init__(self) -> None:
        self._logged_s: Dict[str, float] = {}

    def warn(self, text: str, kind: str = "") -> None:
        """Log a warning unless the same one was logged a short time ago.

        Args:
            text: The warning.
            kind: Warnings of one kind are the same. Give it for a text with words from a message:
                a flood of different words would be a flood of lines.
        """
        self.log(rospy.logwarn, text, kind)

    def error(self, text: str) -> None:
        """Log an error unless the same line was logged a short time ago."""
        self.log(rospy.logerr, text)

    def log(self, function: Callable[..., None], text: str, kind: str = "") -> None:
        """Log by one of rospy's functions unless the same was logged a short time ago."""
        text = excerpt(text, MAX_WARNING, keep="\n")
        if self._is_due(kind or text):
            function("%s", text)

    def _is_due(self, text: str) -> bool:
        kind, now_s = _NUMBER.sub("#", text), time.monotonic()
        if kind in self._logged_s and now_s - self._logged_s[kind] < REPEAT_S:
            return False
        if kind not in self._logged_s and len(self._logged_s) >= MAX_KINDS:
            self._logged_s = {
                one: at_s
                for one, at_s in list(self._logged_s.items())  # several threads warn
                if now_s - at_s < REPEAT_S
            }
            if len(self._logged_s) >= MAX_KINDS:
                return False
        self._logged_s[kind] = now_s
        return True
