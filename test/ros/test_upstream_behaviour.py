#!/usr/bin/env python3
"""Compare goals, plans, cancels and recoveries with the recorded log of C++ move_base.

Intended differences:

* a goal in an empty or unknown frame is aborted at once; C++ move_base retries it for ever;
* a goal in another frame is transformed to the global one at once; C++ move_base publishes it as it
  arrived in ``current_goal`` until its transform is there;
* a search that fails is repeated once per control cycle, not as fast as it goes, and empties
  ``NavfnROS/plan`` for goals off the map too;
* a refused ``make_plan`` returns the reason; for a tolerance above 10 m there is no plan;
* a stop follows a rotation recovery; C++ move_base continues to rotate for planner_patience.
"""

import math
import re

import numpy as np
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from flight_case import PATIENCE_S, goal_pose
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import RecoveryStatus
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan
from std_srvs.srv import Empty
from upstream_case import UpstreamCase

FREE_PLACES = ((1.5, 1.5), (1.5, 6.4))  # of robot 0; a wall is near all the way between
OFF_THE_MAP = (20.0, 20.0)
PERIOD_S = 1.0  # of control, in the tutorial
RECOVERIES = [
    ("conservative_reset", 0, 4),
    ("rotate_recovery", 1, 4),
    ("aggressive_reset", 2, 4),
    ("rotate_recovery", 3, 4),
]


