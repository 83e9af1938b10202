#!/usr/bin/env python3
"""Hostile messages in flight: no node dies, each is logged, and the mission goes on to its end."""

import collections
import math
import re
import time

import numpy as np
import rospy
import rostest
from dynamic_reconfigure.client import Client
from flight_case import PATIENCE_S, FlightCase, Latest, pid_of
from hostile import KINDS, NAVIGATORS, SEQUENCER, SIMULATOR, UNREADABLE
from nav_msgs.msg import Odometry
from own_messages import event_of
from quad.msg import MissionEvent
from rosgraph_msgs.msg import Log

from quad_nav.mission.actions import Event

NODES = (SIMULATOR, SEQUENCER, *NAVIGATORS)
LONGEST_HOVER_S = {0: 8.0, 1: 2.5}  # simulated time; robot 1 receives no hostile message
LOGS_WITHIN_S = 10.0  # wall time, as the next
PERIOD_S = 0.1  # simulated
COMPILES_S = 240.0  # without a cache of compiled kernels
MOST_LINES = 3  # of a node about one kind
MOST_LINES_IN_ALL = 10  # of a node, those about goals that it sends again included
LONGEST_LINE = 2000


def is_about(kind, line):
    return line.name in kind.logged and re.search(kind.logged[line.name], line.msg) is not None


def listeners(publisher):
    """Names of the nodes that are connected."""
    return {connection.endpoint_id for connection in publisher.impl.connections}


class FromSimulator(Latest):
    """The last message of the simulator, beside those that the test publishes itself.

    Attributes:
        moving_s: Simulated times at which the robot moved.
    """

    def __init__(self, topic, message_type):
        self.moving_s = []
        super().__init__(topic, message_type)

    def _store(self, message):
        if message._connection_header["callerid"] != SIMULATOR:
            return
        twist = message.twist.twist
        if math.hypot(twist.linear.x, twist.linear.y) > 0.05 or abs(twist.angular.z) > 0.1:
            self.moving_s.append(message.header.stamp.to_sec())
        super()._store(message)

    def longest_hover_s(self, begin_s, end_s):
        """Return the longest time without motion in an interval."""
        moving_s = [t for t in list(self.moving_s) if begin_s < t < end_s]
        return float(np.max(np.diff([begin_s, *moving_s, end_s])))


class HostileMessages(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.odometry = [FromSimulator(f"/odom{i}", Odometry) for i in (0, 1)]
        cls.events, cls.lines = [], []
        cls.subscribers = [
            rospy.Subscriber("/quad/events", MissionEvent, cls.store_event),
            rospy.Subscriber("/rosout", Log, cls.store_line, queue_size=1000),
        ]

    @classmethod
    def store_event(cls, message):
        cls.events.append(event_of(message))

    @classmethod
    def store_line(cls, line):
        if line.level >= Log.WARN:
            cls.lines.append((time.monotonic(), line))

    def test_the_mission_survives(self):
        self.wait(lambda: self.subscribers[1].get_num_connections() >= len(NODES), "the logs")
        self.wait(lambda: all(o.message is not None for o in self.odometry), "odometry")
        self.wait_for_flight("at first", COMPILES_S)
        self.pids = {node: pid_of(node) for node in NODES}
        self.assertEqual(self.problems(), [])
        Client("/simulator", timeout=PATIENCE_S).update_configuration({"rate": 8.0})
        self.check_result(self.read_result(rospy.get_param("~result"), patience_s=400.0))
        self.assertEqual(self.dead_nodes(), [])

    def problems(self):
        """Publish messages of all kinds and return what they broke."""
        begin, begin_s = len(self.lines), rospy.get_time()
        self.publish(list(KINDS.values()))
        self.wait_for_lines(begin)
        self.publish([UNREADABLE])
        found = [f"{node} is not the process that it was" for node in self.dead_nodes()]
        if found:
            return found
        self.wait_for_flight("afterwards")
        for i, limit_s in LONGEST_HOVER_S.items():
            hover_s = self.odometry[i].longest_hover_s(begin_s, rospy.get_time())
            if hover_s > limit_s:
                found.append(f"robot {i} hovered for {hover_s:.1f} s")
        found += [
            f"{node} logged {count} lines about {name}"
            for name, kind in KINDS.items()
            for node, count in self.counts(kind, begin).items()
            if not 1 <= count <= MOST_LINES
        ]
        in_all = collections.Counter(line.name for _, line in self.lines[begin:])
        found += [
            f"{node} logged {count} lines in all"
            for node, count in in_all.items()
            if count > MOST_LINES_IN_ALL + MOST_LINES * len(KINDS)
        ]
        longest = max((len(line.msg) for _, line in self.lines[begin:]), default=0)
        if longest > LONGEST_LINE:
            found.append(f"a line of {longest} characters")
        return found + self.resent()

    def resent(self):
        """Goals that robot 1 got again, and those of a mission that was started again."""
        sent = [event for event in self.events if event.event is Event.SENT]
        first = [(event.robot, event.goal) for event in sent if not event.reason]
        found = [
            f"robot {i} goal {g} was sent anew" for i, g in set(first) if first.count((i, g)) > 1
        ]
        again = {event.reason for event in sent if event.robot == 1 and event.reason}
        return found + [f"robot 1 got its goal again: {why}" for why in again]

    def publish(self, kinds):
        publishers = [
            rospy.Publisher(kind.topic, kind.message_type, queue_size=100) for kind in kinds
        ]
        for kind, publisher in zip(kinds, publishers):
            self.wait(
                lambda p=publisher, k=kind: (
                    p.get_num_connections() and set(k.logged) <= listeners(p)
                ),
                f"{kind.topic}: listeners",
            )
        for period in range(max(round(kind.count * kind.period_s / PERIOD_S) for kind in kinds)):
            for kind, publisher in zip(kinds, publishers):
                sent, is_due = divmod(period, round(kind.period_s / PERIOD_S))
                if not is_due and sent < kind.count:
                    publisher.publish(kind.make())
            self.simulated_seconds(PERIOD_S)
        for publisher in publishers:
            publisher.unregister()

    def counts(self, kind, begin):
        """Lines about a kind by node."""
        lines = [line for _, line in self.lines[begin:] if is_about(kind, line)]
        return {node: sum(line.name == node for line in lines) for node in kind.logged}

    def wait_for_lines(self, begin):
        """Until every node has logged the kinds, or for a while."""
        end = time.monotonic() + LOGS_WITHIN_S
        self.wait(
            lambda: (
                all(all(self.counts(kind, begin).values()) for kind in KINDS.values())
                or time.monotonic() > end
            ),
            "the log",
        )

    def dead_nodes(self):
        return [node for node, pid in self.pids.items() if pid_of(node) != pid]

    def wait_for_flight(self, when, patience_s=PATIENCE_S):
        for i in (0, 1):
            self.wait(lambda i=i: self.speed(i) > 0.15, f"robot {i} under way {when}", patience_s)

    def check_result(self, result):
        self.assertTrue(result["success"], result)
        self.assertEqual(result["contacts"], [])
        for robot in result["robots"]:
            self.assertTrue(all(goal["reached"] for goal in robot["goals"]), robot)
            self.assertLess(robot["path_length_m"], 1.5 * robot["straight_length_m"])
        # A hostile goal that is aborted just after the sequencer's can cost robot 0 an attempt.
        attempts = [goal["attempts"] for goal in result["robots"][1]["goals"]]
        self.assertEqual(set(attempts), {1})
        self.assertEqual(self.resent(), [])


if __name__ == "__main__":
    rostest.rosrun("quad", "hostile_messages", HostileMessages)
