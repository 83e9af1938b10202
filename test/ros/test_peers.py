#!/usr/bin/env python3
"""Two navigators that know each other from their topics fly without a contact."""

import rospy
import rostest
from flight_case import FlightCase, Latest
from nav_msgs.msg import Path


class Peers(FlightCase):
    def test_the_tutorials_mission_without_a_contact(self):
        intentions = [Latest(f"/move_base{i}/intention", Path) for i in (0, 1)]
        self.wait(
            lambda: all(i.message is not None and i.message.poses for i in intentions),
            "the intentions of both navigators",
        )
        for latest in intentions:
            self.assertEqual(latest.message.header.frame_id, "map")
            ranks = {pose.header.stamp.to_sec() for pose in latest.message.poses}
            self.assertEqual(len(ranks), 1)
        result = self.read_result(rospy.get_param("~result"), patience_s=380.0)
        self.assertEqual(result["contacts"], [])
        for robot in result["robots"]:
            for goal in robot["goals"]:
                self.assertTrue(goal["reached"], goal)


if __name__ == "__main__":
    rostest.rosrun("quad", "peers", Peers)
