"""Subscribers to the simulator's contacts and to the people who react to quadcopters."""

from __future__ import annotations

from typing import Collection

import rospy
from geometry_msgs.msg import PoseArray
from quad.msg import Contact as ContactMessage

from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.sequencer.flight_record import FlightRecord
from quad_nav.scenario.rules import START_S
from quad_nav.sim.crowd_record import CrowdRecord
from quad_nav.sim.scene import Scene
from quad_nav.topics.contacts import CONTACTS_TOPIC, contact_from_message
from quad_nav.topics.obstacle_poses import POSES_TOPIC, people_positions
from quad_nav.topics.validation import MAX_LEAD_S


class ContactTopic:
    """Adds the contacts on ``/simulation/contacts`` to the record of the flight."""

    def __init__(
        self, names: Collection[str], record: FlightRecord, warnings: ThrottledWarnings
    ) -> None:
        """Subscribe.

        Args:
            names: Names of the mission's robots.
            record: The flight.
            warnings: The node's warnings.
        """
        self._names, self._record, self._warnings = names, record, warnings
        self._topic = rospy.Subscriber(CONTACTS_TOPIC, ContactMessage, self._add, queue_size=100)

    @property
    def has_publisher(self) -> bool:
        """True while a node publishes contacts."""
        return bool(self._topic.get_num_connections())

    def _add(self, message: ContactMessage) -> None:
        now_s = rospy.get_time()
        try:
            contact = contact_from_message(message, message.header.stamp.to_sec())
            if contact.time_s > now_s + MAX_LEAD_S:
                raise ValueError(f"contact at {contact.time_s:.2f} s, /clock is at {now_s:.2f} s")
            if not any(contact.involves(name) for name in self._names):
                raise ValueError(f"contact of {contact.robot}, expected a robot of this mission")
        except ValueError as error:
            name = self._topic.resolved_name
            self._warnings.warn(f"{name}: message dropped: {error}", kind=name)
            return
        if self._record.add_contact(contact, now_s):
            self._warnings.warn(
                f"{contact.robot}: CONTACT with {contact.other} at"
                f" ({contact.x_m:.2f}, {contact.y_m:.2f}) m",
                kind=f"{contact.robot}: CONTACT with {contact.other}",
            )


class PeopleTopic:
    """Adds what ``/simulation/obstacle_poses`` says to the record of people, for clearances."""

    def __init__(
        self,
        scene: Scene,
        people: CrowdRecord,
        record: FlightRecord,
        warnings: ThrottledWarnings,
    ) -> None:
        """Subscribe.

        Args:
            scene: The scene, with people who react.
            people: Where they are; the log of `record` reads it.
            record: The flight, whose lock is held to add to `people`.
            warnings: The node's warnings.
        """
        self._scene, self._people = scene, people
        self._record, self._warnings = record, warnings
        self._topic = rospy.Subscriber(POSES_TOPIC, PoseArray, self._add, queue_size=20)

    def _add(self, message: PoseArray) -> None:
        stamp_s, now_s = message.header.stamp.to_sec(), rospy.get_time()
        try:
            if stamp_s > now_s + MAX_LEAD_S:
                raise ValueError(f"stamp {stamp_s:.2f} s, /clock is at {now_s:.2f} s")
            positions = people_positions(message.poses, self._scene)
        except ValueError as error:
            name = self._topic.resolved_name
            self._warnings.warn(f"{name}: message dropped: {error}", kind=name)
            return
        with self._record.lock:
            self._people.add(stamp_s - START_S, positions)
