"""A real localization and real navigators in one process, on a virtual clock.

Quadcopter 0 flies in its room by ``amcl`` or ``slam``, with odometry that errs; somebody spoils
what the nodes get.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from interaction.navigator_world import ROOM_M, STARTS, NavigatorWorld
from nav_msgs.msg import OccupancyGrid
from tf2_msgs.msg import TFMessage

from quad_localization.ros.node import AmclNode
from quad_localization.ros.slam import SlamNode
from quad_nav.costmap.static import StaticMap
from quad_nav.files.document import read_yaml
from quad_nav.files.shipped import shipped
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec
from quad_nav.ros.common import conversions
from quad_nav.ros.common.nav_messages import map_message
from quad_nav.sim.odometry import Odometry, OdometryErrors

CELL_M = 0.05
NODES = {"amcl": "/amcl0", "slam": "/slam"}
_ERRORS = OdometryErrors(per_m=0.05, per_rad=0.05)
_START = STARTS[0]
_MOST_PARTICLES = 500
"""At sums of arrays above 256 kB numpy looks at its callers, and crashes in a greenlet."""


class LocalizedWorld(NavigatorWorld):
    """The rooms, the navigators, and the localization of quadcopter 0.

    Attributes:
        spoilt: What quadcopter 0 sends with NaN, of "ranges", "odometry pose" and "mount".
        jump_m: How far its odometry is beside what it has measured.
        frame: The last transform from `odom0` to `map`, `flown_s` when it came; None before.
    """

    def __init__(self, localization, has_map=True, *clock):
        self.localization, self.spoilt, self.frame = localization, set(), None
        self.jump_m = 0.0
        self._measured = Odometry(_ERRORS, _row(_START), 0.0, 1)
        super().__init__("default", False, False, *clock)
        resolve = self.graph.resolve
        self.graph.resolve = lambda name, _=None: (
            resolve(name)
            + ("0" if self.graph.node.name == "/amcl0" and name in ("scan", "initialpose") else "")
        )
        frames = {"odom_frame_id": "odom0", "base_frame_id": "base_link0", "use_map_topic": True}
        start = {"initial_pose_x": _START.x_m, "initial_pose_y": _START.y_m, "seed": 1}
        params = read_yaml(shipped("localization", "amcl.yaml"))
        params["max_particles"] = _MOST_PARTICLES
        self.graph.parameters["~"] = {**params, **frames, **start}
        self._map = rospy.Publisher("/map", OccupancyGrid, queue_size=1, latch=True)
        if has_map:
            self.send_map()
        self.start_localization()

    def start_localization(self):
        """Start the node."""

        def main():
            if self.localization == "amcl":
                AmclNode().run()
            else:
                SlamNode(1, {0: _START}).spin()

        self.graph.start(NODES[self.localization], main)

    def send_map(self, origin_m=0.0):
        """Send the map of room 0 to amcl; slam makes its own."""
        if self.localization != "amcl":
            return
        cells = np.zeros((round(ROOM_M / CELL_M) + 2,) * 2, np.int8)
        cells[0] = cells[-1] = cells[:, 0] = cells[:, -1] = 100
        spec = GridSpec(*cells.shape, CELL_M, origin_m - CELL_M, -CELL_M)
        self._map.publish(map_message(StaticMap(cells, spec), self._clock()))

    def give(self, pose, frame="map", variance=0.01):
        """Tell the localization where quadcopter 0 is."""
        message = PoseWithCovarianceStamped()
        message.header.frame_id = frame
        message.pose.pose = conversions.pose_message(pose.to_3d())
        message.pose.covariance = (variance * np.eye(6)).ravel().tolist()
        self.graph.publish("/initialpose0", message)

    @property
    def error_m(self):
        """How far quadcopter 0 believes itself from where it is."""
        found = self.frame[1].compose(self._odom_from_base)
        return found.distance_to(self.bodies[0].pose)

    @property
    def is_hovering(self):
        velocity = self.bodies[0].velocity
        return not any((velocity.vx_mps, velocity.vy_mps, velocity.vyaw_radps))

    def has_logged(self, text, since=0):
        """Return whether a line of the log since one has a text."""
        return any(text in line for _, _, _, line in self.graph.log[since:])

    @property
    def _odom_from_base(self):
        return self.bodies[0].pose.relative_to(self._measured.frames.map_from_odom(0))

    def _simulate(self):
        rospy.Subscriber("/tf", TFMessage, self._on_tf)
        super()._simulate()

    def _on_tf(self, message):
        for one in message.transforms:
            if (one.header.frame_id, one.child_frame_id) == ("map", "odom0"):
                pose = conversions.pose_from_transform(one).to_2d()
                self.frame = self.flown_s, pose

    def _step(self):
        super()._step()
        self._measured.update(_row(self.bodies[0].pose), self.flown_s)

    def _transforms(self, robot, stamp):
        if robot != 0:
            return super()._transforms(robot, stamp)
        _, odometry, mount = super()._transforms(robot, stamp)
        pose = Pose2D(self.jump_m, 0.0).compose(self._odom_from_base).to_3d()
        odometry = conversions.transform_message(pose, "odom0", "base_link0", stamp)
        for name, one in (("odometry pose", odometry), ("mount", mount)):
            if name in self.spoilt:
                one.transform.translation.x = math.nan
        return [odometry, mount]

    def _scan_of(self, robot, before_s):
        scan = super()._scan_of(robot, before_s)
        if robot == 0 and "ranges" in self.spoilt:
            return replace(scan, ranges_m=np.full_like(scan.ranges_m, np.nan))
        return scan


def _row(pose):
    return np.array([[pose.x_m, pose.y_m, pose.yaw_rad]])


WRONG = Pose2D(5.0, 6.0, 0.7)
"""A pose in the room that is not that of the quadcopter."""
