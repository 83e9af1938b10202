#!/usr/bin/env python3
"""Goals by action, by topic and of the fleet; one robot's cancel leaves the other alone."""

from collections import deque
from unittest import mock

import rospy
import rostest
from actionlib_msgs.msg import GoalID, GoalStatus
from flight_case import Latest, action_goal, goal_pose
from geometry_msgs.msg import Point, PointStamped, PoseStamped
from upstream_case import ROBOTS, UpstreamCase
from visualization_msgs.msg import MarkerArray

from quad_nav.ros.navigator.goal_server import GoalServer

FREE_PLACES = (((1.5, 1.5), (3.0, 6.5)), ((10.0, 2.0), (10.5, 10.0)))


class Goals(UpstreamCase):
    def setUp(self):
        for i in ROBOTS:
            self.rest(i)

    def test_goal_by_action_is_reached_and_succeeds(self):
        self.clients[0].send_goal(action_goal(2.3, 1.5))
        self.assertTrue(self.clients[0].wait_for_result(rospy.Duration(60)))
        self.assertEqual(self.clients[0].get_state(), GoalStatus.SUCCEEDED)
        self.assertEqual(self.clients[0].get_goal_status_text(), "Goal reached.")
        self.assertLess(self.distance(0, 2.3, 1.5), 0.2)

    def test_goal_by_topic_is_reached(self):
        count = self.results[1].count
        self.goal_topics[1].publish(goal_pose(9.2, 2.0))
        self.assertEqual(self.result_after(1, count).status.status, GoalStatus.SUCCEEDED)
        self.assertLess(self.distance(1, 9.2, 2.0), 0.2)

    def test_cancelling_one_does_not_stop_the_other(self):
        counts = [result.count for result in self.results]
        for i in ROBOTS:
            far = max(FREE_PLACES[i], key=lambda place, i=i: self.distance(i, *place))
            self.goal_topics[i].publish(goal_pose(*far))
        self.wait(lambda: all(self.speed(i) > 0.05 for i in (0, 1)), "both under way")
        self.cancel_topics[0].publish(GoalID())
        self.assertEqual(self.result_after(0, counts[0]).status.status, GoalStatus.PREEMPTED)
        self.wait(lambda: self.speed(0) < 0.02, "robot 0 standing")
        self.assertEqual(self.results[1].count, counts[1])
        self.wait(lambda: self.speed(1) > 0.05, "robot 1 still under way")

    def test_goal_that_arrives_during_a_poll_is_no_cancel_request(self):
        def arrive():
            actions.is_new_goal_available.return_value = True
            return True

        actions, navigator = mock.Mock(), mock.Mock()
        actions.is_new_goal_available.return_value = False
        actions.is_preempt_requested.side_effect = arrive
        server = GoalServer.__new__(GoalServer)
        server._server, server._simple_goals, server._status = actions, deque(), mock.Mock()
        server._untransformed = None
        with mock.patch.object(GoalServer, "_accept") as accept:
            server.poll(navigator, 1.0)
            server.poll(navigator, 1.05)
        actions.set_preempted.assert_not_called()
        self.assertTrue(accept.called)

    def test_goal_waits_until_the_node_is_connected_to_its_own_topic(self):
        server = GoalServer.__new__(GoalServer)
        server._server, server._action_goal = mock.Mock(), mock.Mock()
        server._simple_goals = deque([goal_pose(3.0, 3.0)])
        navigator = mock.Mock()
        navigator.accepts_goal.return_value = False
        server._action_goal.impl.has_connection.return_value = False
        server.poll(navigator, 1.0)
        server._action_goal.publish.assert_not_called()
        server._action_goal.impl.has_connection.return_value = True
        server.poll(navigator, 1.05)
        server.poll(navigator, 1.1)
        server._action_goal.publish.assert_called_once()

    def test_goal_of_the_fleet_goes_to_the_nearest_or_to_the_selected_robot(self):
        here, there = self.position(0), self.position(1)
        taken = [self.record(f"/move_base{i}/current_goal", PoseStamped) for i in (0, 1)]
        fleet = rospy.Publisher("/move_base_simple/goal", PoseStamped, queue_size=1)
        click = rospy.Publisher("/clicked_point", PointStamped, queue_size=1)
        for topic in (fleet, click):
            self.wait(lambda t=topic: t.get_num_connections() > 0, f"listener on {topic.name}")
        selection = Latest("/goal_router/selection", MarkerArray)

        fleet.publish(goal_pose(there[0] - 0.3, there[1]))
        self.wait(lambda: len(taken[1].messages) == 1, "robot 1 to get the goal near it")
        point = PointStamped(point=Point(here[0] + 0.2, here[1], 1.0))
        point.header.frame_id = "map"
        click.publish(point)
        selection.wait()
        self.assertEqual(selection.message.markers[-1].header.frame_id, "base_link0")
        fleet.publish(goal_pose(there[0] - 0.3, there[1]))
        self.wait(lambda: len(taken[0].messages) == 1, "robot 0, which is selected, to get it")
        self.assertEqual(len(taken[1].messages), 1)


if __name__ == "__main__":
    rostest.rosrun("quad", "goals", Goals)
