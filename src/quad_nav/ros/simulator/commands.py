"""Velocity commands for the quadcopters: which count, and from whom."""

from __future__ import annotations

import collections
import functools
from typing import Deque, Optional, Sequence, Set, Tuple

import rosgraph
import rospy
from geometry_msgs.msg import Twist

from quad_nav.errors import excerpt
from quad_nav.files.values import is_number
from quad_nav.geometry import Twist2D
from quad_nav.ros.common.conversions import twist_from_message
from quad_nav.ros.common.rospy_repairs import sender_of
from quad_nav.sim.simulation import Simulation
from quad_nav.topics.validation import CommandLease, twist_problem

_COMMANDS_PER_ROBOT = 20


class Commands:
    """Pass the commands of one node at a time to each quadcopter.

    Commands come from the topics `/cmd_vel{i}`, which callbacks store, and from navigators in the
    same process.
    """

    def __init__(self, simulation: Simulation, robots: Optional[Sequence[int]] = None) -> None:
        """Subscribe to the topics.

        Args:
            simulation: Gets the commands.
            robots: Numbers of the quadcopters that are commanded; None for all.
        """
        self._simulation = simulation
        params = simulation.params
        robots = range(simulation.n_robots) if robots is None else robots
        self._period_s = params.controller_period_s
        self._lease = CommandLease(params.command_timeout_s + params.controller_period_s)
        self._nodes: Set[str] = set()  # that have sent a command
        # Bounds the cost of a node that floods a topic.
        self._waiting: Deque[Tuple[int, Twist]] = collections.deque(
            maxlen=_COMMANDS_PER_ROBOT * len(robots)
        )
        self._subscribers = [
            rospy.Subscriber(
                f"/cmd_vel{i}",
                Twist,
                functools.partial(self._store, i),
                queue_size=10,
                tcp_nodelay=True,
            )
            for i in robots
        ]

    def _store(self, robot: int, message: Twist) -> None:
        node = sender_of(message)
        if node not in self._nodes:
            self._nodes.add(node)
            self._wait_for(node)
        self._waiting.append((robot, message))

    def _wait_for(self, node: str) -> None:
        """Wait as long for commands as a navigator pauses between two.

        It may have started after the simulator, which asks those that it finds at its start.
        """
        try:
            frequency_hz = rospy.get_param(f"{node}/controller_frequency", None)
        except (OSError, rosgraph.MasterException):  # the ROS master hangs
            return
        if is_number(frequency_hz) and frequency_hz > 0.0:
            self._period_s = max(1.0 / frequency_hz, self._period_s)
            self._lease.valid_s = self._simulation.wait_for_commands(self._period_s)

    def take(self) -> None:
        """Pass on the commands that have come from topics."""
        while self._waiting:
            robot, message = self._waiting.popleft()
            node = excerpt(sender_of(message) or "an unnamed node")
            self.give(robot, node, twist_from_message(message))

    def give(self, robot: int, node: str, twist: Twist2D) -> None:
        """Pass on a command of a node, unless another node controls the quadcopter."""
        problem = twist_problem(twist)
        if problem:
            rospy.logwarn_throttle(5.0, "quad%d: command dropped: %s", robot, problem)
            return
        holder = self._lease.holder(robot, node, self._simulation.now_s)
        if holder == node:
            self._simulation.set_command(robot, twist)
            return
        rospy.logwarn_throttle(
            5.0,
            "quad%d: command of %s dropped: %s controls this quadcopter, expected one node at a"
            " time",
            robot,
            node,
            holder,
        )

    def clear(self) -> None:
        """Forget all commands and release all leases."""
        self._waiting.clear()
        self._lease.clear()
