"""Simulator and sequencer in this process, fed by `hostile_messages`."""

from __future__ import annotations

import json
import math
from functools import partial
from pathlib import Path
from typing import Any, Dict

import genpy
import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from fake_ros import FakeRos, FakeService, deliver
from geometry_msgs.msg import Twist, Vector3
from hostile_navigators import ROOT, STARTS, Navigators, hear_own_topics
from move_base_msgs.msg import MoveBaseActionResult, RecoveryStatus
from quad.msg import Contact as ContactMessage
from std_msgs.msg import ColorRGBA, Time
from visualization_msgs.msg import Marker, MarkerArray

from quad_nav.mission.summary import write_json
from quad_nav.ros.common.own_messages import contact_message
from quad_nav.ros.common.packed_messages import STATES_TOPIC
from quad_nav.ros.composed.own_nodes import OwnNodes
from quad_nav.ros.sequencer.mission import MissionRunner
from quad_nav.ros.simulator.node import SimulatorNode
from quad_nav.scenario import mission_setup, simulator_setup
from quad_nav.sim.contacts import Contact
from quad_nav.topics.estimates import TRUTH_TOPIC

SCENE = str(ROOT / "scenes" / "arena.yaml")


class Simulator:
    """The node `simulator` with two quadcopters, and with the topic of its window."""

    def __init__(self, ros: FakeRos) -> None:
        """Start the node, without threads."""
        self._ros = ros
        setup = simulator_setup.read_setup({"robots": 2, "scene": SCENE}, "simulator")
        self._node = SimulatorNode(setup, OwnNodes())
        rospy.Subscriber("/goals", MarkerArray, self._node._store_goals)
        self._node._start()
        self._before = self._place(1)
        self.valid = {
            **{f"/cmd_vel{k}": self._command for k in (0, 1)},
            "/goals": self._markers,
        }

    @property
    def now_s(self) -> float:
        """Simulated time."""
        return self._node._simulation.now_s

    def settle(self) -> None:
        """Take the commands."""
        self._node._commands.take()

    def fly(self) -> None:
        """Show the goals, and advance by one scan."""
        self._node._show_goals()
        for _ in range(12):
            self._node._commands.take()
            self._node._step(1)
        self._ros.set_time(self.now_s)

    def recover(self) -> None:
        """Pass on a command once those before have expired; the quadcopter flies by it."""
        for _ in range(20):
            self.fly()
        for k in (0, 1):
            for _ in range(10):
                deliver(f"/cmd_vel{k}", self._command(), "/move_base")
                self.fly()
            speed = abs(self._node._simulation.state(k).angular_radps[2])
            assert speed > 0.05, f"quadcopter {k} does not turn: {speed}"

    def untouched(self, number: int) -> bool:
        """Return whether a quadcopter that has no command hovers at a finite place."""
        x_m, y_m = self._place(number)
        return math.isfinite(x_m) and math.isfinite(y_m)

    def requests(self) -> Dict[str, genpy.Message]:
        """Return a valid request for each service that the loop need not answer."""
        return {
            name: one.service_class._request_class()
            for name, one in FakeService.all.items()
            if "lidar" in name
        }

    def _place(self, number: int) -> Any:
        pose = self._node._simulation.state(number).map_from_base
        return pose.x_m, pose.y_m

    def _command(self) -> Twist:
        return Twist(Vector3(0.0, 0.0, 0.0), Vector3(0.0, 0.0, 0.5))

    def _markers(self) -> MarkerArray:
        marker = Marker(type=Marker.SPHERE, action=Marker.ADD)
        marker.scale, marker.color = Vector3(0.2, 0.2, 0.2), ColorRGBA(1.0, 0.0, 0.0, 1.0)
        marker.pose.orientation.w = 1.0
        return MarkerArray([marker])