class UpstreamBehaviour(UpstreamCase):
    def setUp(self):
        self.rest(0)

    def far_place(self):
        return max(FREE_PLACES, key=lambda place: self.distance(0, *place))

    def fly_off(self):
        """Robot 0 on its way to the farther place, a control cycle just over: its pose."""
        self.send(0, goal_pose(*self.far_place()))
        self.wait(lambda: self.speed(0) > 0.05, "robot 0 under way")
        return self.next_feedback(0)

    def make_plan(self, x, y, tolerance=0.0, service="make_plan", frames=("map", "map"), w=1.0):
        """A plan; the frames are the start's and the goal's."""
        rospy.wait_for_service(f"/move_base0/{service}", PATIENCE_S)
        start = goal_pose(*self.position(0), frame=frames[0])
        goal = goal_pose(x, y, w, frames[1])
        proxy = rospy.ServiceProxy(f"/move_base0/{service}", GetPlan)
        return proxy(start, goal, tolerance).plan

    def obstacle_cells(self, nearest_m, farthest_m=math.inf):
        """Centres of the cells of seen obstacles within these distances of robot 0."""
        grid = self.global_costmap(0)
        cell_m = grid.info.resolution
        centres = [
            ((k % grid.info.width + 0.5) * cell_m, (k // grid.info.width + 0.5) * cell_m)
            for k, cost in enumerate(grid.data)
            if cost == 100
        ]
        return [at for at in centres if nearest_m < self.distance(0, *at) < farthest_m]

    def obstacle_cell(self):
        """Return the centre of the cell of an obstacle with most such cells around it.

        It is farther than 1 m away. A beam that grazes the obstacle may clear a cell, but not all
        around it, whose inflation then keeps the place lethal.
        """
        self.wait(lambda: self.obstacle_cells(1.0), "an obstacle")
        cells = np.array(self.obstacle_cells(1.0))
        distances_m = np.hypot(*(cells[:, np.newaxis] - cells).transpose(2, 0, 1))
        return cells[np.argmax((distances_m < 0.3).sum(axis=1))]

    def end_distance(self, path, x, y):
        last = path.poses[-1].pose.position
        return math.hypot(last.x - x, last.y - y)

    # -- make_plan -----------------------------------------------------------------

    def test_make_plan_while_idle(self):
        for service in ("make_plan", "NavfnROS/make_plan"):
            plans = self.record("/move_base0/NavfnROS/plan", Path)
            plan = self.make_plan(9.0, 5.5, service=service)
            of_planner = service != "make_plan"
            self.assertEqual(plan.header.frame_id, "map" if of_planner else "")
            self.assertEqual(not plan.header.stamp.is_zero(), of_planner)
            self.assertGreater(len(plan.poses), 100)
            self.assertEqual(self.end_distance(plan, 9.0, 5.5), 0.0)
            self.wait(lambda p=plans: len(p.messages) == 2, "the plan twice")
            self.assertEqual(
                [len(path.poses) for path in plans.messages], [len(plan.poses) - 1, len(plan.poses)]
            )
            plans.close()

    def test_make_plan_off_the_map_is_empty(self):
        self.assertEqual(self.make_plan(*OFF_THE_MAP).poses, [])

    def test_make_plan_answers_odd_requests_with_an_empty_plan(self):
        x, y = self.far_place()
        odd = (
            {"frames": ("map", "odom0")},
            {"frames": ("odom0", "map")},
            {"frames": ("map", "")},
            {"frames": ("map", "nowhere")},
            {"w": 0.0},
            {"tolerance": 20.0},
            {"tolerance": math.nan},
            {"frames": ("", "map"), "service": "NavfnROS/make_plan"},
        )
        for request in odd:
            with self.subTest(**request):
                self.assertEqual(self.make_plan(x, y, **request).poses, [])
        self.assertEqual(self.make_plan(math.nan, y).poses, [])
        self.assertTrue(self.make_plan(x, y, frames=("", "/map")).poses)

    def test_make_plan_into_an_obstacle_needs_a_tolerance(self):
        x, y = self.obstacle_cell()
        self.assertEqual(self.make_plan(x, y).poses, [])
        with_goal = self.make_plan(x, y, tolerance=1.0)  # make_plan_add_unreachable_goal
        self.assertEqual(self.end_distance(with_goal, x, y), 0.0)
        self.reconfigure("/move_base0", make_plan_add_unreachable_goal=False)
        near = self.make_plan(x, y, tolerance=1.0)
        self.assertLess(self.end_distance(near, x, y), 1.0 * math.sqrt(2.0))
        self.assertGreater(self.end_distance(near, x, y), 0.3)  # the radius is 0.35 m

    def test_make_plan_is_refused_while_a_goal_is_active(self):
        self.fly_off()
        with self.assertRaises(rospy.ServiceException):
            self.make_plan(9.0, 5.5)
        self.next_feedback(0)  # it flies on
        self.rest(0)
        self.assertTrue(self.make_plan(9.0, 5.5).poses)

    # -- clear_costmaps ------------------------------------------------------------

    def test_clear_costmaps_forgets_what_is_out_of_sight(self):
        """Marked within 2 m, cleared within 6: farther than 2 m only hidden obstacles are left.

        Here it is the far side of a box, farther away than 2.3 m. Beams that graze the box may
        clear it on the way: then the robot flies past once more.
        """
        beyond_m = 2.3
        for _ in range(5):
            place = self.far_place()  # on the other side of a box
            self.send(0, goal_pose(*place))
            self.wait(lambda at=place: self.distance(0, *at) < 0.3, "robot 0 elsewhere")
            self.rest(0)
            if self.obstacle_cells(beyond_m):
                break
        else:
            self.fail("no hidden obstacle after 5 flights")
        rospy.wait_for_service("/move_base0/clear_costmaps", PATIENCE_S)
        rospy.ServiceProxy("/move_base0/clear_costmaps", Empty)()
        self.wait(lambda: not self.obstacle_cells(beyond_m), "nothing far away")
        self.wait(lambda: self.obstacle_cells(0.3, beyond_m), "what the LIDAR sees")

    # -- cancel and preempt --------------------------------------------------------

    def assert_on_a_cycle(self, stamp, feedback):
        """A result is sent at a control cycle, one or two after the feedback."""
        cycles = (stamp - feedback.header.stamp).to_sec() / PERIOD_S
        self.assertGreater(cycles, 0.5)
        self.assertLess(cycles, 2.5)
        self.assertLess(abs(cycles - round(cycles)), 0.3)

    def test_cancel_takes_effect_at_the_next_cycle(self):
        commands = self.record("/cmd_vel0", Twist)
        feedback = self.fly_off()
        count = self.results[0].count
        self.cancel_topics[0].publish()
        result = self.result_after(0, count)
        self.assertEqual((result.status.status, result.status.text), (GoalStatus.PREEMPTED, ""))
        self.assert_on_a_cycle(result.header.stamp, feedback)
        self.wait(lambda: commands.messages and commands.messages[-1] == Twist(), "a stop")

    def test_new_goal_takes_over_at_the_next_cycle(self):
        goals = self.record("/move_base0/current_goal", PoseStamped)
        plans = self.record("/move_base0/NavfnROS/plan", Path)
        feedback = self.fly_off()
        count = self.results[0].count
        x, y = self.position(0)
        self.send(0, goal_pose(x, y + 0.5))
        result = self.result_after(0, count)
        self.assertEqual(result.status.status, GoalStatus.PREEMPTED)
        self.assertIn("because another goal was rec", result.status.text)
        self.assert_on_a_cycle(result.header.stamp, feedback)
        self.wait(lambda: len(goals.messages) == 2 and len(plans.messages) == 4, "the new plan")
        self.assertEqual(self.end_distance(plans.messages[3], x, y + 0.5), 0.0)

    # -- invalid goals -------------------------------------------------------------

    def test_invalid_goals(self):
        quaternion = "Aborting on goal because it was sent with an invalid quaternion"
        for keywords, text in (
            ({"w": 0.0}, quaternion),
            ({"frame": ""}, "its frame ''"),
            ({"frame": "nowhere"}, "its frame 'nowhere'"),
        ):
            count = self.results[0].count
            self.send(0, goal_pose(1.5, 2.5, **keywords))
            status = self.result_after(0, count).status
            self.assertEqual(status.status, GoalStatus.ABORTED)
            self.assertIn(text, status.text)

    def test_goal_in_the_robots_frame(self):
        goals = self.record("/move_base0/current_goal", PoseStamped)
        goal = goal_pose(0.5, 0.0, frame="base_link0")
        x, y = self.position(0)
        self.send(0, goal)
        self.wait(lambda: goals.messages, "current_goal")
        current = goals.messages[0]
        self.assertEqual(
            (current.header.frame_id, current.header.stamp), ("map", goal.header.stamp)
        )
        at = current.pose.position
        self.assertAlmostEqual(math.hypot(at.x - x, at.y - y), 0.5, delta=0.1)

    # -- recoveries ----------------------------------------------------------------

    def test_unreachable_goal(self):
        """The four recoveries in order, then the abort, after about 44 s at 10 Hz."""
        self.reconfigure("/simulator", rate=1.0)  # times are those of a machine that keeps up
        self.reconfigure("/move_base0", controller_frequency=10.0)
        recoveries = self.record("/move_base0/recovery_status", RecoveryStatus)
        commands = self.record("/cmd_vel0", Twist)
        count = self.results[0].count
        self.send(0, goal_pose(*OFF_THE_MAP))
        result = self.result_after(0, count)
        self.assertEqual(result.status.status, GoalStatus.ABORTED)
        self.assertEqual(
            result.status.text,
            "Failed to find a valid plan. Even after executing recovery behaviors.",
        )
        self.assertEqual(
            [
                (
                    status.recovery_behavior_name,
                    status.current_recovery_number,
                    status.total_number_of_recoveries,
                )
                for status in recoveries.messages
            ],
            RECOVERIES,
        )
        self.assertEqual(
            {status.pose_stamped.header.frame_id for status in recoveries.messages}, {"map"}
        )
        took_s = (result.header.stamp - result.status.goal_id.stamp).to_sec()
        self.assertAlmostEqual(took_s, 43.8, delta=4.0)
        self.assert_two_turns(commands.messages)

    def assert_two_turns(self, commands):
        """At ``max_vel_theta``, on the spot, each followed by a stop of half a second or more.

        On a loaded machine a late costmap may stop a turn for a moment.
        """
        self.assertEqual({(c.linear.x, c.angular.z) for c in commands}, {(0.0, 0.0), (0.0, 0.7)})
        turning = "".join("t" if command.angular.z else "-" for command in commands)
        turns = [turn for turn in re.split("-{5,}", turning) if turn]
        self.assertEqual(len(turns), 2, turning)
        self.assertTrue(turning.endswith("-"), turning)

    def test_goal_in_an_obstacle_has_empty_plans(self):
        place = self.obstacle_cell()
        plans = self.record("/move_base0/NavfnROS/plan", Path)
        self.send(0, goal_pose(*place))
        self.wait(lambda: len(plans.messages) >= 3, "three plans")
        for path in plans.messages:
            self.assertEqual((path.header.frame_id, path.poses), ("map", []))

    def test_oscillation(self):
        """Within 10 m for two seconds counts as such here: recoveries, or the abort without."""
        self.reconfigure("/move_base0", oscillation_timeout=2.0, oscillation_distance=10.0)
        recoveries = self.record("/move_base0/recovery_status", RecoveryStatus)
        count = self.results[0].count
        self.send(0, goal_pose(*self.far_place()))
        self.wait(lambda: recoveries.messages, "a recovery")
        self.assertEqual(recoveries.messages[0].recovery_behavior_name, "conservative_reset")
        self.reconfigure("/move_base0", recovery_behavior_enabled=False)
        status = self.result_after(0, count).status
        self.assertEqual(status.status, GoalStatus.ABORTED)
        self.assertEqual(
            status.text, "Robot is oscillating. Even after executing recovery behaviors."
        )


if __name__ == "__main__":
    rostest.rosrun("quad", "upstream_behaviour", UpstreamBehaviour)
