#!/usr/bin/env python3
"""The sequencer's summary knows how near people came who react to quadcopters."""

import numpy as np
import rospy
import rostest
from flight_case import FlightCase
from nav_msgs.msg import Odometry
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from quad_nav.scenario.rules import START_S

PERSON_M, HULL_M, SIZE_M = 0.25, 0.3, 10.0


def least_gaps_m(odometry, obstacles, end_s):
    """Return the least distances from the hull to a person and to a wall until a time."""
    odometry = [message for message in odometry if message.header.stamp.to_sec() <= end_s]
    shown_s = [message.markers[0].header.stamp.to_sec() for message in obstacles]
    people = np.array(
        [[(m.pose.position.x, m.pose.position.y) for m in one.markers] for one in obstacles]
    )
    times_s = np.array([message.header.stamp.to_sec() for message in odometry])
    places = np.array([(m.pose.pose.position.x, m.pose.pose.position.y) for m in odometry])
    nearest_m = np.inf
    for k in range(people.shape[1]):
        x, y = (np.interp(times_s, shown_s, people[:, k, axis]) for axis in (0, 1))
        nearest_m = min(nearest_m, np.hypot(places[:, 0] - x, places[:, 1] - y).min())
    return nearest_m - PERSON_M - HULL_M, np.minimum(places, SIZE_M - places).min() - HULL_M


def last_s(heard):
    message = heard.messages[-1]
    return (message if message._has_header else message.markers[0]).header.stamp.to_sec()


class People(FlightCase):
    def test_the_summary_has_the_clearance_from_people(self):
        obstacles = self.record("/simulation/obstacles", MarkerArray)
        tracks = [self.record(f"/odom{robot}", Odometry) for robot in (0, 1)]
        rospy.Service("/test/start", Trigger, self._start)
        result = self.read_result(rospy.get_param("~result"), patience_s=150.0)
        end_s = START_S + result["sim_time_s"]
        for heard in (obstacles, *tracks):
            self.wait(lambda heard=heard: last_s(heard) > end_s, "messages after the end")
        for robot, track in zip(result["robots"], tracks):
            self.assertTrue(all(goal["reached"] for goal in robot["goals"]), robot["goals"])
            person_m, wall_m = least_gaps_m(list(track.messages), list(obstacles.messages), end_s)
            self.assertLess(person_m, wall_m)
            self.assertAlmostEqual(robot["min_clearance_m"], min(person_m, wall_m), delta=0.05)

    def _start(self, request):
        return rospy.ServiceProxy("/simulation/start", Trigger)()


if __name__ == "__main__":
    rostest.rosrun("quad", "people", People)
