"""Receive the states and intentions of peers, and publish those of this node's robots.

`/odom{j}` and tf carry the pose of robot j. `/move_base{j}/intention` is a `nav_msgs/Path` with
its intention: `header.stamp` is the time of publication, the poses are the path, and the stamps
of the poses hold the negated priority (`peers.peer.priority_of`), the time at which the goal was
set. An empty path means that the robot stays where it is.
"""

from __future__ import annotations

from functools import partial
from typing import Dict, List, Mapping, Optional, Tuple

import numpy as np
import rospy
from nav_msgs.msg import Odometry, Path

from quad_nav.geometry import Pose2D
from quad_nav.peers.peer import Intention, Peer, assumed_intention, idle_priority, peer_at
from quad_nav.ros.common.conversions import odometry_from_message, time_message
from quad_nav.ros.common.nav_messages import path_message
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.topics.publishing import Names
from quad_nav.topics.validation import (
    MAX_LEAD_S,
    MAX_POSES,
    odometry_problem,
    path_problem,
    stamp_problem,
)

REPEAT_S = 0.25
INTENTION_VALID_S = 2.0  # the navigator that published an older intention has died


class PeerTopics:
    """Track all robots for those that this node flies.

    The node subscribes once to each robot's odometry. Robots of the same node exchange their
    intentions without a topic.
    """

    def __init__(
        self, own: Mapping[int, Names], robots: int, transforms: Transforms, global_frame: str
    ) -> None:
        """Subscribe to the peers' topics.

        Args:
            own: Names of the topics of the robots that this node flies, by their numbers.
            robots: Number of all robots, numbered from 0.
            transforms: Converts odometry to the global frame.
            global_frame: Frame of the peers' states.
        """
        self._transforms = transforms
        self._frame = global_frame
        self._odometry: Dict[int, Odometry] = {}
        self._peers: Dict[int, Tuple[Odometry, Peer]] = {}
        self._intentions: Dict[int, Tuple[float, Intention]] = {}  # with the time
        others = [j for j in range(robots) if list(own) != [j]]
        self.subscribers = [
            rospy.Subscriber(f"/odom{j}", Odometry, partial(self._on_odometry, j), queue_size=1)
            for j in others
        ]
        self._intention_subscribers = [
            rospy.Subscriber(
                f"/move_base{j}/intention", Path, partial(self._on_intention, j), queue_size=1
            )
            for j in others
            if j not in own
        ]
        self._publishers = {
            number: rospy.Publisher(names("~intention"), Path, queue_size=1)
            for number, names in own.items()
        }
        self._published: Dict[int, Tuple[float, Intention]] = {}

    def _on_odometry(self, number: int, message: Odometry) -> None:
        self._odometry[number] = message

    def _on_intention(self, number: int, message: Path) -> None:
        intention, frame = intention_from_message(message, number), message.header.frame_id
        if len(intention.path) and frame.lstrip("/") != self._frame.lstrip("/"):
            try:
                global_from_frame = self._transforms.lookup(self._frame, frame)
            except TransformUnavailable as error:
                rospy.logwarn_throttle(
                    5.0,
                    f"quad{number}: intention dropped, expecting straight flight: frame '{frame}':"
                    f" {error}",
                )
                self._intentions.pop(number, None)
                return
            intention = intention.transformed(global_from_frame.to_2d())
        self._intentions[number] = message.header.stamp.to_sec(), intention

    def refresh(self, now_s: float) -> None:
        """Update the peers from the messages that have arrived."""
        for number, odometry in list(self._odometry.items()):
            before, peer = self._peers.get(number, (None, None))
            if odometry is not before:
                peer = self._located(number, odometry)
            if peer is None:
                self._peers.pop(number, None)
                continue
            intention = self._intention(number, peer, now_s)
            if intention is not peer.intention:
                peer = peer.with_intention(intention)
            self._peers[number] = odometry, peer

    def near(self, number: int, here: Optional[Pose2D], reach_m: float) -> List[Peer]:
        """Return the peers of a robot, without regard to the age of their states.

        Args:
            number: The robot, which is left out.
            here: Pose of the robot; None returns all peers.
            reach_m: Peers beyond this distance may be left out.
        """
        others = [peer for other, (_, peer) in self._peers.items() if other != number]
        if here is None:
            return others
        return [
            peer
            for peer in others
            if abs(peer.x_m - here.x_m) < reach_m and abs(peer.y_m - here.y_m) < reach_m
        ]

    def _located(self, number: int, odometry: Odometry) -> Optional[Peer]:
        name = f"quad{number}"
        try:
            global_from_odom = self._transforms.lookup_near(
                self._frame, odometry.header.frame_id, odometry.header.stamp.to_sec()
            )
        except TransformUnavailable as error:
            rospy.logwarn_throttle(
                5.0, f"{name}: pose in {self._frame} unknown, ignoring this peer: {error}"
            )
            return None
        odom_from_base, velocity = odometry_from_message(odometry)
        stamp_s = odometry.header.stamp.to_sec()
        problem = odometry_problem(
            odometry.header.frame_id, odom_from_base, velocity
        ) or stamp_problem(stamp_s, rospy.get_time())
        if problem:
            rospy.logwarn_throttle(5.0, f"{name}: odometry dropped, ignoring this peer: {problem}")
            return None
        pose = global_from_odom.compose(odom_from_base).to_2d()
        return peer_at(name, pose, velocity, stamp_s)

    def _intention(self, number: int, peer: Peer, now_s: float) -> Intention:
        received = self._intentions.get(number)
        if received is None:
            return assumed_intention(peer)
        sent_s, intention = received
        if not -MAX_LEAD_S <= now_s - sent_s <= INTENTION_VALID_S:
            return Intention(idle_priority(number))
        return intention

    def publish(self, number: int, intention: Intention, now_s: float) -> None:
        """Publish a robot's intention: at once when it changes, else every `REPEAT_S`."""
        self._intentions[number] = now_s, intention
        if self._publishers[number].get_num_connections() == 0:
            return
        published_s, published = self._published.get(number, (0.0, None))
        is_same = (
            published is not None
            and published.path is intention.path
            and published.priority == intention.priority
        )
        if is_same and 0.0 <= now_s - published_s < REPEAT_S:
            return
        self._published[number] = now_s, intention
        self._publishers[number].publish(intention_message(intention, self._frame, now_s))


def intention_message(intention: Intention, frame: str, now_s: float) -> Path:
    """Convert an intention in `frame` to a message."""
    path = np.column_stack((intention.path, np.zeros(len(intention.path))))
    message = path_message(path, frame, time_message(-intention.priority))
    message.header.stamp = time_message(now_s)
    return message


def intention_from_message(message: Path, number: int) -> Intention:
    """Convert the message of robot `number`; an invalid one counts as "stays where it is"."""
    if not message.poses:
        return Intention(idle_priority(number))
    path = np.array(
        [(p.pose.position.x, p.pose.position.y) for p in message.poses[: MAX_POSES + 1]]
    )
    problem = path_problem(path)
    if problem:
        rospy.logwarn_throttle(5.0, f"quad{number}: intention dropped: {problem}")
        return Intention(idle_priority(number))
    return Intention(-message.poses[0].header.stamp.to_sec(), path)
