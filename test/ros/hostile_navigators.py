"""Navigators in this process: `move_base` with one robot, or `fleet` with two."""

from __future__ import annotations

import copy
import math
from pathlib import Path
from typing import Callable, Dict, List

import genpy
import numpy as np
import rospy
from dynamic_reconfigure.encoding import encode_config
from dynamic_reconfigure.srv import ReconfigureRequest
from fake_ros import FakeRos, FakeService, deliver
from geometry_msgs.msg import Point32, Polygon, Pose, PoseStamped, Quaternion, Twist, Vector3
from map_msgs.msg import OccupancyGridUpdate
from move_base_msgs.msg import MoveBaseActionGoal
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.msg import Path as PathMessage
from nav_msgs.srv import GetPlanRequest
from sensor_msgs.msg import ChannelFloat32, MultiDOFJointState, PointCloud, PointCloud2, PointField
from tf2_msgs.msg import TFMessage

from quad_nav import config
from quad_nav.geometry import Pose3D, Scan
from quad_nav.navigator.tick import State
from quad_nav.peers.peer import Intention
from quad_nav.ros.common import conversions, state_topics
from quad_nav.ros.common.packed_messages import STATES_TOPIC
from quad_nav.ros.common.state_topics import OwnTopics
from quad_nav.ros.navigator.intention_topics import INTENTIONS_TOPIC, intentions_message
from quad_nav.ros.navigator.loop import NavigatorLoop
from quad_nav.ros.navigator.nodes import Fleet
from quad_nav.topics.publishing import in_fleet, own_node

ROOT = Path(__file__).resolve().parents[2]
BEAMS = 60
STARTS = [Pose3D(2.0, 2.0, 1.0), Pose3D(9.0, 9.0, 1.0)]
GOALS = [(4.0, 2.0), (7.0, 9.0)]
CLOUD = np.array([[4.0, 0.0, 0.0], [0.0, 4.0, 0.0]], np.float32)

Valid = Callable[[], genpy.Message]


def hear_own_topics(*choices: OwnTopics) -> None:
    """Let a node hear each robot's own topics beside the messages for many robots."""
    state_topics.MISSING_AFTER_S = -1.0
    for one in choices:
        one._change(one._heard, ())


def configuration(number: int, robots: int) -> config.Configuration:
    """Return the shipped configuration with a source of each type, a map and its updates."""
    tree = config.load_files(ROOT / "config" / "default", {"i": str(number)})
    tree.update(robot=number, robots=robots)
    sensors = {
        "cloud": {"data_type": "PointCloud", "topic": f"cloud{number}", "marking": True},
        "cloud2": {"data_type": "PointCloud2", "topic": f"cloud2_{number}", "marking": True},
    }
    for name in ("global_costmap", "local_costmap"):
        costmap = tree[name]
        scan = costmap.pop("base_scan")
        costmap.update(resolution=0.1, width=12.0 if name[0] == "g" else 3.0)
        costmap["height"] = costmap["width"]
        costmap["plugins"] = [
            {"name": "static", "type": "costmap_2d::StaticLayer"},
            {"name": "obstacles", "type": "costmap_2d::ObstacleLayer"},
            {"name": "inflation", "type": "costmap_2d::InflationLayer"},
        ][name[0] == "l" :]
        costmap["obstacles"] = {
            "observation_sources": " ".join(["base_scan", *sensors]),
            "base_scan": scan,
            **copy.deepcopy(sensors),
        }
        costmap["inflation"] = {"inflation_radius": 0.8, "cost_scaling_factor": 12.7}
    tree["global_costmap"]["static"] = {"map_topic": "map", "subscribe_to_updates": True}
    return config.load(tree)


