"""The other robots from their topics, and what this one tells them.

``/odom{j}`` and tf say where robot j is; ``/move_base{j}/intention``, a
``nav_msgs/Path`` of ours, where it is going: ``header.stamp`` is when it was said, the
poses are the way, and their stamps are the rank (``peers.rank_of``). An empty path
means that the robot is to stay where it is.
"""
from __future__ import annotations

from functools import partial
from typing import Dict, List, Optional, Tuple

import numpy as np
import rospy
from nav_msgs.msg import Odometry, Path

from quad_nav.peers import IDLE_RANK_S, Intention, Peer, peer_at, rank_of, unknown_intention
from quad_nav.ros.convert import odometry_from_message, time_message
from quad_nav.ros.nav_messages import path_message
from quad_nav.ros.transforms import Transforms, TransformUnavailable

REPEAT_S = 0.25
WORD_COUNTS_S = 2.0  # an older intention is that of a navigator that has died


class PeerTopics:
    """Listens to robots 0 .. ``robots`` - 1 but ``number``, and tells them of this one."""

    def __init__(self, number: int, robots: int, transforms: Transforms, global_frame: str):
        self._transforms = transforms
        self._frame = global_frame
        self._odometry: Dict[int, Odometry] = {}
        self._said: Dict[int, Tuple[float, Intention]] = {}  # when, and what
        others = [j for j in range(robots) if j != number]
        self.subscribers = [
            rospy.Subscriber(f"/odom{j}", Odometry, partial(self._keep_odometry, j), queue_size=1)
            for j in others]
        self._intentions = [
            rospy.Subscriber(f"/move_base{j}/intention", Path, partial(self._keep_intention, j),
                             queue_size=1) for j in others]
        self._publisher = rospy.Publisher("~intention", Path, queue_size=1)
        self._told: Optional[Intention] = None
        self._told_s = 0.0

    def _keep_odometry(self, number: int, message: Odometry) -> None:
        self._odometry[number] = message

    def _keep_intention(self, number: int, message: Path) -> None:
        self._said[number] = (message.header.stamp.to_sec(),
                              intention_from_message(message, number))

    def peers(self, now_s: float) -> List[Peer]:
        """Every robot whose place is known, however old that is."""
        return [peer for peer in (self._peer(j, odometry, now_s)
                                  for j, odometry in list(self._odometry.items())) if peer]

    def _peer(self, number: int, odometry: Odometry, now_s: float) -> Optional[Peer]:
        name = f"quad{number}"
        try:
            map_from_odom = self._transforms.lookup(self._frame, odometry.header.frame_id)
        except TransformUnavailable as error:
            rospy.logwarn_throttle(5.0, f"{name}: its place in {self._frame} is unknown: {error}")
            return None
        odom_from_base, velocity = odometry_from_message(odometry)
        pose = map_from_odom.compose(odom_from_base).to_2d()
        peer = peer_at(name, pose, velocity, odometry.header.stamp.to_sec())
        if number not in self._said:
            return peer.intending(unknown_intention(peer))
        said_s, intention = self._said[number]
        if now_s - said_s > WORD_COUNTS_S:
            return peer.intending(Intention(rank_of(IDLE_RANK_S, number)))
        return peer.intending(intention)

    def tell(self, intention: Intention, now_s: float) -> None:
        """What this robot is up to: at once when it changes, else every ``REPEAT_S``."""
        same = self._told is not None and self._told.way is intention.way \
            and self._told.rank_s == intention.rank_s
        if same and 0.0 <= now_s - self._told_s < REPEAT_S:
            return
        self._told, self._told_s = intention, now_s
        self._publisher.publish(intention_message(intention, self._frame, now_s))


def intention_message(intention: Intention, frame: str, now_s: float) -> Path:
    way = np.column_stack((intention.way, np.zeros(len(intention.way))))
    message = path_message(way, frame, time_message(intention.rank_s))
    message.header.stamp = time_message(now_s)
    return message


def intention_from_message(message: Path, number: int) -> Intention:
    if not message.poses:
        return Intention(rank_of(IDLE_RANK_S, number))
    way = [(p.pose.position.x, p.pose.position.y) for p in message.poses]
    return Intention(message.poses[0].header.stamp.to_sec(), np.array(way))
