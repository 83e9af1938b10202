"""Hostile messages: what a faulty or malicious node may publish beside the real ones."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Callable, Dict

import numpy as np
import rospy
from actionlib_msgs.msg import GoalID
from flight_case import goal_pose
from geometry_msgs.msg import PoseStamped, Quaternion, TransformStamped, Twist
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
FEW = (3, 1.0)  # number and period of goals: each replaces the sequencer's goal
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


def odometry(x=NAN, v=NAN, stamp=None):
    """Odometry of robot 0."""
    message = Odometry(child_frame_id="base_link0")
    message.header.frame_id, message.header.stamp = "odom0", stamp or rospy.Time.now()
    position = message.pose.pose.position
    position.x, position.y, position.z = x, 5.0, 1.0
    message.pose.pose.orientation.w = 1.0
    message.twist.twist.linear.x = v
    return message


def transform(stamp, x=1.0):
    """Pose of robot 0 as a transform."""
    message = TransformStamped(child_frame_id="base_link0")
    message.header.frame_id, message.header.stamp = "odom0", stamp
    message.transform.translation.x, message.transform.translation.y = x, 5.0
    message.transform.rotation.w = 1.0
    return TFMessage([message])


def scan(increment=2.0 * math.pi / 512, stamp=None):
    """Scan of robot 0 in the middle of a round room."""
    message = LaserScan(angle_increment=increment, range_min=0.02, range_max=60.0)
    message.header.frame_id, message.header.stamp = "Lidar0", stamp or rospy.Time.now()
    message.ranges = np.full(512, 3.0, dtype=np.float32).tolist()
    return message


def contact(robot="quad0", x_m=1.0, time_s=5.0):
    """Contact of robot 0 with a wall."""
    return contact_message(Contact(time_s, robot, "wall", x_m, 5.0), time_s)


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


def states(x=NAN, stamp=None):
    """State of robot 0 in the message for many robots."""
    message = MultiDOFJointState(joint_names=["quad0"], twist=[Twist()])
    message.header.frame_id, message.header.stamp = "map", stamp or rospy.Time.now()
    message.transforms = [transform(rospy.Time.now(), x).transforms[0].transform]
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


# Kinds with the same warning are not next to each other: the test waits for the throttle.
KINDS: Dict[str, Kind] = {
    "NaN odometry": Kind("/odom0", Odometry, odometry, {"/move_base0": "odom.* dropped.*nan"}),
    "NaN states": Kind(
        STATES_TOPIC, MultiDOFJointState, states, everyone("states: state dropped: quad0.*nan")
    ),
    "transform at the end of time": Kind(
        "/tf",
        TFMessage,
        lambda: transform(END_OF_TIME),
        {"/move_base0": "tf: transform dropped.*ahead"},
        1,
    ),
    "scan at the end of time": Kind(
        "/scan0", LaserScan, lambda: scan(stamp=END_OF_TIME), {"/move_base0": "scan0.*ahead"}, 1
    ),
    "NaN contact": Kind(
        "/simulation/contacts",
        ContactMessage,
        lambda: contact(x_m=NAN),
        {SEQUENCER: "contacts: message dropped"},
    ),
    "NaN command": Kind("/cmd_vel0", Twist, command, {SIMULATOR: "command dropped"}),
    "NaN goal": Kind(
        "/move_base_simple/goal0",
        PoseStamped,
        lambda: goal_pose(NAN, 5.0),
        {"/move_base0": "not finite"},
        *FEW,
    ),
    "states at x = 1e5 m": Kind(
        STATES_TOPIC,
        MultiDOFJointState,
        lambda: states(1e5),
        {SEQUENCER: "states: message dropped.*jump"},
        1,
    ),
    "scan without an increment": Kind(
        "/scan0", LaserScan, lambda: scan(0.0), {"/move_base0": "scan0.*increment 0 "}
    ),
    "contact at the end of time": Kind(
        "/simulation/contacts",
        ContactMessage,
        lambda: contact(time_s=END_OF_TIME.to_sec()),
        {SEQUENCER: "contacts: message dropped"},
    ),
    "NaN transform": Kind(
        "/tf",
        TFMessage,
        lambda: transform(rospy.Time.now(), NAN),
        {"/move_base0": "tf: transform dropped.*finite"},
    ),
    "cancel with a long id": Kind(
        "/move_base0/cancel", GoalID, lambda: GoalID(id=LONG_ID), {"/move_base0": "cancel"}
    ),
    "goal with a NaN yaw": Kind(
        "/move_base_simple/goal0", PoseStamped, rotated_goal, {"/move_base0": "quaternion"}, *FEW
    ),
    "transform 20 s ahead": Kind(
        "/tf",
        TFMessage,
        lambda: transform(rospy.Time.now() + rospy.Duration(AHEAD_S)),
        {"/move_base0": "tf: transform dropped.*ahead"},
        1,
    ),
    "scan with a huge increment": Kind(
        "/scan0", LaserScan, lambda: scan(1e30), {"/move_base0": "scan0.*increment 1e"}
    ),
    "states at the end of time": Kind(
        STATES_TOPIC,
        MultiDOFJointState,
        lambda: states(1.0, END_OF_TIME),
        everyone("states: state dropped.*ahead"),
    ),
    "NaN intention": Kind(
        INTENTIONS_TOPIC, PointCloud2, intention, {"/move_base1": "intention dropped"}
    ),
    "contact of an unknown robot": Kind(
        "/simulation/contacts",
        ContactMessage,
        lambda: contact("quad77"),
        {SEQUENCER: "contacts: message dropped"},
    ),
    # rospy closes the connection without a line in the log.
    "scan that cannot be read": Kind(
        "/scan0", garbage(LaserScan), lambda: garbage_message(LaserScan), {}, 1
    ),
    "NaN goal of an action client": Kind(
        "/move_base0/goal", MoveBaseActionGoal, action_goal, {"/move_base0": "not finite"}, *FEW
    ),
}
