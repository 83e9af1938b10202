#!/usr/bin/env python3
"""A flight on ROS and the same one offline: equal outcome, goal times within 5 %.

Two goals of the second quadcopter have a yaw, and it stays at the first.
"""

from pathlib import Path

import rospy
import rostest
from flight_case import FlightCase
from own_messages import event_of
from quad.msg import MissionEvent

from quad_nav.mission.actions import Event
from quad_nav.mission.summary import to_json
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_facts import offline_facts
from quad_nav.scenario.flight_setup import FlightOptions, read_setup


class Offline(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.events = []
        cls.subscriber = rospy.Subscriber(
            "/quad/events", MissionEvent, lambda message: cls.events.append(event_of(message))
        )

    def check_the_stay(self):
        """The second goal of the second quadcopter is sent 5 s after the first was reached."""
        of_robot = [event for event in self.events if event.robot == 1]
        ended = next(one for one in of_robot if (one.event, one.goal) == (Event.REACHED, 0))
        sent = next(one for one in of_robot if (one.event, one.goal) == (Event.SENT, 1))
        self.assertAlmostEqual(sent.time_s - ended.time_s, 5.0, delta=0.5)

    def test_goal_times_are_those_of_the_flight_on_ros(self):
        goals = Path(rospy.get_param("~goals"))
        options = FlightOptions(None, goals)
        setup = read_setup(options)
        on_ros = self.read_result(rospy.get_param("~result"), patience_s=300.0)
        offline = to_json(fly(setup))
        self.assertEqual((on_ros["success"], len(on_ros["contacts"])), (True, 0), on_ros)
        self.assertEqual((offline["success"], len(offline["contacts"])), (True, 0), offline)
        facts = offline_facts(options, setup)
        self.assertEqual(on_ros["command"][0], "rostest")
        # A launch file also sets the robot's number and how many robots there are.
        offline_values, ros_values = (
            {
                (one["parameter"], str(one["value"]))
                for one in facts_of["configuration"]["differences"]
            }
            for facts_of in (facts, on_ros)
        )
        self.assertEqual(offline_values - ros_values, set())
        self.assertEqual(
            {name for name, _ in ros_values} - {name for name, _ in offline_values},
            {"robot", "robots"},
        )
        self.assertEqual(on_ros["configuration"]["name"], "default")
        self.assertEqual(on_ros["scene"]["size_m"], facts["scene"]["size_m"])
        self.assertEqual(on_ros["lidar"], facts["lidar"])
        self.assertAlmostEqual(
            on_ros["sim_time_s"], offline["sim_time_s"], delta=0.05 * offline["sim_time_s"]
        )
        first, _, last = on_ros["robots"][1]["goals"]
        self.assertEqual((first["wait_s"], first["yaw_rad"], last["yaw_rad"]), (5.0, 0.0, 1.0))
        for goal in (first, last):
            self.assertLessEqual(abs(goal["yaw_error_rad"]), 0.1, goal)
        self.check_the_stay()
        for robot, twin in zip(on_ros["robots"], offline["robots"]):
            for goal, other in zip(robot["goals"], twin["goals"]):
                where = f"{robot['robot']} goal {goal['goal']}"
                self.assertEqual(goal["reached"], other["reached"], where)
                self.assertAlmostEqual(
                    goal["time_s"], other["time_s"], msg=where, delta=0.05 * goal["time_s"]
                )


if __name__ == "__main__":
    rostest.rosrun("quad", "offline", Offline)
