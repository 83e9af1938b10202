"""Base of the tests against recordings of C++ move_base: recordings, and messages with times.

Each test names the intended differences; ``OURS`` has the names of the action's topics.
"""

from __future__ import annotations

import os

import rospy
import yaml
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from dynamic_reconfigure.client import Client
from flight_case import PATIENCE_S, FlightCase, Latest
from move_base_msgs.msg import MoveBaseActionFeedback, MoveBaseActionResult
from nav_msgs.msg import OccupancyGrid

FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "upstream")
ROBOTS = (0, 1)

# With the tutorial's remaps the robots share the action's topics but for the goal, and a cancel
# stops them all. On purpose the launch files here give each robot its own.
OURS = {
    "/move_base/goal{i}": "/move_base{i}/goal",
    **{
        f"/move_base/{name}": f"/move_base{{i}}/{name}"
        for name in ("cancel", "feedback", "recovery_status", "result", "status")
    },
}
UNFINISHED = (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)


def recorded_lines(name, i):
    """The words of each line of a recording, with our names for robot i."""
    with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
        rows = [line.split() for line in file]
    return [[OURS.get(row[0], row[0]).format(i=i), *row[1:]] for row in rows]


def recorded_yaml(name, i):
    with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
        return yaml.safe_load(file.read().replace("{i}", str(i)))


class UpstreamCase(FlightCase):
    """Two quadcopters with the tutorial's parameters, and the messages of their actions."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.results = [Latest(f"/move_base{i}/result", MoveBaseActionResult) for i in ROBOTS]
        cls.statuses = [Latest(f"/move_base{i}/status", GoalStatusArray) for i in ROBOTS]
        cls.feedback = [Latest(f"/move_base{i}/feedback", MoveBaseActionFeedback) for i in ROBOTS]
        cls.start()

    def rest(self, i):
        """Cancel robot i's goal, if it has one, and wait until it has stopped.

        A cancel without a goal leaves no trace: it could arrive late and cancel the next goal.
        """
        topic, now = self.cancel_topics[i], rospy.Time.now()
        self.wait(lambda: topic.get_num_connections() > 0, f"a listener on {topic.name}")
        self.wait(lambda: self.is_newer(i, now), f"a status of robot {i}")
        if not self.is_idle(i):
            topic.publish(GoalID())
            self.wait(lambda: self.is_idle(i), f"robot {i} without a goal")
            self.simulated_seconds(0.5)  # the result comes on a connection of its own
        self.wait(lambda: self.speed(i) < 0.02, f"robot {i} standing")

    def is_newer(self, i, time):
        """The last status is half a second younger: a goal sent before is in it."""
        message = self.statuses[i].message
        return message is not None and message.header.stamp > time + rospy.Duration(0.5)

    def is_idle(self, i):
        """No goal is waiting or active."""
        return all(s.status not in UNFINISHED for s in self.statuses[i].message.status_list)

    def send(self, i, goal):
        topic = self.goal_topics[i]
        self.wait(lambda: topic.get_num_connections() > 0, f"a listener on {topic.name}")
        topic.publish(goal)

    def result_after(self, i, count, patience_s=PATIENCE_S):
        """The next result after the first ``count``."""
        self.wait(lambda: self.results[i].count > count, f"a result of robot {i}", patience_s)
        return self.results[i].message

    def next_feedback(self, i):
        """A feedback that has just come, so that a control cycle is just over."""
        count = self.feedback[i].count
        self.wait(lambda: self.feedback[i].count > count, f"feedback of robot {i}")
        return self.feedback[i].message.feedback.base_position

    def global_costmap(self, i):
        """The whole grid, which every new listener is sent."""
        return rospy.wait_for_message(
            f"/move_base{i}/global_costmap/costmap", OccupancyGrid, PATIENCE_S
        )

    def client(self, namespace):
        client = Client(namespace, timeout=PATIENCE_S)
        self.addCleanup(client.close)
        return client

    def reconfigure(self, namespace, **changes):
        """Changes parameters until the end of the test; what is in force then."""
        client = self.client(namespace)
        before = client.get_configuration(PATIENCE_S)
        self.addCleanup(client.update_configuration, {name: before[name] for name in changes})
        return client.update_configuration(changes)
