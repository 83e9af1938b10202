#!/usr/bin/env python3
"""Navigators in the simulator's processes: interfaces, commands in time, a killed worker."""

import os
import signal

import dynamic_reconfigure.client
import rosgraph
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from flight_case import PATIENCE_S, FlightCase, goal_pose, pid_of, trigger
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool
from test_ros_topics import absent

ROBOTS, SEPARATE = 5, 2
OF_NODES = ("get_loggers", "set_logger_level", "tf2_frames")  # services of a node, not of a robot
NODES = {0: "/simulator", 1: "/fleet1", 2: "/move_base2", 3: "/simulator", 4: "/fleet1"}


def names_of(robot, kind):
    """What a robot's node publishes (0), hears (1) or serves (2) for it, without its number."""
    return {
        name.replace(str(robot), "{i}", 1)
        for name, nodes in rosgraph.Master("/test").getSystemState()[kind]
        if NODES[robot] in nodes
        and not name.endswith(OF_NODES)
        and (name.startswith(f"/move_base{robot}/") or name == f"/move_base_simple/goal{robot}")
    }


class Composed(FlightCase):
    def test_1_the_interface_is_that_of_a_separate_navigator(self):
        self.wait(lambda: not absent(range(ROBOTS)), "every topic, subscription and service")
        for kind, count in ((0, 30), (1, 3), (2, 10)):
            separate = names_of(SEPARATE, kind)
            self.assertGreaterEqual(len(separate), count, separate)
            self.assertEqual(names_of(0, kind), separate)
            self.assertEqual(names_of(4, kind), separate)
        published = dict(rosgraph.Master("/test").getSystemState()[0])
        for robot, node in NODES.items():
            self.assertEqual(published[f"/cmd_vel{robot}"], [node])
            scanner = "/simulator" if robot == SEPARATE else node
            self.assertEqual(published[f"/scan{robot}"], [scanner])

    def test_2_commands_are_in_time_and_those_of_others_are_dropped(self):
        self.wait(lambda: rospy.get_time() > 2.0, "a flight under way")
        commands = [self.record(f"/cmd_vel{i}", Twist, [NODES[i]]) for i in (0, 4)]
        scans = self.record("/scan4", LaserScan, [NODES[4]])
        lines = self.record("/rosout", Log, ["/simulator"]).messages
        # From then on the navigator holds the lease of its robot.
        self.wait(lambda: all(len(one.messages) > 5 for one in commands), "commands")
        intruder = rospy.Publisher("/cmd_vel4", Twist, queue_size=1)
        self.wait(
            lambda: (
                intruder.publish(Twist())
                or any("dropped: /fleet1 controls" in line.msg for line in lines)
            ),
            "the simulator drops commands of another node",
        )
        intruder.unregister()
        counts, begin_s = [len(record.messages) for record in commands], rospy.get_time()
        self.simulated_seconds(8.0)
        cycles = 10.0 * (rospy.get_time() - begin_s)
        for record, count in zip(commands, counts):  # a busy machine leaves some out, or is late
            self.assertLess(len(record.messages) - count, cycles + 6)
            self.assertGreater(len(record.messages) - count, 0.5 * cycles)
        self.assertAlmostEqual(scans.rate_hz(), 10.0, delta=0.1)

    def test_3_parameters_costmaps_and_diagnostics(self):
        client = dynamic_reconfigure.client.Client(
            "/move_base4/TrajectoryPlannerROS", timeout=PATIENCE_S
        )
        self.assertEqual(client.update_configuration({"sim_time": 1.2})["sim_time"], 1.2)
        grid = rospy.wait_for_message(
            "/move_base4/global_costmap/costmap", OccupancyGrid, PATIENCE_S
        )
        self.assertEqual(grid.header.frame_id, "map")
        self.assertIn(100, grid.data)
        seen = set()
        subscriber = rospy.Subscriber(
            "/diagnostics", DiagnosticArray, lambda array: seen.update(s.name for s in array.status)
        )
        expected = {"simulator: loop", "fleet1: loop", "move_base4: control", "move_base0: inputs"}
        self.wait(lambda: expected <= seen, lambda: f"{expected} in {seen}")
        subscriber.unregister()

    def test_4_a_switched_off_lidar_and_a_pause(self):
        rospy.ServiceProxy("/simulation/lidar4/enable", SetBool)(False)
        scans = self.record("/scan4", LaserScan, [NODES[4]])
        count = len(scans.messages)
        self.simulated_seconds(1.0)
        self.assertLessEqual(len(scans.messages), count + 1)
        rospy.ServiceProxy("/simulation/lidar4/enable", SetBool)(True)
        self.wait(lambda: len(scans.messages) > count + 1, "scans again")
        trigger("/simulation/pause")
        # A subscriber that comes while the simulation is paused gets the last scan.
        self.assertGreater(len(rospy.wait_for_message("/scan0", LaserScan, PATIENCE_S).ranges), 0)
        paused_s = rospy.get_time()  # the last message on /clock has come by now
        self.assertGreater(len(rospy.wait_for_message("/scan2", LaserScan, PATIENCE_S).ranges), 0)
        self.assertEqual(rospy.get_time(), paused_s)
        trigger("/simulation/start")

    def test_5_every_goal_is_reached_without_a_contact(self):
        result = self.read_result(rospy.get_param("~result"), patience_s=200.0)
        self.assertTrue(result["success"], result)
        self.assertEqual(len(result["robots"]), ROBOTS)
        self.assertEqual(result["contacts"], [])
        for robot in result["robots"]:
            self.assertTrue(all(goal["reached"] for goal in robot["goals"]), robot)
        # A node may steer a quadcopter that its navigator leaves alone.
        publisher = rospy.Publisher("/cmd_vel0", Twist, queue_size=1)
        forward = Twist()
        forward.linear.x = 0.2
        self.wait(lambda: publisher.publish(forward) or self.speed(0) > 0.1, "a command by hand")

    def test_6_a_killed_worker_is_started_again(self):
        """Last: its quadcopters hover in the way of others while it starts."""
        pid = pid_of("/fleet1")
        os.kill(pid, signal.SIGKILL)
        self.wait(lambda: pid_of("/fleet1") not in (None, pid), "/fleet1 back")
        self.wait(lambda: not absent((1, 4)), "its interfaces")
        goal = self.goal_topics[1]
        x, y = self.position(1)
        pose = goal_pose(x, y + (1.5 if y < 6.0 else -1.5))
        self.wait(lambda: goal.publish(pose) or self.speed(1) > 0.1, "one of its robots flying")


if __name__ == "__main__":
    rostest.rosrun("quad", "composed", Composed)
