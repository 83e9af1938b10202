#!/usr/bin/env python3
"""A flight on ROS and the same one offline: equal outcome, goal times within 5 %."""

from pathlib import Path

import rospy
import rostest
from flight_case import FlightCase

from quad_nav.mission.summary import to_json
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_facts import offline_facts
from quad_nav.scenario.flight_setup import FlightOptions, read_setup


class Offline(FlightCase):
    def test_goal_times_are_those_of_the_flight_on_ros(self):
        goals = Path(rospy.get_param("~goals"))
        options = FlightOptions(None, goals)
        setup = read_setup(options)
        offline = to_json(fly(setup))
        on_ros = self.read_result(rospy.get_param("~result"), patience_s=380.0)
        self.assertEqual((on_ros["success"], len(on_ros["contacts"])), (True, 0), on_ros)
        self.assertEqual((offline["success"], len(offline["contacts"])), (True, 0), offline)
        facts = offline_facts(options, setup)
        self.assertEqual(on_ros["command"][0], "rostest")
        for part in ("differences", "name"):
            self.assertEqual(on_ros["configuration"][part], facts["configuration"][part])
        self.assertEqual(on_ros["scene"]["size_m"], facts["scene"]["size_m"])
        self.assertEqual(on_ros["lidar"], facts["lidar"])
        for robot, twin in zip(on_ros["robots"], offline["robots"]):
            for goal, other in zip(robot["goals"], twin["goals"]):
                where = f"{robot['robot']} goal {goal['goal']}"
                self.assertEqual(goal["reached"], other["reached"], where)
                self.assertAlmostEqual(
                    goal["time_s"], other["time_s"], msg=where, delta=0.05 * goal["time_s"]
                )


if __name__ == "__main__":
    rostest.rosrun("quad", "offline", Offline)
