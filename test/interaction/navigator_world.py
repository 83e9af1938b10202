"""Two real navigators, each in a simulated room, on a virtual clock.

Quadcopter 0 is the one that things happen to: walkers and quadcopter 2, which nobody navigates,
are in its room. Quadcopter 1 flies in a room of its own, far away. Bodies follow their last
command at once, and hover when it is older than 0.5 s. Scans are computed, without noise.
"""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus
from dynamic_reconfigure.encoding import encode_config
from dynamic_reconfigure.srv import ReconfigureRequest
from geometry_msgs.msg import PoseStamped, Twist
from interaction.virtual_ros import Graph
from move_base_msgs.msg import MoveBaseActionFeedback, MoveBaseActionResult
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from quad_nav import config
from quad_nav.config.robot_tree import RobotSource, robot_tree
from quad_nav.geometry import Pose2D, Pose3D, Scan, Twist2D
from quad_nav.ros.common import conversions
from quad_nav.ros.common.packed_messages import (
    STATES_TOPIC,
    States,
    StatesMessage,
    pose_row,
    states_message,
)
from quad_nav.ros.navigator.loop import NavigatorLoop
from quad_nav.ros.navigator.nodes import Fleet
from quad_nav.topics.publishing import in_fleet

ROOT = Path(__file__).resolve().parents[2]
STEP_S = 0.1
CONTROL_HZ = 5.0
SECOND_S = 0.03  # the second LIDAR scans so long before the first one
ROOM_M, FAR_M = 8.0, 100.0
BEAMS, WALKER_M = 180, 0.3
ASIDE_M = 0.8
"""A walker that comes so close to a quadcopter goes away."""
LEASE_S = 0.5
STARTS = (Pose2D(1.5, 4.0), Pose2D(FAR_M + 1.5, 4.0))
FAR_GOAL = Pose2D(FAR_M + 6.5, 4.5)


@lru_cache(maxsize=None)
def configuration(name, robot, has_second_lidar):
    """Return a configuration of the project with small costmaps and 5 control cycles a second."""
    tree = robot_tree(RobotSource(name, robot))
    tree.update(robot=robot, robots=3, controller_frequency=CONTROL_HZ)
    tree["global_costmap"].update(width=ROOM_M, height=ROOM_M, resolution=0.1)
    tree["global_costmap"].update(origin_x=FAR_M * robot, origin_y=0.0)
    tree["local_costmap"].update(width=3.0, height=3.0, resolution=0.1)
    tree["local_costmap"].update(update_frequency=CONTROL_HZ)
    for costmap in ("global_costmap", "local_costmap") if has_second_lidar else ():
        tree[costmap]["observation_sources"] = "base_scan second_scan"
        tree[costmap]["second_scan"] = {**tree[costmap]["base_scan"], "topic": f"second{robot}"}
    return config.load(tree)


class Body:
    """A quadcopter that follows commands at once."""

    def __init__(self, pose):
        self.pose = self.before = pose
        self._command, self._since_s = Twist2D(), 0.0

    def take(self, twist):
        self._command, self._since_s = twist, 0.0

    @property
    def velocity(self):
        return self._command if self._since_s < LEASE_S else Twist2D()

    def advance(self):
        pose, twist = self.pose, self.velocity
        dx_m, dy_m = pose.rotate(twist.vx_mps * STEP_S, twist.vy_mps * STEP_S)
        yaw_rad = pose.yaw_rad + twist.vyaw_radps * STEP_S
        self.before, self.pose = pose, Pose2D(pose.x_m + dx_m, pose.y_m + dy_m, yaw_rad)
        self._since_s += STEP_S

    def pose_at(self, before_s):
        """Return the pose a time ago, less than a step."""
        share, a, b = before_s / STEP_S, self.pose, self.before
        return Pose2D(
            a.x_m + share * (b.x_m - a.x_m),
            a.y_m + share * (b.y_m - a.y_m),
            a.yaw_rad + share * (b.yaw_rad - a.yaw_rad),
        )


class Walker:
    """A disc that moves straight on.

    Attributes:
        age_s: Time since it appeared.
    """

    def __init__(self, x_m, y_m, vx_mps, vy_mps):
        self.vx_mps, self.vy_mps, self.age_s = vx_mps, vy_mps, 0.0
        self._x_m, self._y_m = x_m, y_m

    def place(self, before_s=0.0):
        seconds = self.age_s - before_s
        return self._x_m + self.vx_mps * seconds, self._y_m + self.vy_mps * seconds

    @property
    def is_in_room(self):
        return all(WALKER_M < place < ROOM_M - WALKER_M for place in self.place())


class Command(NamedTuple):
    """A command of quadcopter 0.

    Attributes:
        flown_s: When it came, as `NavigatorWorld.flown_s`.
        now_s: The same on the virtual clock, as in the log.
        twist: Velocities.
        pose: Where it was then.
        oldest_s: Age of its oldest data then.
    """

    flown_s: float
    now_s: float
    twist: Twist2D
    pose: Pose2D
    oldest_s: float

    @property
    def is_stop(self):
        return self.twist == Twist2D()


