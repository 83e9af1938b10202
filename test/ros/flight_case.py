"""Base of the tests on running nodes: waiting for conditions, goals, commands."""

from __future__ import annotations

import json
import os
import threading
import time
import unittest
from xmlrpc.client import ServerProxy

import actionlib
import numpy as np
import rosgraph
import rosnode
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import Odometry
from std_srvs.srv import Trigger

PATIENCE_S = 120.0  # wall time; generous, because a condition that holds ends the wait
PUBLISHERS = ("/simulator", "/move_base0", "/move_base1")


def wait(condition, what, patience_s=PATIENCE_S):
    """Until the condition holds; a failure names ``what``, or what it returns."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end and not rospy.is_shutdown():
        if condition():
            return
        time.sleep(0.02)
    raise AssertionError(f"not within {patience_s:g} s: {what() if callable(what) else what}")


def topics_sent_here(nodes=PUBLISHERS):
    """The topics that nodes, by default simulator and navigators, send to this node.

    Taken from the publishers' own lists. A subscriber's number of connections includes unfinished
    ones; many at once take a second or more, and messages published before that are lost.
    """
    here, master = rospy.get_name(), rosgraph.Master("/test")
    topics = set()
    for name in nodes:
        uri = rosnode.get_api_uri(master, name)
        if uri is None:
            continue  # a navigator in the simulator's process is no node
        with ServerProxy(uri) as node:
            _, _, connections = node.getBusInfo(here)
        topics.update(
            topic
            for _, destination, direction, _, topic, *_ in connections
            if (direction, destination) == ("o", here)
        )
    return topics


def pid_of(name):
    """None if no node with this name responds."""
    try:
        uri = rosnode.get_api_uri(rosgraph.Master("/test"), name, skip_cache=True)
        return ServerProxy(uri).getPid("/test")[2] if uri else None
    except OSError:
        return None  # the dead node's address is still registered


def trigger(name):
    """Call a service without arguments, and return its message."""
    rospy.wait_for_service(name, PATIENCE_S)
    answer = rospy.ServiceProxy(name, Trigger)()
    if not answer.success:
        raise AssertionError(f"{name}: {answer.message}")
    return answer.message


class Latest:
    """The last message of a topic, and how many there were."""

    def __init__(self, topic, message_type):
        self.message = None
        self.count = 0
        self._received = threading.Event()
        self._subscriber = rospy.Subscriber(topic, message_type, self._store, queue_size=100)

    def _store(self, message):
        self.message = message
        self.count += 1
        self._received.set()

    def wait(self):
        """Until there is a message."""
        if not self._received.wait(PATIENCE_S):
            raise AssertionError(f"nothing on {self._subscriber.resolved_name}")


class Record:
    """Every message of a topic, and when it came in simulated seconds."""

    def __init__(self, topic, message_type):
        self.messages = []
        self.times_s = []
        self._subscriber = rospy.Subscriber(topic, message_type, self._store, queue_size=1000)

    def _store(self, message):
        self.times_s.append(rospy.get_time())
        self.messages.append(message)

    def rate_hz(self):
        return rate_hz(self.stamps_s())

    def stamps_s(self):
        """Stamps of the messages; times of arrival for messages without a stamp."""
        stamps_s = [
            message.header.stamp.to_sec() if message._has_header else 0.0
            for message in self.messages
        ]
        return [stamp_s or came_s for stamp_s, came_s in zip(stamps_s, self.times_s)]

    def close(self):
        self._subscriber.unregister()


def rate_hz(times_s):
    """By the median of the periods, because a loaded machine leaves some cycles out."""
    return 1.0 / float(np.median(np.diff(times_s)))


class FlightCase(unittest.TestCase):
    """Two quadcopters with a running simulation and odometry."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_flight", anonymous=True)
        cls.odometry = [Latest(f"/odom{i}", Odometry) for i in (0, 1)]
        cls.command = [Latest(f"/cmd_vel{i}", Twist) for i in (0, 1)]
        cls.goal_topics = [
            rospy.Publisher(f"/move_base_simple/goal{i}", PoseStamped, queue_size=1) for i in (0, 1)
        ]
        cls.cancel_topics = [
            rospy.Publisher(f"/move_base{i}/cancel", GoalID, queue_size=1) for i in (0, 1)
        ]
        cls.clients = [
            actionlib.SimpleActionClient(f"/move_base{i}", MoveBaseAction) for i in (0, 1)
        ]

    @classmethod
    def start(cls):
        """Simulation running, odometry heard, navigators that hear goals and send results here."""
        trigger("/simulation/start")
        for client in cls.clients:
            if not client.wait_for_server(rospy.Duration(PATIENCE_S)):
                raise AssertionError(f"no action server for {client.action_client.ns}")
        for odometry in cls.odometry:
            odometry.wait()
        for topic in cls.goal_topics + cls.cancel_topics:
            cls.wait(lambda t=topic: t.get_num_connections() > 0, f"a listener on {topic.name}")
        cls.wait(
            lambda: {f"/move_base{i}/result" for i in (0, 1)} <= topics_sent_here(),
            "navigators that send their results",
        )

    wait = staticmethod(wait)

    def record(self, topic, message_type, nodes=PUBLISHERS):
        record = Record(topic, message_type)
        self.addCleanup(record.close)
        self.wait(lambda: topic in topics_sent_here(nodes), f"a publisher that sends {topic}")
        return record

    def simulated_seconds(self, seconds):
        """Lets simulated time pass."""
        end = rospy.get_time() + seconds
        self.wait(lambda: rospy.get_time() >= end, f"{seconds} simulated seconds")

    def read_result(self, path, patience_s=PATIENCE_S):
        """The sequencer's summary, once it has been written."""
        self.addCleanup(lambda: os.path.exists(path) and os.remove(path))
        self.wait(lambda: os.path.exists(path), "the summary", patience_s)
        with open(path, encoding="utf-8") as file:
            return json.load(file)

    def position(self, i):
        p = self.odometry[i].message.pose.pose.position
        return p.x, p.y

    def distance(self, i, x, y):
        px, py = self.position(i)
        return ((px - x) ** 2 + (py - y) ** 2) ** 0.5

    def speed(self, i):
        v = self.odometry[i].message.twist.twist.linear
        return (v.x**2 + v.y**2) ** 0.5


def goal_pose(x, y, w=1.0, frame="map"):
    """A goal with yaw 0, or a broken one with another w."""
    goal = PoseStamped()
    goal.header.frame_id = frame
    goal.header.stamp = rospy.Time.now()
    goal.pose.position.x, goal.pose.position.y = x, y
    goal.pose.orientation.w = w
    return goal


def action_goal(x, y, **keywords):
    return MoveBaseGoal(goal_pose(x, y, **keywords))
