"""People who react to quadcopters, as the simulator tells of them, for clearances."""

from __future__ import annotations

import rospy
from visualization_msgs.msg import MarkerArray

from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.sequencer.flight_record import FlightRecord
from quad_nav.scenario.rules import START_S
from quad_nav.sim.crowd_record import CrowdRecord
from quad_nav.sim.scene import Scene
from quad_nav.topics.markers import OBSTACLES_TOPIC, people_positions
from quad_nav.topics.validation import MAX_LEAD_S


class PeopleTopic:
    """Adds what ``/simulation/obstacles`` says to the record of people."""

    def __init__(self, scene: Scene, people: CrowdRecord, record: FlightRecord) -> None:
        """Subscribe.

        Args:
            scene: The scene, with people who react.
            people: Where they are; the log of `record` reads it.
            record: The flight, whose lock is held to add to `people`.
        """
        self._scene, self._people, self._record = scene, people, record
        self._warnings = ThrottledWarnings()
        self._topic = rospy.Subscriber(OBSTACLES_TOPIC, MarkerArray, self._add, queue_size=20)

    def _add(self, message: MarkerArray) -> None:
        if not message.markers:
            return
        stamp_s, now_s = message.markers[0].header.stamp.to_sec(), rospy.get_time()
        try:
            if stamp_s > now_s + MAX_LEAD_S:
                raise ValueError(f"stamp {stamp_s:.2f} s, /clock is at {now_s:.2f} s")
            positions = people_positions(message.markers, self._scene)
        except ValueError as error:
            name = self._topic.resolved_name
            self._warnings.warn(f"{name}: message dropped: {error}", kind=name)
            return
        with self._record.lock:
            self._people.add(stamp_s - START_S, positions)
