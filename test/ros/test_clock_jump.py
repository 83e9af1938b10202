#!/usr/bin/env python3
"""The clock jumps back in flight: the mission resumes and no goal is flown twice."""

import rospy
import rostest
from flight_case import FlightCase
from sensor_faults import SensorFaults


class ClockJump(FlightCase):
    def test_the_mission_resumes(self):
        sensor_faults = SensorFaults()
        self.wait(lambda: self.odometry[0].message is not None, "odometry")
        self.wait(lambda: self.speed(0) > 0.15, "robot 0 under way")
        self.simulated_seconds(4.0)
        before_s = rospy.get_time()
        sensor_faults.back_s += 5.0
        self.wait(lambda: rospy.get_time() < before_s - 4.0, "a clock jump")
        result = self.read_result(rospy.get_param("~result"), patience_s=200.0)
        self.assertTrue(result["success"], result)
        for robot in result["robots"]:
            self.assertTrue(all(goal["attempts"] == 1 for goal in robot["goals"]), robot)
            self.assertGreater(robot["path_length_m"], 0.9 * robot["straight_length_m"])


if __name__ == "__main__":
    rostest.rosrun("quad", "clock_jump", ClockJump)
