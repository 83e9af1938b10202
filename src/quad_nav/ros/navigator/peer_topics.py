"""Receive the states and intentions of peers, and publish those of this node's robots.

`state_topics` describes where states come from, `intention_topics` where intentions do. States of
this node's robots that come from odometry, as those of real quadcopters do, are published for the
other hosts in one message.
"""

from __future__ import annotations

from typing import Dict, List, Mapping, Optional, Set, Tuple

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D, yaws_from_quaternions
from quad_nav.peers.peer import Intention, Peer
from quad_nav.ros.common.conversions import odometry_from_message, time_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.packed_messages import (
    STATES_TOPIC,
    Floats,
    States,
    StatesMessage,
    pose_row,
    states_message,
)
from quad_nav.ros.common.readiness import TopicWatch
from quad_nav.ros.common.state_topics import StateTopics
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.ros.navigator.intention_topics import (
    IntentionListener,
    host_publisher,
    robot_publisher,
)
from quad_nav.ros.navigator.robot_identity import MAX_ROBOTS
from quad_nav.topics.publishing import Names
from quad_nav.topics.validation import odometry_problem, stamp_problem


class PeerTopics:
    """Track all robots for those that this node flies.

    The robots of a node share one subscription to the states of all. They exchange their
    intentions without a topic.
    """

    def __init__(
        self, own: Mapping[int, Names], robots: int, transforms: Transforms, global_frame: str
    ) -> None:
        """Subscribe to the peers' topics.

        Args:
            own: Names of the topics of the robots that this node flies, by their numbers.
            robots: Number of all robots, numbered from 0; 0 if it is not known: then the peers are
                those in messages and those whose odometry is published.
            transforms: Converts states to the global frame.
            global_frame: Frame of the peers' states.
        """
        self._own, self._transforms, self._frame = frozenset(own), transforms, global_frame
        self._finds, robots = robots == 0, robots or max(MAX_ROBOTS, *(j + 1 for j in own))
        self._found: Set[int] = set()
        self._odometry: Dict[int, Odometry] = {}
        self._states = np.full((robots, 5), np.nan)  # x, y, vx, vy in the frame, and the stamp
        self._peers: Dict[int, Peer] = {}  # of the last refresh, those that were asked for
        self._snapshot: Optional[Floats] = None  # of the states, since the last refresh
        self._now_s = 0.0
        self._topic_watch, self._warnings = TopicWatch(), ThrottledWarnings()
        # Alone there is no peer to hear, and none that listens.
        self._topics = self._subscribe(robots, own) if robots > 1 else None
        self._publisher = rospy.Publisher(STATES_TOPIC, StatesMessage, queue_size=10)
        self._intentions = IntentionListener(
            (j for j in range(robots) if j not in own),
            transforms,
            global_frame,
            own,
            self._finds,
        )
        self._own_intentions: Dict[int, Intention] = {}
        self._publishers = {
            number: robot_publisher(names, global_frame) for number, names in own.items()
        }
        self._host_publisher = host_publisher(global_frame, len(self._intentions.subscribers))

    def _subscribe(self, robots: int, own: Mapping[int, Names]) -> StateTopics:
        return StateTopics(
            robots,
            self._on_states,
            self._on_odometry,
            self._watch,
            topic=lambda j: rospy.resolve_name(own[j]("odom")) if j in own else f"/odom{j}",
            only_published=self._finds,
        )

    def _watch(self, robot: int, subscriber: rospy.Subscriber) -> None:
        if robot not in self._own:  # whose topics are watched by their navigators
            self._topic_watch.add(subscriber)

    def _on_odometry(self, robot: int, message: Odometry) -> None:
        self._odometry[robot] = message

    def _on_states(self, states: States) -> bool:
        if states.frame.lstrip("/") == self._frame.lstrip("/"):
            self._store(states, Pose2D(0.0, 0.0))
            return True
        stamp = time_message(states.stamp_s)
        try:
            pose = self._transforms.lookup_near(self._frame, states.frame, stamp)
        except TransformUnavailable as error:
            self._warnings.warn(
                f"{STATES_TOPIC}: states dropped: pose in {self._frame} unknown: {error}",
                kind=STATES_TOPIC,
            )
            return False
        self._store(states, pose.to_2d())
        return True

    def _store(self, states: States, global_from_frame: Pose2D) -> None:
        """Store the planar part of states in a frame."""
        rows = np.empty((len(states.robots), 5))
        rows[:, :2] = global_from_frame.transform_points(states.poses[:, :2])
        yaw_rad = yaws_from_quaternions(states.poses[:, 3:]) + global_from_frame.yaw_rad
        cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
        vx_mps, vy_mps = states.twists[:, 0], states.twists[:, 1]
        rows[:, 2], rows[:, 3] = cos * vx_mps - sin * vy_mps, sin * vx_mps + cos * vy_mps
        rows[:, 4] = states.stamp_s
        self._states[states.robots] = rows

    def refresh(self, now_s: float) -> None:
        """Let `near` update the peers from what has arrived, and publish what is due."""
        if self._topics is not None:
            self._topics.check()
            self._topic_watch.check()
        self._take_odometry()
        self._now_s, self._snapshot = now_s, None
        self._peers.clear()
        self._host_publisher.publish(self._own_intentions, now_s)

    def _take_snapshot(self) -> Floats:
        if self._topics is not None:
            self._topics.read()
        if self._finds:
            self._log_found()
        return self._states.copy()

    def _log_found(self) -> None:
        known = set(np.flatnonzero(~np.isnan(self._states[:, 0])).tolist())
        for robot in sorted(known - self._own - self._found):
            self._found.add(robot)
            rospy.loginfo("quad%d: found quad%d, avoiding it", min(self._own), robot)

    def _take_odometry(self) -> None:
        """Locate the robots that are in no state message; publish those of this node."""
        if not self._odometry:
            return
        messages, self._odometry = self._odometry, {}
        by_stamp: Dict[float, List[Tuple[int, Floats, Floats]]] = {}
        for number, message in messages.items():
            state = self._located(number, message)
            if state is not None:
                stamp_s = message.header.stamp.to_sec()
                by_stamp.setdefault(stamp_s, []).append((number, *state))
        for stamp_s, rows in by_stamp.items():
            numbers, poses, twists = (np.array(column) for column in zip(*rows))
            states = States(stamp_s, self._frame, numbers, poses, twists)
            self._store(states, Pose2D(0.0, 0.0))
            own = states.of(np.isin(states.robots, list(self._own)))
            if len(own.robots) and self._publisher.get_num_connections() > 1:  # one is its own
                self._publisher.publish(states_message(own))

    def near(self, number: int, here: Optional[Pose2D], reach_m: float) -> List[Peer]:
        """Return the peers of a robot, without regard to the age of their states.

        Args:
            number: The robot, which is left out.
            here: Pose of the robot; None returns all peers.
            reach_m: Peers beyond this distance may be left out.
        """
        if self._snapshot is None:
            self._snapshot = self._take_snapshot()
        states = self._snapshot
        x_m, y_m = states[:, 0], states[:, 1]
        if here is None:
            is_near: NDArray[np.bool_] = ~np.isnan(x_m)
        else:
            is_near = (np.abs(x_m - here.x_m) < reach_m) & (np.abs(y_m - here.y_m) < reach_m)
        others = [other for other in np.flatnonzero(is_near).tolist() if other != number]
        return [self._peer(other, states[other]) for other in others]

    def _peer(self, number: int, state: Floats) -> Peer:
        peer = self._peers.get(number)
        if peer is None:
            peer = Peer(f"quad{number}", *state.tolist())
            peer = peer.with_intention(self._intentions.of(number, peer, self._now_s))
            self._peers[number] = peer
        return peer

    def _located(self, number: int, odometry: Odometry) -> Optional[Tuple[Floats, Floats]]:
        """Return pose and velocities in the global frame as in `States`; None if not valid."""
        header, twist = odometry.header, odometry.twist.twist
        try:
            global_from_odom = self._transforms.lookup_near(
                self._frame, header.frame_id, header.stamp
            )
        except TransformUnavailable as error:
            problem = f"pose in {self._frame} unknown: {error}"
        else:
            odom_from_base, velocity = odometry_from_message(odometry)
            problem = odometry_problem(header.frame_id, odom_from_base, velocity) or stamp_problem(
                header.stamp.to_sec(), rospy.get_time()
            )
        if problem:
            self._warnings.warn(
                f"quad{number}: odometry dropped, ignoring this peer: {problem}",
                kind=f"quad{number}",
            )
            return None
        linear, angular = twist.linear, twist.angular
        return (
            pose_row(global_from_odom.compose(odom_from_base)),
            np.array((linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)),
        )

    def publish(self, number: int, intention: Intention, now_s: float) -> None:
        """Publish a robot's intention: at once when it changes, else from time to time."""
        self._intentions.set(number, intention, now_s)
        self._own_intentions[number] = intention
        self._publishers[number].publish({number: intention}, now_s)
