"""Hostile messages: what a faulty or malicious node may publish beside the real ones."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Callable, Dict

import numpy as np
import rospy
from actionlib_msgs.msg import GoalID
from flight_case import goal_pose
from geometry_msgs.msg import PoseStamped, Quaternion, Transform, TransformStamped, Twist
from move_base_msgs.msg import MoveBaseActionGoal
from nav_msgs.msg import Odometry
from quad.msg import Contact as ContactMessage
from sensor_msgs.msg import LaserScan, MultiDOFJointState, PointCloud2
from tf2_msgs.msg import TFMessage

from quad_nav.peers.peer import Intention
from quad_nav.ros.common.own_messages import contact_message
from quad_nav.ros.common.packed_messages import STATES_TOPIC
from quad_nav.ros.navigator.intention_topics import INTENTIONS_TOPIC, intentions_message
from quad_nav.sim.contacts import Contact

FLOOD = 30  # messages; ten for each simulated second
FEW = 3  # goals: each replaces the sequencer's, and one of the other kind that comes with it
AHEAD_S = 20.0
END_OF_TIME = rospy.Time(2**32 - 1, 990_000_000)
LONG_ID = "a" * 2**20
NAN = math.nan

SEQUENCER, SIMULATOR = "/sequencer", "/simulator"
NAVIGATORS = ("/move_base0", "/move_base1")


@dataclass(frozen=True)
class Kind:
    """Messages of one kind.

    Attributes:
        topic: Name of the topic.
        message_type: Class of the messages.
        make: Returns a message.
        logged: A regular expression of the warning, by the node that logs it.
        count: Number of messages.
        period_s: Simulated time between two of them.
    """

    topic: str
    message_type: Any
    make: Callable[[], Any]
    logged: Dict[str, str]
    count: int = FLOOD
    period_s: float = 0.1


def odometry():
    """Odometry of robot 0."""
    message = Odometry(child_frame_id="base_link0")
    message.header.frame_id, message.header.stamp = "odom0", rospy.Time.now()
    message.pose.pose.position.x, message.pose.pose.orientation.w = NAN, 1.0
    return message


def transform():
    """Pose of robot 0 as a transform."""
    message = TransformStamped(child_frame_id="base_link0")
    message.header.frame_id = "odom0"
    message.header.stamp = rospy.Time.now() + rospy.Duration(AHEAD_S)
    message.transform.rotation.w = 1.0
    return TFMessage([message])


def scan():
    """Scan of robot 0 in the middle of a round room."""
    message = LaserScan(range_min=0.02, range_max=60.0, ranges=[3.0] * 512)
    message.header.frame_id, message.header.stamp = "Lidar0", rospy.Time.now()
    return message


def contact():
    """Contact of a robot that does not fly with a wall."""
    return contact_message(Contact(5.0, "quad77", "wall", 1.0, 5.0), 5.0)


def command():
    """Command of a second node."""
    message = Twist()
    message.linear.x = NAN
    return message


def action_goal():
    """Goal of another action client."""
    message = MoveBaseActionGoal()
    message.goal.target_pose = goal_pose(NAN, NAN)
    return message


def rotated_goal():
    """Goal with a yaw that is not finite."""
    message = goal_pose(1.0, 5.0)
    message.pose.orientation = Quaternion(0.0, 0.0, math.inf, NAN)
    return message


def intention():
    """Intention of robot 0, for robot 1."""
    path = np.array([[NAN, 5.0], [1.0, 5.0]])
    return intentions_message({0: Intention(-1.0, path)}, "map", rospy.get_time())


def states():
    """State of robot 0 in the message for many robots."""
    message = MultiDOFJointState(joint_names=["quad0"], twist=[Twist()])
    message.header.frame_id, message.header.stamp = "map", END_OF_TIME
    message.transforms = [Transform(rotation=Quaternion(0.0, 0.0, 0.0, 1.0))]
    return message


def garbage(message_type):
    """Class of messages of this type whose content is three bytes that cannot be read."""
    names = {
        name: getattr(message_type, name)
        for name in ("_type", "_md5sum", "_full_text", "_slot_types")
    }
    return type("Garbage", (rospy.AnyMsg,), {**names, "_has_header": False})


def garbage_message(message_type):
    message = garbage(message_type)()
    message._buff = b"\xff\xff\xff"
    return message


def everyone(text):
    return {node: text for node in (SEQUENCER, *NAVIGATORS)}


# One kind for each topic: a node throttles its warnings of a topic together.
KINDS: Dict[str, Kind] = {
    "NaN odometry": Kind("/odom0", Odometry, odometry, {"/move_base0": "odom.* dropped.*nan"}),
    "states at the end of time": Kind(
        STATES_TOPIC, MultiDOFJointState, states, everyone("states: state dropped.*ahead")
    ),
    "transform 20 s ahead": Kind(
        "/tf", TFMessage, transform, {"/move_base0": "tf: transform dropped.*ahead"}, 1
    ),
    "scan without an increment": Kind(
        "/scan0", LaserScan, scan, {"/move_base0": "scan0.*increment 0 "}
    ),
    "contact of an unknown robot": Kind(
        "/simulation/contacts", ContactMessage, contact, {SEQUENCER: "contacts: message dropped"}
    ),
    "NaN command": Kind("/cmd_vel0", Twist, command, {SIMULATOR: "command dropped"}),
    "goal with a NaN yaw": Kind(
        "/move_base_simple/goal0",
        PoseStamped,
        rotated_goal,
        {"/move_base0": "quaternion"},
        FEW,
        0.7,
    ),
    "cancel with a long id": Kind(
        "/move_base0/cancel", GoalID, lambda: GoalID(id=LONG_ID), {"/move_base0": "cancel"}
    ),
    "NaN intention": Kind(
        INTENTIONS_TOPIC, PointCloud2, intention, {"/move_base1": "intention dropped"}
    ),
    "NaN goal of an action client": Kind(
        "/move_base0/goal", MoveBaseActionGoal, action_goal, {"/move_base0": "not finite"}, FEW, 1.0
    ),
}
# rospy closes the connection without a line in the log.
UNREADABLE = Kind("/scan0", garbage(LaserScan), lambda: garbage_message(LaserScan), {}, 1)