class NavigatorWorld:
    """The rooms, the quadcopters, and the nodes that navigate them.

    Attributes:
        graph: The nodes.
        ns: Simulated time in ns.
        is_running: Whether the simulated clock runs.
        flown_s: Time for which it has run; it never goes back.
        bodies: Quadcopters 0 and 1.
        walkers: Those in room 0.
        peer: Pose of quadcopter 2; None if it is not there.
        lost: What quadcopter 0 does not get, of "scan", "second scan", "odometry", "tf", "peer".
        last_s: `flown_s` at which it got each of them last, or its navigator began anew.
        commands: Those that quadcopter 0 has got.
        cycles: `flown_s` of the control cycles of its goal.
        results: `flown_s` at which its goals have ended by themselves.
        fleets: What the nodes run, by the numbers of their robots.
    """

    def __init__(self, name, is_composed, has_second_lidar=False, begin_ns=10**9, is_rounded=False):
        self.ns, self._begin_ns, self._is_rounded = begin_ns, begin_ns, is_rounded
        self.is_running, self.flown_s, self._steps = True, 0.0, 0
        self._has_second_lidar = has_second_lidar
        self._configurations = [
            configuration(name, 0, has_second_lidar),
            configuration(name, 1, False),
        ]
        self.walkers, self.peer, self.lost, self.last_s = [], None, set(), {}
        self.commands, self.cycles, self.results = [], [], []
        self.graph = Graph(self._clock)
        self._context = self.graph.running()
        self._context.__enter__()
        self.start_simulator()
        self._nodes, self.fleets = {}, {}
        for robots in [(0, 1)] if is_composed else [(0,), (1,)]:
            self.start_navigators(robots)
        self.graph.run(2 * STEP_S)
        self.send_goal(FAR_GOAL, robot=1)

    def close(self):
        self._context.__exit__(None, None, None)

    def run(self, seconds):
        self.graph.run(seconds)

    def _clock(self, before_s=0.0):
        ns = self.ns - round(before_s * 1e9)
        if self._is_rounded:  # as a simulator does that publishes rospy.Time.from_sec
            return rospy.Time.from_sec(ns * 1e-9)
        return rospy.Time(*divmod(ns, 10**9))

    # Nodes.

    def start_navigators(self, robots):
        """Start the node that navigates some robots."""

        def main():
            fleet = Fleet({robot: self._configurations[robot] for robot in robots}, in_fleet)
            self.fleets[robots] = fleet
            NavigatorLoop(fleet.robots, fleet.peers, 0.001).run()

        self._nodes[robots] = self.graph.start(f"/move_base{robots[0]}", main)
        self._begin_anew()

    def kill_navigators(self, robots):
        self.graph.kill(self._nodes.pop(robots))
        del self.fleets[robots]

    def start_simulator(self):
        """Start it: its clock and the quadcopters are where they begin."""
        self.ns, self.bodies = self._begin_ns, [Body(start) for start in STARTS]
        self._simulator = self.graph.start("/simulator", self._simulate)
        self._begin_anew()

    def step_clock(self, seconds):
        self.ns += round(seconds * 1e9)
        self._begin_anew()

    def _begin_anew(self):
        """Count the ages of all data from now on: the navigators have forgotten them."""
        self.last_s = dict.fromkeys(self.last_s, self.flown_s)

    def kill_simulator(self):
        self.graph.kill(self._simulator)

    # Requests of people.

    def send_goal(self, pose, robot=0):
        message = PoseStamped(pose=conversions.pose_message(pose.to_3d()))
        message.header.frame_id, message.header.stamp = "map", self._clock()
        self.graph.publish(f"/move_base_simple/goal{robot}", message)

    def cancel(self):
        self.graph.publish("/move_base0/cancel", GoalID())

    def reconfigure(self, values, namespace=""):
        """Change parameters of quadcopter 0, if its navigator lives."""
        service = f"/move_base0{namespace}/set_parameters"
        if service in self.graph.services:
            self.graph.call(service, ReconfigureRequest(encode_config(values)))

    # The simulator.

    def _simulate(self):
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=9)
        self._states = rospy.Publisher(STATES_TOPIC, StatesMessage, queue_size=9)
        self._odometry = [rospy.Publisher(f"/odom{i}", Odometry, queue_size=9) for i in (0, 1)]
        self._scans = {
            topic: rospy.Publisher(f"/{topic}", conversions.ScanMessage, queue_size=9)
            for topic in ("scan0", "scan1", "second0")
        }
        for robot in (0, 1):
            rospy.Subscriber(f"/cmd_vel{robot}", Twist, self._on_command, robot)
        rospy.Subscriber("/move_base0/feedback", MoveBaseActionFeedback, self._on_cycle)
        rospy.Subscriber("/move_base0/result", MoveBaseActionResult, self._on_result)
        while True:
            if self.is_running:
                self._step()
                self._publish()
            self.graph.threads.sleep(STEP_S)

    def _step(self):
        self.ns += round(STEP_S * 1e9)
        self._steps += 1
        self.flown_s = self._steps * STEP_S
        for body in self.bodies:
            body.advance()
        for walker in self.walkers:
            walker.age_s += STEP_S
        here = self.bodies[0].pose.x_m, self.bodies[0].pose.y_m
        self.walkers = [
            one for one in self.walkers if one.is_in_room and math.dist(one.place(), here) > ASIDE_M
        ]

    def _on_command(self, message, robot):
        twist = conversions.twist_from_message(message)
        self.bodies[robot].take(twist)
        if robot == 0:
            now_s, pose = self.graph.threads.now_s, self.bodies[0].pose
            self.commands.append(Command(self.flown_s, now_s, twist, pose, self.oldest_s))

    @property
    def oldest_s(self):
        """Age of what quadcopter 0 needs to fly and has not got for the longest time."""
        return max(self.flown_s - at_s for name, at_s in self.last_s.items() if name != "peer")

    @property
    def now_s(self):
        """Simulated time, as nodes read it."""
        return self._clock().to_sec()

    def _on_cycle(self, _):
        self.cycles.append(self.flown_s)

    def _on_result(self, message):
        if message.status.status in (GoalStatus.SUCCEEDED, GoalStatus.ABORTED):
            self.results.append(self.flown_s)

    def _gives(self, name, robot):
        """Return whether a quadcopter gets something now, and note that it does."""
        if robot == 0 and name in self.lost:
            return False
        if robot == 0:
            self.last_s[name] = self.flown_s
        return True

    def _publish(self):
        stamp = self._clock()
        for robot, body in enumerate(self.bodies):
            if self._gives("tf", robot):
                self._tf.publish(TFMessage(self._transforms(robot, stamp)))
            if self._gives("odometry", robot):
                self._odometry[robot].publish(odometry(robot, body, stamp))
            if self._steps % 2 == 0 and self._gives("scan", robot):
                self._scan(robot, f"scan{robot}", 0.0)
        if self._has_second_lidar and self._steps % 2 == 0 and self._gives("second scan", 0):
            self._scan(0, "second0", SECOND_S)
        places = [body.pose for body in self.bodies]
        if self.peer is not None and self._gives("peer", 0):
            places.append(self.peer)
        self._states.publish(states(places, stamp))

    def _transforms(self, robot, stamp):
        frames = ("map", f"odom{robot}", f"base_link{robot}", f"Lidar{robot}")
        poses = (Pose3D(0.0, 0.0, 0.0), self.bodies[robot].pose.to_3d(), Pose3D(0.0, 0.0, 0.06))
        return [
            conversions.transform_message(pose, parent, child, stamp)
            for pose, parent, child in zip(poses, frames, frames[1:])
        ]

    def _scan(self, robot, topic, before_s):
        """Publish a scan that was taken a time before."""
        message = conversions.scan_message(self._scan_of(robot, before_s), f"Lidar{robot}")
        message.header.stamp = self._clock(before_s)
        self._scans[topic].publish(message)

    def _scan_of(self, robot, before_s):
        circles = []
        if robot == 0:
            circles = [walker.place(before_s) for walker in self.walkers]
            circles += [] if self.peer is None else [(self.peer.x_m, self.peer.y_m)]
        ranges = ranges_m(self.bodies[robot].pose_at(before_s), FAR_M * robot, circles)
        return Scan(0.0, -math.pi, math.tau / BEAMS, 0.02, 60.0, ranges)


