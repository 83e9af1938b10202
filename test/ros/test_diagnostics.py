#!/usr/bin/env python3
"""All nodes publish on /diagnostics, also while paused, and log changes of level."""

import re
import time

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from flight_case import FlightCase, goal_pose, trigger
from rosgraph_msgs.msg import Log
from std_srvs.srv import SetBool

OK, ERROR, STALE = DiagnosticStatus.OK, DiagnosticStatus.ERROR, DiagnosticStatus.STALE
NAVIGATORS = {f"move_base{i}: {part}" for i in (0, 1) for part in ("control", "inputs", "loop")}
CHANGE = re.compile(r"quad0: inputs: (\w+) -> (\w+)(.*)")
ALL = NAVIGATORS | {"simulator: clock", "simulator: quadcopter 0", "simulator: quadcopter 1"}


class Diagnostics(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.statuses, cls.log, cls.arrivals = {}, [], []
        cls.subscribers = [
            rospy.Subscriber("/diagnostics", DiagnosticArray, cls.store, queue_size=100),
            rospy.Subscriber("/rosout", Log, lambda line: cls.log.append(line.msg), queue_size=100),
        ]
        cls.start()

    @classmethod
    def store(cls, array):
        for status in array.status:
            cls.statuses[status.name] = status
            if status.name == "move_base0: inputs":
                cls.arrivals.append(time.monotonic())

    def level(self, name):
        return self.statuses[name].level if name in self.statuses else None

    def value(self, name, key):
        return {pair.key: pair.value for pair in self.statuses[name].values}[key]

    def changes(self):
        """Levels before and after, and the message, of each logged change of robot 0's inputs."""
        found = [CHANGE.match(line) for line in self.log]
        return [match.groups() for match in found if match]

    def logged_scan_lost_and_back(self):
        changes = self.changes()
        lost = [change for change in changes if "no message on /scan0" in change[2]]
        return ("OK", "ERROR") in [change[:2] for change in lost] and changes[-1][1] == "OK"

    def test_1_every_node_publishes_its_status(self):
        self.wait(lambda: set(self.statuses) >= ALL, f"all of {sorted(ALL)}")
        self.wait(
            lambda: all(self.level(f"move_base{i}: inputs") == OK for i in (0, 1)),
            "inputs that come",
        )
        for i in (0, 1):
            self.assertEqual(self.statuses[f"move_base{i}: inputs"].hardware_id, f"quad{i}")

    def test_2_a_flight_with_a_lidar_timeout(self):
        self.goal_topics[0].publish(goal_pose(self.position(0)[0], 6.5))
        self.wait(lambda: self.value("move_base0: control", "state") == "controlling", "a flight")
        self.lidar(0, False)
        self.wait(lambda: self.level("move_base0: inputs") == ERROR, "an error of its inputs")
        self.assertIn("no message on /scan0 for", self.statuses["move_base0: inputs"].message)
        self.wait(lambda: self.level("move_base0: control") == ERROR, "a navigator that stopped")
        self.assertIn("stopping: no data from", self.statuses["move_base0: control"].message)
        self.wait(lambda: self.level("move_base1: inputs") == OK, "inputs of the other one")
        self.lidar(0, True)
        self.wait(lambda: self.level("move_base0: inputs") == OK, "inputs that come again")
        self.wait(lambda: self.level("move_base0: control") == OK, "a flight that resumes")
        self.assertIn("stopping: no data from", self.value("move_base0: control", "last reason"))

    def test_3_each_change_of_level_is_one_line_in_the_log(self):
        """A busy machine may add changes of its own; no level is told twice in a row."""
        self.wait(self.logged_scan_lost_and_back, lambda: f"scan lost and back: {self.changes()}")
        changes = self.changes()
        self.assertEqual([new for _, new, _ in changes[:-1]], [old for old, _, _ in changes[1:]])

    def test_4_statuses_continue_while_the_simulation_is_paused(self):
        trigger("/simulation/pause")
        self.wait(lambda: self.statuses["simulator: clock"].message == "paused", "paused")
        before = len(self.arrivals)
        self.wait(lambda: len(self.arrivals) >= before + 3, "three messages more")
        self.assertEqual(self.level("move_base0: inputs"), OK)

    def lidar(self, i, on):
        answer = rospy.ServiceProxy(f"/simulation/lidar{i}/enable", SetBool)(on)
        self.assertTrue(answer.success, answer.message)


if __name__ == "__main__":
    rostest.rosrun("quad", "diagnostics", Diagnostics)
