#!/usr/bin/env python3
"""A mission with a second clock, a stop, and nodes that are killed and stopped.

The quadcopters hover, the mission resumes, and no goal is lost or flown twice.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from dynamic_reconfigure.client import Client
from flight_case import PATIENCE_S, FlightCase, Record, pid_of, trigger
from own_messages import event_of
from quad.msg import MissionEvent
from rosgraph_msgs.msg import Clock, Log

from quad_nav.mission.actions import Event

SIMULATOR = str(Path(__file__).resolve().parents[2] / "nodes" / "simulator")
NODES = ("/move_base0", "/move_base1", "/sequencer")
STOPPED_S = 5.0  # wall time


class Respawn(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.events, cls.log = Record("/quad/events", MissionEvent), Record("/rosout", Log)
        cls.statuses = {}
        rospy.Subscriber("/diagnostics", DiagnosticArray, cls.store)
        cls.start()

    @classmethod
    def store(cls, message):
        for status in message.status:
            cls.statuses[status.name] = {pair.key: pair.value for pair in status.values}

    def test_the_mission_survives(self):
        self.wait_for_flight("at first")
        self.it_stays_stopped_over_the_death_of_the_sequencer()  # before any goal is reached
        self.a_second_clock_is_named_and_ignored()
        self.kill("/sequencer")
        self.wait_for_flight("after the sequencer's death in flight")
        self.kill("/move_base0")
        self.wait(lambda: self.speed(0) < 0.02, "robot 0 hovering without a navigator")
        self.wait_for_flight("with another navigator")
        self.stop_for_a_while("/move_base0")
        self.wait_for_flight("with its navigator awake")
        self.a_second_simulator_is_refused()
        self.the_rate_changes()
        self.check(self.read_result(rospy.get_param("~result"), patience_s=200.0))

    def a_second_clock_is_named_and_ignored(self):
        clock = rospy.Publisher("/clock", Clock, queue_size=1)
        self.wait(lambda: clock.get_num_connections() >= len(NODES), "nodes that hear the clock")
        sentence = f"/clock: time of {rospy.get_name()} dropped: /simulator sets the clock"

        def told():
            for ahead_s in (1e9, 1e5, -3.0):
                clock.publish(Clock(rospy.Time.from_sec(max(rospy.get_time() + ahead_s, 0.5))))
            lines = [line for line in self.log.messages if line.msg.startswith(sentence)]
            return {line.name for line in lines}

        self.wait(lambda: set(NODES) <= told(), "a line of each node about the second clock")
        clock.unregister()
        self.assertFalse([one.msg for one in self.log.messages if "jumped back" in one.msg])

    def the_rate_changes(self):
        client = Client("/simulator", timeout=PATIENCE_S)
        self.assertEqual(client.update_configuration({"rate": 3.0})["rate"], 3.0)
        self.wait(lambda: self.value("simulator: clock", "rate") == "3", "the rate")
        self.assertEqual(rospy.get_param("/simulator/rate"), 3.0)
        for wrong in (float("nan"), -1.0):
            client.update_configuration({"rate": wrong})
            self.assertGreater(client.get_configuration()["rate"], 0.0)
        client.update_configuration({"rate": 3.0})

    def it_stays_stopped_over_the_death_of_the_sequencer(self):
        self.assertIn("/mission/resume", trigger("/mission/stop"))
        self.wait(lambda: max(self.speed(0), self.speed(1)) < 0.05, "both hovering")
        self.wait(lambda: self.value("mission: quad1", "stopped") == "True", "the diagnostics")
        count = len(self.of_kind(Event.SENT))
        self.kill("/sequencer")
        self.statuses.clear()
        self.wait(lambda: self.value("mission: quad1", "stopped") == "True", "another sequencer")
        self.simulated_seconds(6.0)  # a navigator without a goal would get it again after 5 s
        self.assertEqual(len(self.of_kind(Event.SENT)), count)
        self.assertLess(max(self.speed(0), self.speed(1)), 0.05)
        self.assertIn("resumed", trigger("/mission/resume"))
        self.wait_for_flight("after the stop")
        again = [(one.robot, one.goal, one.attempts) for one in self.of_kind(Event.SENT)[count:]]
        self.assertEqual(sorted(again[:2]), [(0, 0, 1), (1, 0, 1)])

    def a_second_simulator_is_refused(self):
        first = pid_of("/simulator")
        second = subprocess.run(
            [sys.executable, SIMULATOR, "__name:=simulator2"],
            stderr=subprocess.PIPE,
            timeout=PATIENCE_S,
            check=False,
        )
        self.assertEqual(second.returncode, 2)
        self.assertIn(b"not started: /simulator runs already", second.stderr)
        self.assertNotIn(b"Traceback", second.stderr)
        self.assertEqual(pid_of("/simulator"), first)

    def check(self, result):
        self.assertTrue(result["success"], result)
        for robot in result["robots"]:
            self.assertTrue(
                all(goal["reached"] and goal["attempts"] == 1 for goal in robot["goals"]), robot
            )
        # A sequencer that has just started may tell of one before this process hears its topic.
        reached = [(event.robot, event.goal) for event in self.of_kind(Event.REACHED)]
        self.assertEqual(len(reached), len(set(reached)), reached)
        first = [(one.robot, one.goal) for one in self.of_kind(Event.SENT) if not one.reason]
        self.assertEqual(len(first), len(set(first)), first)

    def wait_for_flight(self, when):
        self.wait(lambda: self.speed(0) > 0.15, f"robot 0 under way {when}")

    def value(self, status, key):
        return self.statuses.get(status, {}).get(key)

    def of_kind(self, kind):
        return [event for event in map(event_of, self.events.messages) if event.event is kind]

    def kill(self, name):
        pid = pid_of(name)
        os.kill(pid, signal.SIGKILL)
        self.wait(lambda: pid_of(name) not in (None, pid), f"{name} back")

    def stop_for_a_while(self, name):
        """Stop a process as a busy machine does."""
        pid = pid_of(name)
        os.kill(pid, signal.SIGSTOP)
        self.addCleanup(os.kill, pid, signal.SIGCONT)
        end = time.monotonic() + STOPPED_S
        self.wait(lambda: self.speed(0) < 0.02, f"robot 0 hovering with {name} stopped")
        self.wait(lambda: time.monotonic() >= end, f"{STOPPED_S} s")
        self.assertLess(self.speed(0), 0.02)
        os.kill(pid, signal.SIGCONT)


if __name__ == "__main__":
    rostest.rosrun("quad", "respawn", Respawn)
