"""The robots of one process of a composed fleet, with their ROS interfaces.

The group of the simulator's process and those of the worker processes are alike. A worker process
is forked from a clean one that has loaded the modules, and becomes a node here.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from typing import Dict, List, Mapping, Optional, Sequence, Tuple

import rospy

from quad_nav.geometry import Pose2D, Scan
from quad_nav.loop import LoopSetup
from quad_nav.loop.navigator_group import LocatedScan, NavigatorGroup, NavigatorResult
from quad_nav.ros.common.conversions import ScanMessage, scan_message, time_message
from quad_nav.ros.common.diagnostics import publish_health
from quad_nav.ros.common.readiness import TopicWatch, start_node
from quad_nav.ros.common.rospy_repairs import set_time
from quad_nav.ros.composed.localization import localization_of
from quad_nav.ros.composed.own_nodes import OwnNodes, hear_others_only
from quad_nav.ros.composed.robot import ComposedRobot
from quad_nav.ros.composed.transforms import ComposedTransforms
from quad_nav.ros.navigator.costmap_publisher import NewSubscriber, Publish
from quad_nav.ros.navigator.health_meters import LoopHealth
from quad_nav.scenario.rules import SIMULATOR
from quad_nav.sim.casters import Lidars
from quad_nav.sim.localization import Localization
from quad_nav.sim.robot_state import RobotStates


class ScanTopic:
    """Publish the scans of one robot's LIDAR, the last one to each new subscriber."""

    def __init__(self, robot: int) -> None:
        self._frame = f"Lidar{robot}"
        self._last: Optional[Scan] = None
        self._publisher = rospy.Publisher(
            f"/scan{robot}",
            ScanMessage,
            queue_size=10,
            subscriber_listener=NewSubscriber(self._send_last),
        )

    def publish(self, scan: Scan) -> None:
        """Publish a scan, if a node subscribes."""
        self._last = scan
        if self._publisher.get_num_connections():
            self._publisher.publish(scan_message(scan, self._frame))

    def _send_last(self, send: Publish) -> None:
        if self._last is not None:
            send(scan_message(self._last, self._frame))


class ComposedGroup(NavigatorGroup):
    """LIDARs, navigators and interfaces of the robots of one process.

    Attributes:
        transforms: Transform tree of this process.
    """

    robots: Dict[int, ComposedRobot]  # type: ignore[assignment]

    def __init__(
        self,
        setup: LoopSetup,
        robots: Sequence[int],
        lidars: Lidars,
        localization: str = SIMULATOR,
    ) -> None:
        """Build and connect the navigators of ``robots``.

        Args:
            setup: The loop's set-up.
            robots: Their numbers.
            lidars: LIDARs of all robots.
            localization: Who finds the robots' places.
        """
        self.transforms = ComposedTransforms(localization == SIMULATOR)
        self._states: Optional[RobotStates] = None
        self._found = localization_of(localization, self.transforms, setup.configurations, robots)
        super().__init__(setup, robots, lidars)
        self._scans = {number: ScanTopic(number) for number in robots}
        interfaces = [robot.interface for robot in self.robots.values()]
        self._loop_health = LoopHealth({one.name: one.health for one in interfaces})
        self._topic_watch = TopicWatch(
            [subscriber for robot in self.robots.values() for subscriber in robot.subscribers]
        )
        self._needs_transforms = self._found is not None or any(
            robot.needs_transforms for robot in self.robots.values()
        )
        publish_health(self._loop_health.read)

    def new_robot(self, number: int) -> ComposedRobot:
        """Build a robot's navigator and its interface."""
        configuration = self.setup.configurations[number]
        return ComposedRobot(configuration, number, self.transforms)

    def _new_localization(self) -> Optional[Localization]:
        if self._found is not None:
            self._found.reset()
        return self._found

    def set_maps(self) -> None:
        """Leave static layers to their topics."""

    def scan(self, now_s: float, states: RobotStates) -> Dict[int, LocatedScan]:
        """Take scans, hand them to the navigators and publish them."""
        set_time(time_message(now_s))
        self.transforms.update(now_s, states)
        scans = super().scan(now_s, states)
        for number, (scan, _) in scans.items():
            self._scans[number].publish(scan)
        return scans

    def navigate(
        self, now_s: float, states: RobotStates, goals: Mapping[int, Pose2D]
    ) -> List[NavigatorResult]:
        """Tick the navigators that are due, and publish their results."""
        set_time(time_message(now_s))
        self.transforms.update(now_s, states)
        if self._needs_transforms:
            self.transforms.store()
        results = super().navigate(now_s, states, goals)
        self._loop_health.update(now_s, 0.0)
        self._topic_watch.check()
        return results

    def _believed(self, states: RobotStates) -> RobotStates:
        self._states = super()._believed(states)
        if self._found is not None:
            self._found.note(self._states)
        return self._states

    @property
    def due_s(self) -> float:
        """Always: goals and messages may have come."""
        return -math.inf

    def before_ticks(self, now_s: float) -> None:
        """Take goals and messages from the topics."""
        assert self._states is not None
        for number, robot in self.robots.items():
            robot.poll(now_s, self._states[number])

    def close(self) -> None:
        """Stop the robots."""
        if not rospy.is_shutdown():
            for robot in self.robots.values():
                robot.interface.stop()


@dataclass(frozen=True)
class GroupMaker:
    """Maker of the groups of all processes.

    Attributes:
        nodes: Full names of the processes' nodes, the simulator first.
        shares: Numbers of the robots of each.
        localization: Who finds the robots' places.
    """

    nodes: Tuple[str, ...]
    shares: Tuple[Tuple[int, ...], ...]
    localization: str = SIMULATOR

    def __call__(self, setup: LoopSetup, robots: Sequence[int], lidars: Lidars) -> NavigatorGroup:
        """Make the group of this process, which becomes a node unless it is the simulator's."""
        process = self.shares.index(tuple(robots))
        if not robots:
            return NavigatorGroup(setup, robots, lidars)  # a simulation alone
        if process == 0:
            return ComposedGroup(setup, robots, lidars, self.localization)
        hear_others_only(OwnNodes(self.nodes))
        # The simulator's name, log and remappings of its name do not concern this node.
        start_node(
            self.nodes[process].rsplit("/", 1)[1],
            [one for one in sys.argv if not one.startswith(("__name:=", "__log:="))],
            hears_clock=False,
        )
        group = _WorkerGroup(setup, robots, lidars, self.localization)
        rospy.loginfo("%s: ready, robots: %d", rospy.get_name().lstrip("/"), len(robots))
        return group


class _WorkerGroup(ComposedGroup):
    """Group of a worker process, which ends with its node."""

    def navigate(
        self, now_s: float, states: RobotStates, goals: Mapping[int, Pose2D]
    ) -> List[NavigatorResult]:
        if rospy.is_shutdown():
            raise SystemExit  # `rosnode kill`: the simulator starts another process
        return super().navigate(now_s, states, goals)

    def close(self) -> None:
        super().close()
        rospy.signal_shutdown("the simulation is closed")
