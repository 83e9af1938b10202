"""Simulated quadcopters among real ones, and contacts of all.

One simulation has a body for each vehicle. Those of kind `simulated` follow `/cmd_vel{i}`; those of
real vehicles are put where tf says that they are, so that the simulated ones see them and touch
them. It runs in wall time, as real vehicles do.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Dict, Sequence

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from quad.msg import Contact as ContactMessage
from tf2_msgs.msg import TFMessage

from quad_nav.geometry import Pose3D
from quad_nav.ros.common.conversions import (
    odometry_message,
    time_message,
    transform_message,
)
from quad_nav.ros.common.own_messages import contact_message
from quad_nav.ros.simulator.commands import Commands
from quad_nav.sim.contacts import Contact
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.sim.scene import Scene
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEPS_PER_S
from quad_nav.topics.contacts import CONTACTS_TOPIC
from quad_vehicles.ros.scene_topics import PoseListener
from quad_vehicles.starts import starts_of
from quad_vehicles.vehicle_file import Vehicle

STEPS_PER_TICK = 4
"""Steps of the simulation for which a real vehicle's body is left to itself."""
TICK_S = STEPS_PER_TICK / STEPS_PER_S
TICKS_PER_ODOMETRY = 2
MOST_LATE_S = 0.25
"""Time that the simulation makes up for; after a longer stop it goes on from there."""
_BODY_VALUES = 13
_FLOOR = "floor"


class SimulatedVehicles:
    """Bodies of all vehicles in one simulation, and the topics of the simulated ones.

    Attributes:
        tick_s: Period of ``advance``.
    """

    tick_s = TICK_S

    def __init__(
        self,
        scene: Scene,
        vehicles: Sequence[Vehicle],
        poses: PoseListener,
        are_real_in_scene: bool,
        now_s: float,
    ) -> None:
        """Advertise the topics.

        Args:
            scene: The room.
            vehicles: All vehicles of the file.
            poses: Poses of the real ones.
            are_real_in_scene: Whether contacts of real vehicles with the scene count: their
                LIDARs see it too.
            now_s: Monotonic time.

        Raises:
            InputError: If a simulated vehicle has no place to start.
        """
        starts = starts_of(scene, vehicles)
        self._real = [one.number for one in vehicles if one.kind != "simulated"]
        self._simulated = [one.number for one in vehicles if one.kind == "simulated"]
        self._are_real_in_scene = are_real_in_scene
        self._simulation = Simulation(replace(scene, starts=starts), len(vehicles))
        self._poses = poses
        self._last: Dict[int, Pose3D] = {}  # poses of the real ones
        self._commands = Commands(self._simulation, self._simulated)
        self._contacts = rospy.Publisher(CONTACTS_TOPIC, ContactMessage, queue_size=100)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=10)
        self._odometry = {
            i: rospy.Publisher(f"/odom{i}", Odometry, queue_size=10) for i in self._simulated
        }
        self._next_s, self._ticks = now_s, 0

    def advance(self, now_s: float) -> None:
        """Advance up to a time, and publish what is due.

        Args:
            now_s: Monotonic time.
        """
        self._next_s = max(self._next_s, now_s - MOST_LATE_S)
        while self._next_s <= now_s:
            self._next_s += TICK_S
            self._ticks += 1
            self._commands.take()
            if self._place():
                for contact in self._simulation.advance(STEPS_PER_TICK):
                    self._publish_contact(contact)
            if self._ticks % TICKS_PER_ODOMETRY == 0:
                self._publish_states()

    def _place(self) -> bool:
        """Put the bodies of the real vehicles; return whether all have been seen."""
        for robot in self._real:
            found = self._poses.pose(robot)
            if found is not None:
                self._last[robot] = found[0]
        if len(self._last) < len(self._real):
            return False
        if self._real:
            rows = np.zeros((len(self._real), _BODY_VALUES))
            for row, robot in zip(rows, self._real):
                pose = self._last[robot]
                row[:7] = (pose.x_m, pose.y_m, pose.z_m, *pose.quaternion)
            self._simulation.place(self._real, rows)
        return True

    def _publish_contact(self, contact: Contact) -> None:
        involved = [i for i in self._simulated if contact.involves(f"quad{i}")]
        if not involved and (contact.other == _FLOOR or not self._counts(contact)):
            return
        rospy.logwarn("%s at (%.2f, %.2f) m", contact, contact.x_m, contact.y_m)
        self._contacts.publish(contact_message(contact, rospy.get_time()))

    def _counts(self, contact: Contact) -> bool:
        """Return whether a contact of a real vehicle counts: with another one always."""
        others = [i for i in self._real if contact.involves(f"quad{i}")]
        return self._are_real_in_scene or len(others) > 1

    def _publish_states(self) -> None:
        stamp = time_message(rospy.get_time())
        transforms = []
        for i, publisher in self._odometry.items():
            state = self._simulation.state(i)
            odom, base = f"odom{i}", f"base_link{i}"
            pose, twist = state.map_from_base, (state.linear_mps, state.angular_radps)
            publisher.publish(odometry_message(pose, *twist, (odom, base), stamp))
            transforms += [
                transform_message(Pose3D(0.0, 0.0, 0.0), "map", odom, stamp),
                transform_message(state.map_from_base, odom, base, stamp),
                transform_message(base_from_lidar, base, f"Lidar{i}", stamp),
            ]
        if transforms:
            self._tf.publish(TFMessage(transforms))

    def close(self) -> None:
        """Free the physics engine."""
        self._simulation.close()
