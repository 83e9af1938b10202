"""The other robots from their topics, and what this one tells them.

``/odom{j}`` and tf say where robot j is; ``/move_base{j}/intention``, a
``nav_msgs/Path`` of ours, where it is going: ``header.stamp`` is when it was said, the
poses are the way, and their stamps are the rank (``peers.rank_of``). An empty path
means that the robot is to stay where it is.
"""

from __future__ import annotations

from functools import partial
from typing import Dict, List, Mapping, Optional, Tuple

import numpy as np
import rospy
from nav_msgs.msg import Odometry, Path

from quad_nav.geometry import Pose2D
from quad_nav.peers.peer import IDLE_RANK_S, Intention, Peer, peer_at, rank_of, unknown_intention
from quad_nav.ros.common.convert import odometry_from_message, time_message
from quad_nav.ros.common.names import Names
from quad_nav.ros.common.nav_messages import path_message
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.topics.incoming import MOST_POSES, pose_problem, twist_problem, way_problem

REPEAT_S = 0.25
WORD_COUNTS_S = 2.0  # an older intention is that of a navigator that has died


class PeerTopics:
    """Robots 0 .. ``robots`` - 1 as seen by those among them that this node flies, ``own``.

    Each robot's odometry is heard once, whoever asks for it; what robots of one node
    intend they tell each other without a topic. Names of ``own`` say what they are called.
    """

    def __init__(
        self, own: Mapping[int, Names], robots: int, transforms: Transforms, global_frame: str
    ):
        self._transforms = transforms
        self._frame = global_frame
        self._odometry: Dict[int, Odometry] = {}
        self._seen: Dict[int, Tuple[Odometry, Peer]] = {}
        self._said: Dict[int, Tuple[float, Intention]] = {}  # when, and what
        others = [j for j in range(robots) if list(own) != [j]]
        self.subscribers = [
            rospy.Subscriber(f"/odom{j}", Odometry, partial(self._keep_odometry, j), queue_size=1)
            for j in others
        ]
        self._intentions = [
            rospy.Subscriber(
                f"/move_base{j}/intention", Path, partial(self._keep_intention, j), queue_size=1
            )
            for j in others
            if j not in own
        ]
        self._publishers = {
            number: rospy.Publisher(names("~intention"), Path, queue_size=1)
            for number, names in own.items()
        }
        self._told: Dict[int, Tuple[float, Intention]] = {}

    def _keep_odometry(self, number: int, message: Odometry) -> None:
        self._odometry[number] = message

    def _keep_intention(self, number: int, message: Path) -> None:
        self._said[number] = (
            message.header.stamp.to_sec(),
            intention_from_message(message, number),
        )

    def refresh(self, now_s: float) -> None:
        """Takes what has come."""
        for number, odometry in list(self._odometry.items()):
            before, peer = self._seen.get(number, (None, None))
            if odometry is not before:
                peer = self._located(number, odometry)
            if peer is None:
                self._seen.pop(number, None)
                continue
            intention = self._word(number, peer, now_s)
            if intention is not peer.intention:
                peer = peer.intending(intention)
            self._seen[number] = odometry, peer

    def near(self, number: int, here: Optional[Pose2D], reach_m: float) -> List[Peer]:
        """Every robot but ``number`` whose place is known, however old that is.

        Of those that are farther from ``here`` than ``reach_m`` some are left out.
        """
        others = [peer for other, (_, peer) in self._seen.items() if other != number]
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
            map_from_odom = self._transforms.lookup(self._frame, odometry.header.frame_id)
        except TransformUnavailable as error:
            rospy.logwarn_throttle(5.0, f"{name}: its place in {self._frame} is unknown: {error}")
            return None
        odom_from_base, velocity = odometry_from_message(odometry)
        problem = pose_problem(odom_from_base) or twist_problem(velocity)
        if problem:
            rospy.logwarn_throttle(5.0, f"{name}: its odometry is of no use: {problem}")
            return None
        pose = map_from_odom.compose(odom_from_base).to_2d()
        return peer_at(name, pose, velocity, odometry.header.stamp.to_sec())

    def _word(self, number: int, peer: Peer, now_s: float) -> Intention:
        if number not in self._said:
            return unknown_intention(peer)
        said_s, intention = self._said[number]
        if now_s - said_s > WORD_COUNTS_S:
            return Intention(rank_of(IDLE_RANK_S, number))
        return intention

    def tell(self, number: int, intention: Intention, now_s: float) -> None:
        """What a robot of this node is up to: at once when it changes, else every ``REPEAT_S``."""
        self._said[number] = now_s, intention
        if self._publishers[number].get_num_connections() == 0:
            return
        told_s, told = self._told.get(number, (0.0, None))
        same = told is not None and told.way is intention.way and told.rank_s == intention.rank_s
        if same and 0.0 <= now_s - told_s < REPEAT_S:
            return
        self._told[number] = now_s, intention
        self._publishers[number].publish(intention_message(intention, self._frame, now_s))


def intention_message(intention: Intention, frame: str, now_s: float) -> Path:
    way = np.column_stack((intention.way, np.zeros(len(intention.way))))
    message = path_message(way, frame, time_message(intention.rank_s))
    message.header.stamp = time_message(now_s)
    return message


def intention_from_message(message: Path, number: int) -> Intention:
    if not message.poses:
        return Intention(rank_of(IDLE_RANK_S, number))
    way = np.array(
        [(p.pose.position.x, p.pose.position.y) for p in message.poses[: MOST_POSES + 1]]
    )
    problem = way_problem(way)
    if problem:
        rospy.logwarn_throttle(5.0, f"quad{number}: its intention is of no use: {problem}")
        return Intention(rank_of(IDLE_RANK_S, number))
    return Intention(message.poses[0].header.stamp.to_sec(), way)
