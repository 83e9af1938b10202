#!/usr/bin/env python3
"""One thread for each quadcopter: what goes wrong in one does not touch the others."""

import json
import math
import os
import tempfile
import threading
import time
import unittest
from pathlib import Path

import rospy
import rostest
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseStamped, TransformStamped
from move_base_msgs.msg import MoveBaseActionResult
from nav_msgs.msg import Odometry
from own_messages import event_of
from quad.msg import MissionEvent
from std_srvs.srv import Trigger, TriggerResponse
from tf2_ros import StaticTransformBroadcaster

from quad_nav.mission import journal
from quad_nav.mission.actions import Event
from quad_nav.ros.common import readiness
from quad_nav.ros.sequencer.mission import MissionRunner
from quad_nav.scenario.mission_setup import read_setup

ROBOTS, LEGS = 3, 20
PERIOD_S, SPEED_MPS, SPACING_M = 0.025, 3.0, 5.0
LATE_S = 0.2  # delay of a result after the next goal
PATIENCE_S = 40.0


def goals_of(number):
    return [[SPACING_M * number, 1.5 * ((leg + 1) % 2)] for leg in range(LEGS)]


class Stub:
    """Quadcopter and navigator that flies straight; results come after the next goal, or late."""

    def __init__(self, number):
        self.number, self.x, self.y = number, SPACING_M * number, 0.0
        self.goal, self.status, self.waiting, self.count = None, None, None, 0
        self.sent = []
        self.odometry = rospy.Publisher(f"/odom{number}", Odometry, queue_size=10)
        action = f"/move_base{number}"
        self.result = rospy.Publisher(f"{action}/result", MoveBaseActionResult, queue_size=10)
        self.statuses = rospy.Publisher(f"{action}/status", GoalStatusArray, queue_size=10)
        rospy.Subscriber(f"/move_base_simple/goal{number}", PoseStamped, self.on_goal)

    def on_goal(self, message):
        self.sent.append(time.monotonic())
        self.goal = message.pose.position

    def message(self):
        message = Odometry()
        message.header.frame_id, message.header.stamp = f"odom{self.number}", rospy.Time.now()
        message.pose.pose.position.x, message.pose.pose.position.y = self.x, self.y
        message.pose.pose.orientation.w = 1.0
        return message

    def step(self):
        if self.goal is not None:
            self.count += 1
            goal_id = GoalID(rospy.Time.now(), f"/move_base{self.number}-{self.count}")
            if self.status is not None:
                old = GoalStatus(self.status.goal_id, GoalStatus.SUCCEEDED, "Goal reached.")
                self.waiting = time.monotonic() + LATE_S, old
            self.status = GoalStatus(goal_id, GoalStatus.ACTIVE, "")
            self.to, self.goal = self.goal, None
        if self.waiting is not None and time.monotonic() >= self.waiting[0]:
            self.result.publish(MoveBaseActionResult(status=self.waiting[1]))
            self.waiting = None
        if self.status is not None:
            dx, dy = self.to.x - self.x, self.to.y - self.y
            part = min(SPEED_MPS * PERIOD_S / max(math.hypot(dx, dy), 1e-9), 1.0)
            self.x, self.y = self.x + part * dx, self.y + part * dy
        self.odometry.publish(self.message())
        self.statuses.publish(GoalStatusArray(status_list=[self.status] if self.status else []))


class SequencerThreads(unittest.TestCase):
    is_over = False

    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_sequencer_threads")
        rospy.Service("/simulation/start", Trigger, lambda _: TriggerResponse(True, ""))
        tf = StaticTransformBroadcaster()
        transforms = [TransformStamped() for _ in range(ROBOTS)]
        for number, one in enumerate(transforms):
            one.header.frame_id, one.child_frame_id = "map", f"odom{number}"
            one.transform.rotation.w = 1.0
        tf.sendTransform(transforms)
        cls.tf = tf
        cls.events = []
        rospy.Subscriber("/quad/events", MissionEvent, lambda one: cls.events.append(event_of(one)))
        cls.stubs = [Stub(number) for number in range(ROBOTS)]
        cls.flight = threading.Thread(target=cls.fly, daemon=True)
        cls.flight.start()
        cls.runner = cls.mission(Path(tempfile.mkdtemp(prefix="quad_threads_")))

    @classmethod
    def tearDownClass(cls):
        cls.is_over = True
        cls.flight.join()

    @classmethod
    def mission(cls, folder):
        for number in range(ROBOTS):
            text = json.dumps({"goals": goals_of(number), "retries": 0})
            (folder / f"quad{number}_goals.json").write_text(text)
        cls.journal = folder / "journal"
        given = {"robots": ROBOTS, "goals": str(folder), "journal": str(cls.journal)}
        return MissionRunner(read_setup(given, "test", folder / "result.json", folder))

    @classmethod
    def fly(cls):
        while not cls.is_over:
            for stub in cls.stubs:
                stub.step()
            time.sleep(PERIOD_S)

    def advance_until(self, holds, what):
        """Run the mission's main loop until a condition holds."""
        end_s = time.monotonic() + PATIENCE_S
        while not holds():
            self.assertLess(time.monotonic(), end_s, f"{what}; {self.events}")
            self.runner.advance()
            self.runner.publish_progress()

    def ended(self, number):
        return [e.goal for e in self.events if e.event is Event.REACHED and e.robot == number]

    def test_the_others_fly_on(self):
        self.assertEqual(readiness.wait_for(self.runner.needs(), PATIENCE_S), [])
        self.runner.start()
        self.advance_until(lambda: self.ended(0) and self.ended(2), "the first goals")
        self.slow_disk()
        self.failure()
        self.advance_until(lambda: self.runner.is_done, "the end")
        self.check(self.runner.summary())

    def slow_disk(self):
        """Goals are sent while one access to the disk does not return."""
        fsync, begun, goes_on = os.fsync, threading.Event(), threading.Event()

        def slow(file):
            begun.set()
            goes_on.wait(2 * PATIENCE_S)
            fsync(file)

        journal.os.fsync = slow
        self.addCleanup(setattr, journal.os, "fsync", fsync)
        self.addCleanup(goes_on.set)
        self.advance_until(begun.is_set, "a journal that is written")
        before = [len(stub.sent) for stub in self.stubs]
        self.advance_until(
            lambda: all(len(stub.sent) > count for stub, count in zip(self.stubs, before)),
            "goals of all robots",
        )
        goes_on.set()

    def failure(self):
        def tick(*_):
            raise RuntimeError("a fault of this test")

        self.runner.robots[0].sequencer.tick = tick
        self.advance_until(lambda: "quad0" in self.runner._failures, "a failed thread")

    def check(self, summary):
        failed, *others = summary.robots
        self.assertEqual(failed.reason, "internal error: RuntimeError('a fault of this test')")
        self.assertEqual(summary.exit_status, 1)
        for robot in others:
            self.assertEqual(robot.reason, "")
            self.assertEqual(
                [(leg.reached, leg.attempts) for leg in robot.legs], [(True, 1)] * LEGS
            )
            self.assertLess(robot.path_length_m, 1.5 * LEGS)
        records = [json.loads(line) for line in self.journal.read_text().splitlines()]
        legs = [record["robot"] for record in records if record.get("leg")]
        self.assertEqual((legs.count("quad1"), legs.count("quad2")), (LEGS, LEGS))


if __name__ == "__main__":
    rostest.rosrun("quad", "sequencer_threads", SequencerThreads)