class SequencerNode:
    """The node `sequencer` with two quadcopters on the way to their first goals."""

    def __init__(self, ros: FakeRos, folder: Path) -> None:
        """Start the mission; its threads' steps are called here."""
        self._ros, self.now_s, self._folder = ros, 1.0, folder
        for k in (0, 1):
            (folder / f"quad{k}_goals.json").write_text(json.dumps({"goals": [[5.0, 5.0 + k]]}))
        parameters = {"goals": str(folder), "scene": SCENE, "goal_timeout": 1e9, "retries": 10_000}
        parameters["journal"] = str(folder / "journal.jsonl")
        setup = mission_setup.read_setup(parameters, "sequencer", folder / "result.json", folder)
        self.mission = MissionRunner(setup)
        self.mission._start_simulation = lambda: None
        hear_own_topics(self.mission._feed._topics._own)
        self.mission._feed.transforms()  # which odometry needs
        self.mission._begin(self.now_s)
        self._attempts = [0, 0]
        self.valid = {
            "/simulation/contacts": self._contact,
            "/simulation/last_reset": lambda: Time(rospy.Time.from_sec(0.5)),
            STATES_TOPIC: partial(Navigators._states, self),
            TRUTH_TOPIC: partial(Navigators._states, self),
            "/tf": partial(Navigators._transforms, self),
            "/tf_static": partial(Navigators._static_transforms, self),
        }
        for k in (0, 1):
            self.valid.update(
                {
                    f"/odom{k}": partial(Navigators._odometry, self, k),
                    f"/move_base{k}/result": self._result,
                    f"/move_base{k}/status": self._status,
                    f"/move_base{k}/recovery_status": self._recovery,
                }
            )

    def settle(self) -> None:
        """Do the steps of the threads."""
        for thread in self.mission._threads:
            thread._step()
        self.mission._watch_clock(rospy.get_time())

    def fly(self) -> None:
        """Advance the clock with good odometry."""
        self.now_s = round(self.now_s + 0.05, 9)
        self._ros.set_time(self.now_s)
        deliver("/tf", self.valid["/tf"](), "/simulator")
        for k in (0, 1):
            deliver(f"/odom{k}", self.valid[f"/odom{k}"](), "/simulator")
            deliver(f"/move_base{k}/status", self._status(), f"/move_base{k}")
        self.settle()
        self.mission.publish_progress()

    def recover(self) -> None:
        """Fly on with good odometry: the pose is right, and the summary can be written."""
        for _ in range(30):
            self.fly()
        for robot, start in zip(self.mission.robots, STARTS):
            assert robot.pose is not None, f"{robot.name} has no pose"
            away_m = math.hypot(robot.pose.x_m - start.x_m, robot.pose.y_m - start.y_m)
            assert away_m < 1e-3, f"{robot.name} at {robot.pose}"
        result = self._folder / "result.json"
        write_json(self.mission.summary("test"), result)
        json.loads(result.read_text(), parse_constant=_not_json)
        self._attempts = [self._attempt(k) for k in (0, 1)]

    def untouched(self, number: int) -> bool:
        """Return whether a robot flies to its only goal, in the attempt of the last `recover`."""
        return self._attempt(number) == self._attempts[number]

    def _attempt(self, number: int) -> int:
        goal = self.mission.robots[number].sequencer.active_goal
        return goal.attempt if goal is not None else 0

    def requests(self) -> Dict[str, genpy.Message]:
        """Return no request: the node has no services."""
        return {}

    def _stamp(self) -> rospy.Time:
        return rospy.Time.from_sec(self.now_s)

    def _contact(self) -> ContactMessage:
        return contact_message(Contact(self.now_s, "quad0", "wall", 1.0, 2.0), self.now_s)

    def _result(self) -> MoveBaseActionResult:
        result = MoveBaseActionResult(status=GoalStatus(status=GoalStatus.PREEMPTED))
        result.status.goal_id.stamp, result.status.goal_id.id = self._stamp(), "another"
        return result

    def _status(self) -> GoalStatusArray:
        return GoalStatusArray(status_list=[GoalStatus(status=GoalStatus.ACTIVE)])

    def _recovery(self) -> RecoveryStatus:
        return RecoveryStatus(recovery_behavior_name="rotate", total_number_of_recoveries=2)


def _not_json(constant: str) -> None:
    raise ValueError(f"{constant} in the summary")
