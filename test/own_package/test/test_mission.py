#!/usr/bin/env python3
"""Both quadcopters reach their goals."""

import unittest

import rospy
import rostest
from quad.msg import MissionEvent


class Mission(unittest.TestCase):
    def test_every_goal_is_reached(self):
        rospy.init_node("test_mission")
        events = []
        rospy.Subscriber("/quad/events", MissionEvent, events.append)
        while sum(event.event == MissionEvent.DONE for event in list(events)) < 2:
            rospy.sleep(0.1)  # the launch file limits the time
        reached = {(e.robot, e.goal) for e in events if e.event == MissionEvent.REACHED}
        self.assertEqual(reached, {(0, 0), (0, 1), (1, 0)})


if __name__ == "__main__":
    rostest.rosrun("my_drones", "mission", Mission)
