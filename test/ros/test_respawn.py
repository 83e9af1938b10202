#!/usr/bin/env python3
"""A navigator killed in flight: its quadcopter hovers, the node comes back, the mission goes on."""
import os
import signal
from xmlrpc.client import ServerProxy

import rosgraph
import rosnode
import rospy
import rostest
from flight_case import FlightCase


def pid_of(name):
    uri = rosnode.get_api_uri(rosgraph.Master("/test"), name, skip_cache=True)
    return ServerProxy(uri).getPid("/test")[2] if uri else None


class Respawn(FlightCase):
    def test_killed_navigator(self):
        self.wait(lambda: self.odometry[0].message is not None, "odometry")
        self.wait(lambda: self.speed(0) > 0.15, "robot 0 under way")
        killed = pid_of("/move_base0")
        os.kill(killed, signal.SIGKILL)
        self.wait(lambda: self.speed(0) < 0.02, "robot 0 hovering")
        self.wait(lambda: self.is_back(killed), "the node respawned")
        self.wait(lambda: self.speed(0) > 0.15, "robot 0 under way again")
        result = self.read_result(rospy.get_param("~result"), patience_s=200.0)
        for robot in result["robots"]:
            self.assertTrue(all(goal["reached"] for goal in robot["goals"]), robot)

    @staticmethod
    def is_back(killed):
        try:
            return pid_of("/move_base0") not in (None, killed)
        except OSError:
            return False  # the dead node's address is still registered


if __name__ == "__main__":
    rostest.rosrun("quad", "respawn", Respawn)
