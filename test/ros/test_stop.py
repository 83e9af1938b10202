#!/usr/bin/env python3
"""Stop a mission and resume it; the simulator's rate in flight."""

import os
import signal

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from dynamic_reconfigure.client import Client
from flight_case import FlightCase, Record, pid_of, trigger
from move_base_msgs.msg import MoveBaseActionResult
from own_messages import event_of
from quad.msg import MissionEvent

from quad_nav.mission.actions import Event


class Stop(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.events = Record("/quad/events", MissionEvent)
        cls.results = Record("/move_base0/result", MoveBaseActionResult)
        cls.statuses = {}
        rospy.Subscriber("/diagnostics", DiagnosticArray, cls._store)
        cls.start()

    @classmethod
    def _store(cls, message):
        for status in message.status:
            cls.statuses[status.name] = {pair.key: pair.value for pair in status.values}

    def sent(self):
        events = map(event_of, self.events.messages)
        return [one for one in events if one.event is Event.SENT]

    def value(self, status, key):
        return self.statuses.get(status, {}).get(key)

    def test_a_mission_stops_stays_stopped_and_resumes(self):
        self.wait(lambda: min(self.speed(0), self.speed(1)) > 0.2, "both flying")
        self.assertIn("/mission/resume", trigger("/mission/stop"))
        count = len(self.sent())
        self.wait(lambda: max(self.speed(0), self.speed(1)) < 0.05, "both hovering")
        self.wait(lambda: self.value("mission: quad1", "stopped") == "True", "the diagnostics")
        self.kill_sequencer()
        self.statuses.clear()
        self.wait(lambda: self.value("mission: quad1", "stopped") == "True", "another sequencer")
        self.simulated_seconds(6.0)  # a navigator without a goal would get it again after 5 s
        self.assertEqual(len(self.sent()), count)
        self.assertLess(max(self.speed(0), self.speed(1)), 0.05)
        self.assertIn("resumed", trigger("/mission/resume"))
        self.wait(lambda: min(self.speed(0), self.speed(1)) > 0.2, "both flying again")
        goals = [(one["robot"], one["goal"], one["attempt"]) for one in self.sent()[count:]]
        self.assertEqual(sorted(goals[:2]), [(0, 0, 1), (1, 0, 1)])

    def kill_sequencer(self):
        pid = pid_of("/sequencer")
        os.kill(pid, signal.SIGKILL)
        self.wait(lambda: pid_of("/sequencer") not in (None, pid), "a sequencer again")

    def test_the_rate_changes_in_flight(self):
        client = Client("/simulator", timeout=30.0)
        self.addCleanup(client.update_configuration, {"rate": 2.0})
        self.assertEqual(client.update_configuration({"rate": 3.0})["rate"], 3.0)
        self.wait(lambda: self.value("simulator: clock", "rate") == "3", "the rate")
        self.assertEqual(rospy.get_param("/simulator/rate"), 3.0)
        for wrong in (float("nan"), -1.0):
            client.update_configuration({"rate": wrong})
            self.assertGreater(client.get_configuration()["rate"], 0.0)


if __name__ == "__main__":
    rostest.rosrun("quad", "stop", Stop)
