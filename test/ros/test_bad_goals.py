#!/usr/bin/env python3
"""Invalid goal files: all faults reported, exit status 2, no robot flies."""

import rospy
import rostest
from flight_case import FlightCase


class BadGoals(FlightCase):
    def test_every_fault_is_named_and_nothing_flies(self):
        result = self.read_result(rospy.get_param("~result"))
        self.assertEqual(result["exit_status"], 2)
        problems = "\n".join(result["problems"])
        self.assertIn(
            "quad0_goals.json: goals[1] (goal 2): (2.2, 4) is inside an obstacle", problems
        )
        self.assertIn(
            "quad1_goals.json: gaols: is not a key of goal files; expected goals", problems
        )
        self.wait(lambda: self.odometry[0].message is not None, "odometry")
        self.wait(lambda: rospy.get_time() > 0.0, "the clock")
        self.assertEqual(rospy.get_time(), 1.0)  # the simulator's clock before the start
        self.assertEqual([command.count for command in self.command], [0, 0])


if __name__ == "__main__":
    rostest.rosrun("quad", "bad_goals", BadGoals)