def odometry(robot, body, stamp):
    twist, frames = body.velocity, (f"odom{robot}", f"base_link{robot}")
    linear, angular = (twist.vx_mps, twist.vy_mps, 0.0), (0.0, 0.0, twist.vyaw_radps)
    return conversions.odometry_message(body.pose.to_3d(), linear, angular, frames, stamp)


def states(places, stamp):
    poses = np.array([pose_row(place.to_3d()) for place in places])
    twists = np.zeros((len(places), 6))
    return states_message(States(stamp.to_sec(), "map", np.arange(len(places)), poses, twists))


_ANGLES_RAD = -math.pi + math.tau / BEAMS * np.arange(BEAMS)


def ranges_m(pose, left_m, circles):
    """Return the ranges float32[BEAMS] in a square room that begins at x ``left_m``."""
    cos, sin = np.cos(_ANGLES_RAD + pose.yaw_rad), np.sin(_ANGLES_RAD + pose.yaw_rad)
    x_m, y_m = pose.x_m - left_m, pose.y_m
    with np.errstate(divide="ignore"):
        ranges = np.minimum(
            np.maximum(-x_m / cos, (ROOM_M - x_m) / cos),
            np.maximum(-y_m / sin, (ROOM_M - y_m) / sin),
        )
    for x, y in circles:
        dx_m, dy_m = x - pose.x_m, y - pose.y_m
        along, aside = cos * dx_m + sin * dy_m, cos * dy_m - sin * dx_m
        inside = WALKER_M**2 - aside**2
        hits = (inside > 0.0) & (along > 0.0)
        near = along - np.sqrt(np.maximum(inside, 0.0))
        ranges[hits] = np.minimum(ranges[hits], near[hits])
    return ranges.astype(np.float32)
