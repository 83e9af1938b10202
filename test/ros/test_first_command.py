#!/usr/bin/env python3
"""From a goal to its plan and to the first motion, in control periods of simulated time.

Upstream's planner thread wakes in the control cycle that takes the goal, so the next cycle is the
first to command. With `command_in_first_cycle` the cycle that takes the goal commands.
"""

import sys
from pathlib import Path as File

import rospy
import rostest
from flight_case import goal_pose, trigger
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import MoveBaseActionFeedback
from nav_msgs.msg import Path
from upstream_case import UpstreamCase

sys.path.insert(1, str(File(__file__).resolve().parents[1]))
from upstream import UPSTREAM  # noqa: E402

START = (1.5, 1.5)  # of robot 0, which faces the goal
GOAL = (2.8, 1.5)
OFF_THE_MAP = (20.0, 20.0)
# The other robot delays nothing here.
FIXED = {"fixes": {"upstream": False}, "peers": {"avoid_peers": False}}
RATE_HZ = 1.0
ROUNDING = 0.05  # of a control period


def stamps(feedback):
    """Times of the control cycles that sent feedback, in simulated seconds."""
    return [message.feedback.base_position.header.stamp.to_sec() for message in feedback.messages]


class FirstCommand(UpstreamCase):
    def setUp(self):
        self.rest(0)

    def measure(self, goal, rate_hz):
        """Control periods from taking the goal to its plan, and from there to the first motion.

        Times are those of the cycles: the feedback of the cycle that takes the goal, the stamp of
        the plan, and the stamp of the local plan whose command moves the robot.
        """
        feedback = self.record("/move_base0/feedback", MoveBaseActionFeedback)
        goals = self.record("/move_base0/current_goal", PoseStamped)
        plans = self.record("/move_base0/NavfnROS/plan", Path)
        moves = self.record("/move_base0/TrajectoryPlannerROS/local_plan", Path)
        commands = self.record("/cmd_vel0", Twist)
        self.send(0, goal)
        self.wait(lambda: goals.messages, "the goal taken")
        self.wait(lambda: any(path.poses for path in plans.messages), "a plan")
        plan_s = next(p.header.stamp.to_sec() for p in plans.messages if p.poses)
        after = plan_s - ROUNDING / rate_hz
        self.wait(lambda: any(s >= after for s in moves.stamps_s()), "a local plan")
        move_s = next(s for s in moves.stamps_s() if s >= after)
        self.wait(lambda: any(c != Twist() for c in commands.messages), "motion")
        self.wait(lambda: any(s >= after for s in stamps(feedback)), "feedback of the new goal")
        ids = [message.status.goal_id.stamp.to_sec() for message in feedback.messages]
        taken_s = min(
            cycle_s for cycle_s, stamp_s in zip(stamps(feedback), ids) if stamp_s == max(ids)
        )
        for record in (feedback, goals, plans, moves, commands):
            record.close()
        return (plan_s - taken_s) * rate_hz, (move_s - plan_s) * rate_hz

    def return_to_start(self):
        """From there the first cycle has a valid trajectory."""
        self.rest(0)
        trigger("/simulation/reset")
        self.wait(lambda: self.distance(0, *START) < 0.01, "robot 0 at its start")

    def check(self, before, fixes, periods):
        self.return_to_start()
        for group, values in fixes.items():
            self.reconfigure(f"/move_base0/{group}", **values)
        self.reconfigure("/move_base0", controller_frequency=RATE_HZ)
        before()
        to_plan, to_motion = self.measure(goal_pose(*GOAL), RATE_HZ)
        rospy.loginfo("plan after %.3f periods, motion after %.3f more", to_plan, to_motion)
        self.assertAlmostEqual(to_plan, 0.0, delta=ROUNDING)
        self.assertAlmostEqual(to_motion, periods, delta=ROUNDING)

    # -- what the robot does before ------------------------------------------------

    def fly_off(self):
        """To the same goal: at speed, a cycle may lack a valid trajectory to another."""
        self.send(0, goal_pose(*GOAL))
        self.wait(lambda: self.speed(0) > 0.05, "robot 0 under way")
        self.next_feedback(0)

    def abort(self):
        client = self.client("/move_base0")
        client.update_configuration({"planner_patience": 0.5, "recovery_behavior_enabled": False})
        count = self.results[0].count
        self.send(0, goal_pose(*OFF_THE_MAP))
        self.result_after(0, count)
        client.update_configuration({"planner_patience": 5.0, "recovery_behavior_enabled": True})

    # -- the tests -----------------------------------------------------------------

    def test_goal_from_idle(self):
        self.check(lambda: None, FIXED, 0)

    def test_goal_from_idle_as_upstream(self):
        self.check(lambda: None, UPSTREAM, 1)

    def test_goal_over_an_active_one(self):
        self.check(self.fly_off, FIXED, 0)

    def test_goal_over_an_active_one_as_upstream(self):
        self.check(self.fly_off, UPSTREAM, 1)

    def test_goal_after_an_abort(self):
        self.check(self.abort, FIXED, 0)

    def test_goal_after_an_abort_as_upstream(self):
        self.check(self.abort, UPSTREAM, 1)


if __name__ == "__main__":
    rostest.rosrun("quad", "first_command", FirstCommand)
