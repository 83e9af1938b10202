#!/usr/bin/env python3
"""Two vehicles take off, fly goals, one is taken over and resumed, and both land."""

import math
import os
import signal
import socket
from xmlrpc.client import ServerProxy

import actionlib
import rosgraph
import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus
from flight_case import PATIENCE_S, pid_of, trigger
from own_messages import event_of
from pymavlink.dialects.v20 import ardupilotmega
from quad.msg import LandAction, LandGoal, MissionEvent, TakeOffAction, TakeOffGoal, VehicleState
from std_msgs.msg import Empty
from vehicle_case import VehicleCase

from quad_nav.mission.actions import Event

HEARTBEAT = ardupilotmega.MAVLink_heartbeat_message(2, 3, 81, 9, 3, 3)
FLYING = ("flying", "holding")  # a bridge holds for a moment where commands are late
GCS_TIMEOUT_S = 15.0  # a bridge takes 4 s to come back, longer on a loaded machine
ACTIONS = {"take_off": (TakeOffAction, TakeOffGoal()), "land": (LandAction, LandGoal())}


class Vehicles(VehicleCase):
    COMMAND = (
        "udp_vehicles.py",
        f"--gcs-timeout={GCS_TIMEOUT_S}",
        "ardupilot:14651:3:-2:30",
        "px4:14652:0:0:200",
    )

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.events = []
        cls.buffer = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.buffer)
        cls.subscribers.append(
            rospy.Subscriber("/quad/events", MissionEvent, lambda m: cls.events.append(event_of(m)))
        )

    def test_a_flight(self):
        self.wait(lambda: self.states.get(0) == self.states.get(1) == "flying", "flight of both")
        self.wait(lambda: min(self.speed(0), self.speed(1)) > 0.2, "motion of both")
        self.the_frames_agree()
        self.a_pilot_takes_one_over()
        self.somebody_resumes_it()
        self.a_landed_vehicle_outlives_the_sequencer()
        self.strangers_change_nothing()
        self.a_killed_bridge_comes_back_and_lets_its_vehicle_hover()
        self.all_land()
        self.actions_take_off_and_land()
        self.a_cancelled_take_off_lands()

    def the_frames_agree(self):
        """A vehicle that stood at (3, -2) of its own frame is in map where its file says."""
        pose = self.buffer.lookup_transform("map", "odom0", rospy.Time()).transform
        odometry = self.odometry[0].pose.pose
        self.assertAlmostEqual(odometry.position.z, 1.0, delta=0.1)
        yaw = 2.0 * math.atan2(pose.rotation.z, pose.rotation.w)
        # North 3 m and east -2 m, heading 30 degrees: yaw 60 degrees in ENU, 0 in map.
        self.assertAlmostEqual(math.degrees(yaw), -60.0, delta=0.5)
        x = pose.translation.x + math.cos(yaw) * -2.0 - math.sin(yaw) * 3.0
        y = pose.translation.y + math.sin(yaw) * -2.0 + math.cos(yaw) * 3.0
        self.assertAlmostEqual(x, 1.5, delta=0.02)
        self.assertAlmostEqual(y, 1.5, delta=0.02)

    def a_pilot_takes_one_over(self):
        self.process.send_signal(signal.SIGUSR1)
        self.wait(lambda: self.states[0] == "taken over", "state of vehicle 0")
        self.assertIn("the mode was changed", self.values[0].reason)
        self.wait(lambda: rospy.get_param("/mission/quad0/stopped"), "stop of its mission")
        self.assertFalse(rospy.get_param("/mission/quad1/stopped"))
        self.wait(lambda: self.speed(0) < 0.05, "hover of vehicle 0")
        self.assertIn(self.states[1], FLYING)
        # It neither keeps a take-off waiting nor lets a resumption of all fly it.
        self.assertIn("left out: quad0: taken over", trigger("/vehicles/take_off"))
        trigger("/mission/resume")
        self.wait(lambda: rospy.get_param("/mission/quad0/stopped"), "stop by the bridge")
        self.assertEqual(self.states[0], "taken over")
        self.assertIn(self.states[1], FLYING)

    def somebody_resumes_it(self):
        trigger("/vehicle0/resume")
        self.wait(lambda: not rospy.get_param("/mission/quad0/stopped"), "mission of quad0")
        self.wait(lambda: self.states[0] == "flying" and self.speed(0) > 0.2, "flight again")

    def a_landed_vehicle_outlives_the_sequencer(self):
        """Another sequencer flies vehicle 0 on, and leaves vehicle 1 where it has landed."""
        trigger("/vehicle1/land")
        self.wait(lambda: not self.values[1].armed, "landing of vehicle 1")
        pid, told, states = pid_of("/sequencer"), len(self.events), []
        self.subscribers.append(
            rospy.Subscriber("/vehicle1/state", VehicleState, lambda one: states.append(one))
        )
        os.kill(pid, signal.SIGKILL)
        self.wait(lambda: pid_of("/sequencer") not in (None, pid), "a sequencer again")
        self.wait(lambda: len(self.events) > told, "goals of another sequencer")
        self.assertEqual({one.armed for one in states}, {False})
        self.assertEqual({(one.robot, one.event) for one in self.events[told:]}, {(0, Event.SENT)})
        self.assertTrue(rospy.get_param("/mission/quad1/stopped"))
        self.assertFalse(rospy.get_param("/mission/quad0/stopped"))
        self.wait(lambda: self.states[0] == "flying" and self.speed(0) > 0.2, "flight of vehicle 0")
        self.a_person_lets_it_fly_again()

    def a_person_lets_it_fly_again(self):
        with self.assertRaisesRegex(AssertionError, "take off first"):
            trigger("/vehicle1/resume")
        self.wait(lambda: self.states[1] in ("ready", "landed"), "readiness of vehicle 1")
        trigger("/vehicle1/take_off")
        self.assertTrue(rospy.get_param("/mission/quad1/stopped"))
        trigger("/vehicle1/resume")
        self.wait(lambda: self.states[1] == "flying" and self.speed(1) > 0.2, "flight again")
        self.assertFalse(rospy.get_param("/mission/quad1/stopped"))

    def strangers_change_nothing(self):
        """A datagram from each of many ports, some of which say that vehicle 0 has landed."""
        beat = HEARTBEAT.pack(ardupilotmega.MAVLink(None, 1, 1))
        for data in (b"x", b"", beat) * 100:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
                stranger.sendto(data, ("127.0.0.1", 14651))
        rospy.sleep(1.5)  # the state is told once a second
        self.assertIn(self.states[0], FLYING)
        self.assertEqual(self.values[0].mode, "GUIDED")

    def a_killed_bridge_comes_back_and_lets_its_vehicle_hover(self):
        before = self.buffer.lookup_transform("map", "odom0", rospy.Time()).transform
        node = ServerProxy(rosgraph.Master("/test_vehicles").lookupNode("/vehicle0"))
        os.kill(node.getPid("/test_vehicles")[2], signal.SIGKILL)
        self.wait(lambda: "started in flight" in self.values[0].reason, "restarted bridge")
        self.assertEqual(self.states[0], "taken over")
        self.wait(lambda: rospy.get_param("/mission/quad0/stopped"), "stop of its mission")
        self.wait(lambda: self.speed(0) < 0.05, "hover of vehicle 0")
        rospy.sleep(GCS_TIMEOUT_S + 1.0)  # the autopilot's failsafe would land it
        self.assertEqual((self.states[0], self.values[0].mode), ("taken over", "GUIDED"))
        self.assertLess(self.speed(0), 0.05)
        self.assertAlmostEqual(self.odometry[0].pose.pose.position.z, 1.0, delta=0.15)
        self.assertIn(self.states[1], FLYING)
        after = self.buffer.lookup_transform("map", "odom0", rospy.Time()).transform
        self.assertAlmostEqual(after.translation.x, before.translation.x, delta=1e-6)
        self.assertAlmostEqual(after.rotation.z, before.rotation.z, delta=1e-6)
        self.somebody_resumes_it()

    def all_land(self):
        publisher = rospy.Publisher("/vehicles/land_all", Empty, queue_size=1)
        self.wait(lambda: publisher.get_num_connections() == 2, "subscribers")
        publisher.publish(Empty())
        self.wait(lambda: set(self.states.values()) == {"landing"}, "landing of both")
        self.wait(lambda: set(self.states.values()) <= {"landed", "not ready"}, "both on ground")
        self.assertEqual({one.armed for one in self.values.values()}, {False})

    def act(self, name):
        """Send an action's goal; return its client and the heights of its feedback."""
        action, goal = ACTIONS[name]
        client = actionlib.SimpleActionClient(f"/vehicle0/{name}", action)
        self.assertTrue(client.wait_for_server(rospy.Duration(PATIENCE_S)))
        heights = []
        client.send_goal(goal, feedback_cb=lambda one: heights.append(one.height))
        return client, heights

    def wait_for_result(self, client):
        self.assertTrue(client.wait_for_result(rospy.Duration(PATIENCE_S)), self.values[0])
        return client.get_state(), client.get_goal_status_text()

    def actions_take_off_and_land(self):
        trigger("/mission/quad0/stop")
        self.wait(lambda: self.states[0] in ("ready", "landed"), "readiness of vehicle 0")
        client, heights = self.act("take_off")
        self.assertEqual(self.wait_for_result(client), (GoalStatus.SUCCEEDED, "holding"))
        self.assertLess(heights[0], 0.1)
        self.assertGreater(heights[-1], 0.8)
        client, heights = self.act("land")
        self.wait(lambda: heights and heights[-1] < 0.8, "descent")
        client.cancel_goal()  # a landing goes on
        state, text = self.wait_for_result(client)
        self.assertEqual(state, GoalStatus.SUCCEEDED, text)
        self.assertLess(heights[-1], 0.1)

    def a_cancelled_take_off_lands(self):
        self.wait(lambda: self.states[0] in ("ready", "landed"), "readiness of vehicle 0")
        client, heights = self.act("take_off")
        self.wait(lambda: heights and heights[-1] > 0.2, "ascent")
        client.cancel_goal()
        self.assertEqual(self.wait_for_result(client), (GoalStatus.PREEMPTED, "landing"))
        self.wait(lambda: self.states[0] in ("landed", "not ready", "ready"), "vehicle on ground")
        self.assertFalse(self.values[0].armed)


if __name__ == "__main__":
    rostest.rosrun("quad", "vehicle_flight", Vehicles)
