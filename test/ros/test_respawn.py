#!/usr/bin/env python3
"""Nodes killed and stopped in flight: hover, resume, no goal lost or flown twice."""

import os
import signal
import time

import rospy
import rostest
from flight_case import FlightCase, pid_of
from own_messages import event_of
from quad.msg import MissionEvent

from quad_nav.mission.actions import Event

STOPPED_S = 5.0  # wall time


class Respawn(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.events = []
        cls.subscriber = rospy.Subscriber(
            "/quad/events", MissionEvent, lambda message: cls.events.append(event_of(message))
        )

    def test_the_mission_survives(self):
        self.wait(lambda: self.odometry[0].message is not None, "odometry")
        self.wait_for_flight("at first")
        self.kill("/sequencer")
        self.wait_for_flight("after the sequencer's death")
        self.kill("/move_base0")
        self.wait(lambda: self.speed(0) < 0.02, "robot 0 hovering without a navigator")
        self.wait_for_flight("with another navigator")
        self.stop("/move_base0")
        self.wait_for_flight("with its navigator awake")
        result = self.read_result(rospy.get_param("~result"), patience_s=200.0)
        self.assertTrue(result["success"], result)
        for robot in result["robots"]:
            self.assertTrue(
                all(goal["reached"] and goal["attempts"] == 1 for goal in robot["goals"]), robot
            )
        self.assertEqual(sorted(self.events_of(Event.REACHED)), [(0, 0), (0, 1), (1, 0)])
        first_sent = self.events_of(Event.SENT, reason="")
        self.assertEqual(len(first_sent), len(set(first_sent)), first_sent)

    def wait_for_flight(self, when):
        self.wait(lambda: self.speed(0) > 0.15, f"robot 0 under way {when}")

    def kill(self, name):
        pid = pid_of(name)
        os.kill(pid, signal.SIGKILL)
        self.wait(lambda: pid_of(name) not in (None, pid), f"{name} back")

    def stop(self, name):
        """Stop a process for a while, as a busy machine does."""
        pid = pid_of(name)
        os.kill(pid, signal.SIGSTOP)
        self.addCleanup(os.kill, pid, signal.SIGCONT)
        end = time.monotonic() + STOPPED_S
        self.wait(lambda: self.speed(0) < 0.02, f"robot 0 hovering with {name} stopped")
        self.wait(lambda: time.monotonic() >= end, f"{STOPPED_S} s")
        self.assertLess(self.speed(0), 0.02)
        os.kill(pid, signal.SIGCONT)

    def events_of(self, kind, **having):
        return [
            (event.robot, event.goal)
            for event in self.events
            if event.event is kind and all(getattr(event, k) == v for k, v in having.items())
        ]


if __name__ == "__main__":
    rostest.rosrun("quad", "respawn", Respawn)
