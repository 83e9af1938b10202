#!/usr/bin/env python3
"""One node sets the clock: the flight goes on while another one publishes it, and is named."""

import subprocess
import sys
from pathlib import Path

import rospy
import rostest
from flight_case import PATIENCE_S, FlightCase, Record, pid_of
from rosgraph_msgs.msg import Clock, Log

NODE = str(Path(__file__).resolve().parents[2] / "nodes" / "simulator")
NODES = ("/move_base0", "/move_base1", "/sequencer")


class TwoClocks(FlightCase):
    def test_1_the_mission_succeeds_with_a_second_clock(self):
        log = Record("/rosout", Log)
        moves = lambda: self.odometry[0].message is not None and self.speed(0) > 0.15  # noqa: E731
        self.wait(moves, "robot 0 under way")
        clock = rospy.Publisher("/clock", Clock, queue_size=1)
        self.addCleanup(clock.unregister)
        self.wait(lambda: clock.get_num_connections() >= len(NODES), "nodes that hear the clock")
        for ahead_s in (1e9, 1e5, -3.0) * 20:
            clock.publish(Clock(rospy.Time.from_sec(max(rospy.get_time() + ahead_s, 0.5))))
            rospy.rostime.wallsleep(0.05)
        result = self.read_result(rospy.get_param("~result"), patience_s=200.0)
        self.assertTrue(result["success"], result)
        self.assertLess(result["sim_time_s"], 300.0)
        for robot in result["robots"]:
            self.assertTrue(all(goal["attempts"] == 1 for goal in robot["goals"]), robot)
        sentence = f"/clock: time of {rospy.get_name()} dropped: /simulator sets the clock"
        told = {line.name for line in log.messages if line.msg.startswith(sentence)}
        self.assertLessEqual(set(NODES), told)
        self.assertFalse([line.msg for line in log.messages if "jumped back" in line.msg])

    def test_2_a_second_simulator_is_refused(self):
        first = pid_of("/simulator")
        for name in ("simulator", "simulator2"):
            second = subprocess.run(
                [sys.executable, NODE, f"__name:={name}"],
                stderr=subprocess.PIPE,
                timeout=PATIENCE_S,
                check=False,
            )
            self.assertEqual(second.returncode, 2)
            self.assertIn(b"not started: /simulator runs already", second.stderr)
            self.assertNotIn(b"Traceback", second.stderr)
        self.assertEqual(pid_of("/simulator"), first)


if __name__ == "__main__":
    rostest.rosrun("quad", "two_clocks", TwoClocks)
