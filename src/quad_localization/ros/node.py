"""Node ``amcl``: one robot that is localised by the topics of its scans and its odometry.

Callbacks store scans; the main thread hands them over when tf knows where the robot was.
"""

from __future__ import annotations

import sys
import time
from collections import deque
from typing import Deque, List, Optional

import numpy as np
import rospy
from sensor_msgs.msg import LaserScan

from quad_localization.localizer import Observation
from quad_localization.ros.amcl_robot import AmclRobot
from quad_localization.ros.peers import PeerPlaces
from quad_localization.ros.reset_watch import ResetWatch
from quad_localization.ros.transform_topic import TransformTopic
from quad_localization.warm_up import warm_up_amcl
from quad_nav.errors import printable
from quad_nav.files.kernel_cache import COMPILING, announced
from quad_nav.ros.common.conversions import scan_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings, publish_health
from quad_nav.ros.common.readiness import init_node
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.topics.validation import scan_problem, stamp_problem

EXIT_BAD_INPUT = 2
_QUEUE = 100
_POLL_S = 0.01  # wall time: how late a transform is noticed


class AmclNode:
    """The robot, and its scans that wait for their transforms."""

    def __init__(self) -> None:
        """Read the parameters, advertise, and ask for the map."""
        self._transforms, self._warnings = Transforms(), ThrottledWarnings()
        self.robot = AmclRobot(self._transforms, TransformTopic().send)
        self._scans: Deque[LaserScan] = deque(maxlen=_QUEUE)
        self._has_odometry = False
        self._peers = self._find_peers()
        self._resets = ResetWatch()
        rospy.Subscriber("scan", LaserScan, self._on_scan, queue_size=_QUEUE)
        publish_health(lambda: [self.robot.health()])

    def _warn(self, text: str) -> None:
        self._warnings.warn(f"{self.robot.name}: {text}")

    def _find_peers(self) -> Optional[PeerPlaces]:
        if not self.robot.leaves_out_peers:
            return None
        if self.robot.robot is None:
            self._warn("no number in base_frame_id or in the node's name: peers are not left out")
            return None
        return PeerPlaces(self.robot.robot, self._transforms)

    def _on_scan(self, message: LaserScan) -> None:
        self._resets.begin(message.header.stamp.to_sec())
        self._scans.append(message)

    def run(self) -> None:
        """Handle scans until ROS shuts down."""
        before_s = rospy.get_time()
        while not rospy.is_shutdown():
            now_s = rospy.get_time()
            if now_s < before_s:
                self._warn("the clock jumped back: waiting scans dropped")
                self._scans.clear()
            before_s = now_s
            self.step(now_s)
            time.sleep(_POLL_S)

    def step(self, now_s: float) -> None:
        """Handle the scans that wait, if tf knows where they were taken."""
        if self._resets.pop(now_s):
            self._scans.clear()
            self.robot.reset()
        if self._peers is not None:
            self._peers.check()
        while self._scans and self._handle(self._scans[0]):
            self._scans.popleft()

    def _handle(self, message: LaserScan) -> bool:
        """Hand a scan over; return false if it has to wait for tf."""
        params, stamp, frame = self.robot.params, message.header.stamp, message.header.frame_id
        odom, base = params.odom_frame_id, params.base_frame_id
        scan = scan_from_message(message)
        problem = stamp_problem(scan.stamp_s, rospy.get_time())
        if not (problem or params.upstream):
            problem = scan_problem(scan)
        try:
            if not problem:
                odometry = self._transforms.lookup(odom, base, stamp)
                mount = self._transforms.lookup(base, frame)
        except TransformUnavailable as error:
            latest = self._transforms.locate(odom, base, scan.stamp_s, 0.0)
            if latest is None and (error.later or not self._has_odometry):
                if len(self._scans) == _QUEUE:
                    self._warn(f"scans wait for tf: {error}")
                return False  # the stamp is younger than the latest transform
            problem = str(error)
        if problem:
            self._warn(f"scan dropped: {problem}")
            return True
        self._has_odometry = True
        peers = np.empty((0, 2))
        if self._peers is not None:
            peers = self._peers.at(scan.stamp_s, params.global_frame_id)
        self.robot.localise(stamp, Observation(frame.lstrip("/"), scan, mount, odometry, peers))
        return True


def main() -> int:
    """Run the node; return 0 after a shutdown, 2 for an argument."""
    arguments = rospy.myargv(sys.argv)[1:]
    if arguments:
        text = f"amcl: {' '.join(arguments)}: expected no argument; for a bag use rosbag play"
        print(printable(text), file=sys.stderr)
        return EXIT_BAD_INPUT
    nodes: List[AmclNode] = []

    def save() -> None:
        for node in nodes:
            node.robot.save_pose()

    init_node("amcl", save)
    with announced(lambda: rospy.loginfo("%s", COMPILING)):
        warm_up_amcl()
    try:
        nodes.append(AmclNode())
        nodes[0].run()
    except rospy.ROSException:
        if not rospy.core.is_shutdown_requested():  # at shutdown rospy closes the topics
            raise
    return 0
