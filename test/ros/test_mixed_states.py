#!/usr/bin/env python3
"""One robot is in the simulator's states, the other has odometry of its own.

The host of the other publishes its states. If these stop, the peer hears its odometry.
"""

import math

import rosgraph
import rospy
import rostest
from flight_case import FlightCase
from nav_msgs.msg import Odometry
from sensor_msgs.msg import MultiDOFJointState

from quad_nav.ros.navigator.intention_topics import INTENTIONS_TOPIC

HOST, PEER = "/move_base1", "/move_base0"


class MixedStates(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.states, cls.to = {}, rospy.Publisher("/odom1", Odometry, queue_size=10)
        cls.relays = True
        cls.subscribers = [
            rospy.Subscriber("/true/odom1", Odometry, cls.relay, queue_size=10),
            rospy.Subscriber("/quad/states", MultiDOFJointState, cls.store, queue_size=100),
        ]
        cls.start()

    @classmethod
    def relay(cls, message):
        if cls.relays:
            cls.to.publish(message)

    @classmethod
    def store(cls, message):
        cls.states[message._connection_header["callerid"]] = message

    @staticmethod
    def listeners(topic):
        """Nodes that subscribe to a topic."""
        _, subscribed, _ = rosgraph.Master("/test").getSystemState()
        return set(dict(subscribed).get(topic, ()))

    def names(self):
        return {node: message.joint_names for node, message in self.states.items()}

    def test_each_source_is_used_while_it_is_there(self):
        expected = {"/simulator": ["quad0"], HOST: ["quad1"]}
        self.wait(lambda: self.names() == expected, lambda: f"states of both: {self.names()}")
        for topic, node in (
            ("/odom1", PEER),
            ("/odom0", HOST),
            ("/move_base1/intention", PEER),
            ("/move_base0/intention", HOST),
        ):
            self.wait(lambda t=topic, n=node: n not in self.listeners(t), f"{node} without {topic}")
        self.assertIn(HOST, self.listeners("/odom1"))
        self.assertEqual(self.listeners(INTENTIONS_TOPIC), {HOST, PEER})
        state, true = self.states[HOST], self.odometry[1].message.pose.pose.position
        place = state.transforms[0].translation
        self.assertEqual(state.header.frame_id, "map")
        self.assertLess(math.dist((place.x, place.y, place.z), (true.x, true.y, true.z)), 0.2)

        type(self).relays = False
        self.wait(lambda: PEER in self.listeners("/odom1"), "the peer hearing odometry")
        self.assertNotIn(HOST, self.listeners("/odom0"))
        type(self).relays = True
        self.wait(lambda: PEER not in self.listeners("/odom1"), "the peer hearing states again")


if __name__ == "__main__":
    rostest.rosrun("quad", "mixed_states", MixedStates)
