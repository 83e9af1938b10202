#!/usr/bin/env python3
"""A fleet in two processes has the topics of single navigators and flies its mission."""

import dynamic_reconfigure.client
import rosgraph
import rospy
import rosservice
import rostest
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from flight_case import PATIENCE_S, FlightCase, Latest
from geometry_msgs.msg import PoseStamped
from nav_msgs.srv import GetPlan
from test_ros_topics import absent, services

from quad_nav.scenario.random_mission import random_mission

ROBOTS, SEED = 4, 3


class Fleet(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for i in range(ROBOTS):
            rospy.wait_for_service(f"/move_base{i}/make_plan", timeout=PATIENCE_S)

    def test_1_every_robot_has_all_topics_and_services(self):
        self.wait(lambda: not absent(range(ROBOTS)), "every topic, subscription and service")
        for i in range(ROBOTS):
            for name, kind in services(i).items():
                self.assertEqual(rosservice.get_service_type(name), kind, name)

    def test_2_a_flying_robot_makes_no_plans_for_others(self):
        statuses = [Latest(f"/move_base{i}/status", GoalStatusArray) for i in range(ROBOTS)]

        def active():
            return [
                i
                for i, status in enumerate(statuses)
                if status.message is not None
                and any(s.status == GoalStatus.ACTIVE for s in status.message.status_list)
            ]

        self.wait(active, "a robot with a goal")
        goal = PoseStamped()
        goal.header.frame_id, goal.pose.orientation.w = "map", 1.0
        with self.assertRaises(rospy.ServiceException):
            rospy.ServiceProxy(f"/move_base{active()[0]}/make_plan", GetPlan)(
                PoseStamped(), goal, 0.1
            )

    def test_3_robots_are_shared_between_the_hosts(self):
        published, _, _ = rosgraph.Master("/test").getSystemState()
        nodes = dict(published)
        for i in range(ROBOTS):
            self.assertEqual(nodes[f"/cmd_vel{i}"], [f"/fleet{i % 2}"])

    def test_4_parameters_are_on_the_server_and_can_be_changed(self):
        self.assertEqual(rospy.get_param("/move_base2/controller_frequency"), 10.0)
        size_m = random_mission(ROBOTS, SEED).scene.size_x_m
        self.assertEqual(rospy.get_param("/move_base2/global_costmap/width"), size_m)
        client = dynamic_reconfigure.client.Client(
            "/move_base2/TrajectoryPlannerROS", timeout=PATIENCE_S
        )
        self.assertEqual(client.update_configuration({"sim_time": 1.2})["sim_time"], 1.2)
        self.assertEqual(rospy.get_param("/move_base2/TrajectoryPlannerROS/sim_time"), 1.2)
        self.assertNotEqual(rospy.get_param("/move_base1/TrajectoryPlannerROS/sim_time"), 1.2)

    def test_9_every_goal_is_reached(self):
        result = self.read_result(rospy.get_param("~result"), patience_s=350.0)
        mission = random_mission(ROBOTS, SEED)
        self.assertEqual(len(result["robots"]), ROBOTS)
        for robot, goals in zip(result["robots"], mission.goals):
            self.assertEqual([(g["x_m"], g["y_m"]) for g in robot["goals"]], list(goals))
            self.assertTrue(all(g["reached"] for g in robot["goals"]), robot)
            self.assertGreater(robot["min_clearance_m"], 0.0)
            self.assertGreater(robot["min_separation_m"], 0.0)


if __name__ == "__main__":
    rostest.rosrun("quad", "fleet", Fleet)
