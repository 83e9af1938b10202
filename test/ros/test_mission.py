#!/usr/bin/env python3
"""The tutorial's mission, from its launch file to the summary's last number."""

import rospy
import rostest
from flight_case import FlightCase

GOALS = ([(3.0, 6.5), (9.0, 5.5), (1.5, 9.0)], [(4.0, 3.5), (2.0, 9.0), (8.5, 5.0)])


class TutorialMission(FlightCase):
    def test_both_quadcopters_reach_all_goals(self):
        result = self.read_result(rospy.get_param("~result"), patience_s=380.0)
        self.assertEqual(len(result["robots"]), 2)
        for robot, goals in zip(result["robots"], GOALS):
            self.assertEqual([(g["x_m"], g["y_m"]) for g in robot["goals"]], goals)
            for goal in robot["goals"]:
                self.assertTrue(goal["reached"], goal)
            self.assertGreater(robot["path_length_m"], 0.9 * robot["straight_length_m"] - 1.2)
            self.assertGreater(robot["min_clearance_m"], 0.0)


if __name__ == "__main__":
    rostest.rosrun("quad", "mission", TutorialMission)
