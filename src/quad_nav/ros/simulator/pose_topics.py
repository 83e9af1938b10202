"""Publish transforms, states and odometry of the simulated quadcopters."""

from __future__ import annotations

from typing import Optional, Tuple

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from tf2_msgs.msg import TFMessage

from quad_nav.geometry import Pose3D, covariance_36
from quad_nav.ros.common.conversions import time_message
from quad_nav.ros.common.packed_messages import (
    STATES_TOPIC,
    Floats,
    OdometryWriter,
    States,
    StatesMessage,
    TransformWriter,
    pose_row,
    states_message,
)
from quad_nav.ros.navigator.costmap_publisher import NewSubscriber, Publish
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.sim.odometry import pose_in
from quad_nav.sim.simulation import Simulation
from quad_nav.topics.estimates import TRUTH_TOPIC


class PoseTopics:
    """Publishers of `/tf`, of the states of all quadcopters in one message, and of `/odom{i}`."""

    def __init__(self, simulation: Simulation, localizes: bool) -> None:
        """Advertise the topics, and lay out their messages.

        Without ``localizes`` somebody else publishes `map -> odom{i}`, and only `/quad/truth` tells
        where a quadcopter is in `map`.
        """
        self._simulation = simulation
        self._first = 0 if localizes else 1  # of a quadcopter's transforms
        self._drifts = not simulation.params.odom_drift.is_zero
        robots = range(simulation.n_robots)
        frames = [_frames(i) for i in robots]
        self._transforms = np.empty((len(robots), 3, 7))
        self._transforms[:] = (
            pose_row(Pose3D(0, 0, 0)),
            pose_row(Pose3D(0, 0, 0)),
            pose_row(base_from_lidar),
        )
        self._transform_writer = TransformWriter(
            [pair for pairs in frames for pair in pairs[self._first :]]
        )
        self._odometry_writers = [OdometryWriter(*pairs[1]) for pairs in frames]
        self._last: Optional[rospy.AnyMsg] = None
        self._tf = rospy.Publisher("/tf", TFMessage, NewSubscriber(self._send_last), queue_size=10)
        self._odometry = [rospy.Publisher(f"/odom{i}", Odometry, queue_size=10) for i in robots]
        topic = STATES_TOPIC if localizes else TRUTH_TOPIC
        self._states = rospy.Publisher(topic, StatesMessage, queue_size=10)
        self._in_bulk = self._robots_in_bulk()

    def _robots_in_bulk(self) -> NDArray[np.int64]:
        """Return the robots whose states are published in one message.

        If odometry or tf is remapped, another node publishes what the others hear of a robot.
        """
        if self._first:
            return np.arange(self._simulation.n_robots)
        if self._tf.resolved_name != "/tf":
            return np.zeros(0, np.int64)
        names = [publisher.resolved_name for publisher in self._odometry]
        return np.flatnonzero([name == f"/odom{i}" for i, name in enumerate(names)])

    def publish(self, with_transforms: bool = True) -> None:
        """Publish the present poses; states and odometry only for subscribers."""
        stamp = time_message(self._simulation.now_s)
        bodies = self._simulation.body_state
        poses = bodies.rows[:, :7]
        if with_transforms:
            self._publish_transforms(stamp, poses)
        heard = [i for i, one in enumerate(self._odometry) if one.get_num_connections()]
        bulk = self._in_bulk if self._states.get_num_connections() else self._in_bulk[:0]
        if not heard and not len(bulk):
            return
        velocities = bodies.rows[:, 7:].reshape(-1, 2, 3)  # linear and angular, in map
        twists = np.einsum("nij,nki->nkj", bodies.rotations, velocities).reshape(-1, 6)
        if len(bulk):
            states = States(self._simulation.now_s, "map", bulk, poses[bulk], twists[bulk])
            self._states.publish(states_message(states))
        for i in heard:
            pose = self._in_odom(i, poses[i])
            odometry = self._simulation.odometry
            covariance = None if odometry is None else covariance_36(odometry.covariances[i])
            message = self._odometry_writers[i].message(stamp, pose, twists[i], covariance)
            self._odometry[i].publish(message)

    def _publish_transforms(self, stamp: rospy.Time, poses: Floats) -> None:
        """Publish `map -> odom{i} -> base_link{i} -> Lidar{i}` of all quadcopters."""
        transforms = self._transforms
        transforms[:, 1] = poses
        if self._drifts:
            for i, pose in enumerate(poses):
                transforms[i, 0] = pose_row(self._simulation.map_from_frame(f"odom{i}", i).to_3d())
                transforms[i, 1] = self._in_odom(i, pose)
        rows = transforms[:, self._first :].reshape(-1, 7)
        self._last = self._transform_writer.message(stamp, rows)
        self._tf.publish(self._last)

    def _send_last(self, send: Publish) -> None:
        """Send it to a node that subscribes while the simulation is paused.

        A latch would hold what another publisher of this process has sent.
        """
        if self._last is not None:
            send(self._last)

    def _in_odom(self, robot: int, map_from_base: Floats) -> Floats:
        """Return the pose of a quadcopter in its odometry frame, float64[7]."""
        if not self._drifts:
            return map_from_base
        x, y, z, qx, qy, qz, qw = map_from_base.tolist()
        map_from_odom = self._simulation.map_from_frame(f"odom{robot}", robot)
        return pose_row(pose_in(map_from_odom, Pose3D(x, y, z, (qx, qy, qz, qw))))


def _frames(robot: int) -> Tuple[Tuple[str, str], ...]:
    """Return the parent and child frames of a quadcopter's transforms."""
    odom, base = f"odom{robot}", f"base_link{robot}"
    return (("map", odom), (odom, base), (base, f"Lidar{robot}"))