class Navigators:
    """The robots of one process, flown to a goal and back."""

    def __init__(self, ros: FakeRos, robots: int) -> None:
        """Start `move_base` for one robot, whose peer is another node's, or `fleet` for two."""
        self._ros, self.now_s = ros, 1.0
        own = range(robots)
        names = in_fleet if robots > 1 else lambda _: own_node
        self._names = {k: names(k) for k in own}
        self.fleet = Fleet({k: configuration(k, 2) for k in own}, names)
        hear_own_topics(*(peers._topics._own for peers in self.fleet.peers))
        hear_own_topics(*(peers._intentions._own_topics for peers in self.fleet.peers))
        self._loop = NavigatorLoop(self.fleet.robots, self.fleet.peers, 0.0)
        self.valid: Dict[str, Valid] = {
            **{
                rospy.resolve_name(topic): valid
                for k in own
                for topic, valid in self._topics(k).items()
            },
            **{f"/odom{k}": lambda k=k: self._odometry(k) for k in (0, 1)},
            **{f"/move_base{k}/intention": lambda k=k: self._intention(k) for k in (0, 1)},
            STATES_TOPIC: self._states,
            INTENTIONS_TOPIC: self._intentions,
            "/tf": self._transforms,
            "/tf_static": self._static_transforms,
            "/map": self._map,
            "/map_updates": self._map_update,
        }

    def _topics(self, k: int) -> Dict[str, Valid]:
        names = self._names[k]
        return {
            names("odom"): lambda: self._odometry(k),
            f"/scan{k}": lambda: self._scan(k),
            f"/cloud{k}": lambda: self._cloud(k),
            f"/cloud2_{k}": lambda: self._cloud2(k),
            **dict.fromkeys(self._footprint_topics(k), self._footprint),
            names("move_base_simple/goal"): lambda: self._goal(k),
            names("move_base/goal"): lambda: self._action_goal(k),
            names("move_base/cancel"): lambda: self._action_goal(k).goal_id,
            f"/move_base{k}/cancel": lambda: self._action_goal(k).goal_id,
        }

    def _footprint_topics(self, k: int) -> List[str]:
        return [f"{self._names[k](f'~{name}_costmap')}/footprint" for name in ("global", "local")]

    # -- what happens between hostile messages ---------------------------------------

    def settle(self) -> None:
        """Process what has arrived, without a control cycle."""
        for peers in self.fleet.peers:
            peers.refresh(self.now_s)
        for robot in self.fleet.robots:
            for sensor in robot._sensors:
                sensor.deliver(robot._transforms)
            robot._interface.poll(self.now_s)

    def fly(self, seconds: float = 0.1) -> None:
        """Advance the clock with good messages at 20 Hz, and run what is due."""
        for _ in range(round(seconds / 0.05)):
            self.now_s = round(self.now_s + 0.05, 9)
            self._ros.set_time(self.now_s)
            for topic in self._good_topics():
                deliver(topic, self.valid[topic](), "/simulator")
            self._loop._update_time()
            self._loop._step(self.now_s)

    def _good_topics(self) -> List[str]:
        sensors = [f"/{name}{k}" for name in ("scan", "cloud", "cloud2_") for k in self._names]
        odometry = [rospy.resolve_name(names("odom")) for names in self._names.values()]
        return ["/tf", STATES_TOPIC, *odometry, *sensors]

    def recover(self) -> None:
        """Send good messages on every topic; each robot flies to its goal again."""
        deliver("/map", self._map())
        for k in self._names:
            for topic in self._footprint_topics(k):
                deliver(rospy.resolve_name(topic), self._footprint())
        self.fly(1.0)
        for k, names in self._names.items():
            deliver(rospy.resolve_name(names("move_base_simple/goal")), self._goal(k))
        self.fly(0.2)
        # The fake publisher of action goals has no subscriber: they are handed on here.
        self._hand_on_goals()
        self.fly(1.5)
        for k, robot in enumerate(self.fleet.robots):
            state, command = robot.navigator.state, robot._interface._topics._command.last
            assert state in (State.CONTROLLING, State.PLANNING), f"robot {k} is {state}"
            assert command is not None and math.isfinite(command.linear.x), command
            speed = abs(command.linear.x) + abs(command.angular.z)
            assert speed > 0.01, f"robot {k} does not move: {command}"

    def _hand_on_goals(self) -> None:
        for names in self._names.values():
            topic = rospy.resolve_name(names("move_base/goal"))
            deliver(topic, self.valid[topic]())

    def untouched(self, number: int) -> bool:
        """Return whether a robot knows its pose and its surroundings."""
        if number >= len(self.fleet.robots):
            return True  # another node's
        robot = self.fleet.robots[number]
        pose = robot._locate(self.now_s)[0]
        return pose is not None and not robot._odometry_timeout(self.now_s)

    # -- valid messages ---------------------------------------------------------------

    def _stamp(self) -> rospy.Time:
        return rospy.Time.from_sec(self.now_s)

    def _odometry(self, k: int) -> Odometry:
        return conversions.odometry_message(
            STARTS[k],
            (0.1, 0.0, 0.0),
            (0.0, 0.0, 0.0),
            (f"odom{k}", f"base_link{k}"),
            self._stamp(),
        )

    def _states(self) -> MultiDOFJointState:
        twist = Twist(linear=Vector3(0.1, 0.0, 0.0))
        message = MultiDOFJointState(joint_names=["quad0", "quad1"], twist=[twist, twist])
        message.transforms = [conversions.transform(pose) for pose in STARTS]
        message.header.frame_id, message.header.stamp = "map", self._stamp()
        return message

    def _intentions(self) -> PointCloud2:
        intention = Intention(-self.now_s, np.array(GOALS))
        return intentions_message({0: intention, 1: intention}, "map", self.now_s)

    def _scan(self, k: int) -> genpy.Message:
        ranges = np.full(BEAMS, 2.5, np.float32)
        scan = Scan(self.now_s, -math.pi, 2 * math.pi / BEAMS, 0.02, 60.0, ranges)
        return conversions.scan_message(scan, f"Lidar{k}")

    def _cloud(self, k: int) -> PointCloud:
        cloud = PointCloud(points=[Point32(*row) for row in CLOUD.tolist()])
        cloud.channels = [ChannelFloat32("intensity", [1.0, 2.0])]
        cloud.header.frame_id, cloud.header.stamp = f"Lidar{k}", self._stamp()
        return cloud

    def _cloud2(self, k: int) -> PointCloud2:
        cloud = PointCloud2(height=1, width=2, point_step=12, row_step=24, data=CLOUD.tobytes())
        cloud.fields = [PointField(name, 4 * n, 7, 1) for n, name in enumerate("xyz")]
        cloud.header.frame_id, cloud.header.stamp = f"Lidar{k}", self._stamp()
        return cloud

    def _goal(self, k: int) -> PoseStamped:
        goal = PoseStamped(pose=Pose(orientation=Quaternion(0.0, 0.0, 0.0, 1.0)))
        goal.pose.position.x, goal.pose.position.y = GOALS[k]
        goal.header.frame_id, goal.header.stamp = "map", self._stamp()
        return goal

    def _action_goal(self, k: int) -> MoveBaseActionGoal:
        message = MoveBaseActionGoal()
        message.goal_id.stamp, message.goal_id.id = self._stamp(), f"goal {self.now_s}"
        message.goal.target_pose = self._goal(k)
        return message

    def _transforms(self) -> TFMessage:
        identity = Pose3D(0.0, 0.0, 0.0)
        return TFMessage(
            [
                conversions.transform_message(pose, parent, f"{child}{k}", self._stamp())
                for k in (0, 1)
                for parent, child, pose in (
                    ("map", "odom", identity),
                    (f"odom{k}", "base_link", STARTS[k]),
                    (f"base_link{k}", "Lidar", identity),
                )
            ]
        )

    def _static_transforms(self) -> TFMessage:
        pose = Pose3D(0.0, 0.0, 0.1)
        return TFMessage(
            [conversions.transform_message(pose, "base_link0", "camera0", rospy.Time())]
        )

    def _footprint(self) -> Polygon:
        corners = ((0.3, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.3, -0.3))
        return Polygon([Point32(x, y, 0.0) for x, y in corners])

    def _intention(self, k: int) -> PathMessage:
        path = PathMessage(poses=[self._goal(k), self._goal(k)])
        path.header.frame_id, path.header.stamp = "map", self._stamp()
        return path

    def _map(self) -> OccupancyGrid:
        grid = OccupancyGrid(data=bytes(120 * 120))
        grid.info.width = grid.info.height = 120
        grid.info.resolution, grid.info.origin.orientation.w = 0.1, 1.0
        grid.data = [0] * (120 * 120)
        grid.header.frame_id, grid.header.stamp = "map", self._stamp()
        return grid

    def _map_update(self) -> OccupancyGridUpdate:
        return OccupancyGridUpdate(x=3, y=4, width=2, height=2, data=[0, 1, 2, 3])

    def requests(self) -> Dict[str, genpy.Message]:
        """Return a valid request for each service."""
        valid = {name: one.service_class._request_class() for name, one in FakeService.all.items()}
        for name, request in valid.items():
            if isinstance(request, GetPlanRequest):
                valid[name] = GetPlanRequest(self._goal(0), self._goal(0), 0.5)
            elif isinstance(request, ReconfigureRequest):
                server = FakeService.all[name].handler.__self__
                valid[name] = ReconfigureRequest(encode_config(server.config))
        return valid
