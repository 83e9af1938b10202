#!/usr/bin/env python3
"""Planners that change in flight: the robot stops, plans anew and reaches its goal."""

import rospy
import rosservice
import rostest
from actionlib_msgs.msg import GoalStatus
from flight_case import PATIENCE_S, goal_pose
from geometry_msgs.msg import Twist
from nav_msgs.msg import Path
from upstream_case import UpstreamCase

PLACES = ((1.5, 1.5), (3.0, 6.5))
LOCAL, GLOBAL = "base_local_planner", "base_global_planner"
DWA = {LOCAL: "dwa_local_planner/DWAPlannerROS"}
TRAJECTORY = {LOCAL: "base_local_planner/TrajectoryPlannerROS"}
SEARCH, NAVFN = {GLOBAL: "global_planner/GlobalPlanner"}, {GLOBAL: "navfn/NavfnROS"}
FLIGHTS = 2 * (DWA, SEARCH, TRAJECTORY, NAVFN, {**DWA, **SEARCH}, {**TRAJECTORY, **NAVFN})
NAMES = {
    name: name.split("/")[1]
    for planner in (DWA, TRAJECTORY, SEARCH, NAVFN)
    for name in planner.values()
}


class PlannerSwitch(UpstreamCase):
    def setUp(self):
        self.rest(0)
        self.in_force = {**TRAJECTORY, **NAVFN}
        self.node = self.client("/move_base0")

    def served(self):
        """The namespaces of planners that have dynamic_reconfigure, and those with make_plan."""
        found = rosservice.get_service_list(namespace="/move_base0")
        return [
            {name for name in NAMES.values() if f"/move_base0/{name}/{service}" in found}
            for service in ("set_parameters", "make_plan")
        ]

    def expected(self):
        local, search = NAMES[self.in_force[LOCAL]], NAMES[self.in_force[GLOBAL]]
        own = {search} if search == "GlobalPlanner" else set()  # NavfnROS has no parameters there
        return [{local} | own, {search}]

    def fly_with_a_change(self, change):
        """Change planners on the way to the farther place: a stop, a plan, and the goal."""
        place = max(PLACES, key=lambda place: self.distance(0, *place))
        count = self.results[0].count
        self.send(0, goal_pose(*place))
        self.wait(lambda: self.speed(0) > 0.1, "robot 0 under way")
        commands = self.record("/cmd_vel0", Twist)
        answer = self.node.update_configuration(change)
        self.in_force.update(change)
        self.assertEqual({key: answer[key] for key in change}, change)
        self.wait(lambda: Twist() in commands.messages, "a stop")
        self.assertEqual(self.results[0].count, count, "reached before the change")
        self.wait(lambda: self.served() == self.expected(), f"the services of {change}")
        plan = f"/move_base0/{NAMES[self.in_force[GLOBAL]]}/plan"
        self.assertTrue(rospy.wait_for_message(plan, Path, PATIENCE_S).poses)
        followed = f"/move_base0/{NAMES[self.in_force[LOCAL]]}/global_plan"
        self.assertTrue(rospy.wait_for_message(followed, Path, PATIENCE_S).poses)
        status = self.result_after(0, count).status
        self.assertEqual(status.status, GoalStatus.SUCCEEDED, f"{change}: {status.text}")
        self.assertLess(self.distance(0, *place), 0.3)
        commands.close()

    def test_twelve_flights(self):
        rospy.set_param("/move_base0/DWAPlannerROS/max_vel_x", 0.35)
        for change in ({**DWA, **SEARCH}, {**TRAJECTORY, **NAVFN}):
            self.node.update_configuration(change)  # loads their kernels while nothing flies
        for change in FLIGHTS:
            self.fly_with_a_change(change)
        self.assertEqual(rospy.get_param("/move_base0/DWAPlannerROS/max_vel_x"), 0.35)

    def test_an_unknown_planner_leaves_those_in_force(self):
        answer = self.node.update_configuration({LOCAL: "teb_local_planner/TebLocalPlannerROS"})
        self.assertEqual(answer[LOCAL], self.in_force[LOCAL])
        self.assertEqual(self.served(), self.expected())


if __name__ == "__main__":
    rostest.rosrun("quad", "planner_switch", PlannerSwitch)
