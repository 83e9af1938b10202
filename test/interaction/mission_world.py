"""A real sequencer and three simulated quadcopters that fly straight, on a virtual clock.

The simulator has a clock of its own, which stands still until `/simulation/start` is called.
"""

from __future__ import annotations

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from interaction.sequenced import SPACING_M, SequencedWorld
from std_msgs.msg import Time
from std_srvs.srv import Trigger, TriggerResponse

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.ros.common import conversions
from quad_nav.ros.common.packed_messages import (
    STATES_TOPIC,
    States,
    StatesMessage,
    pose_row,
    states_message,
)
from quad_nav.topics.flight_info import RESET_TOPIC

ROBOTS = 3
STEP_S = 0.1
LEASE_S = 0.5
STARTS = [Pose2D(SPACING_M * robot, 0.0) for robot in range(ROBOTS)]


class MissionWorld(SequencedWorld):
    """The quadcopters, their simulator, and the sequencer.

    Attributes:
        ns: The simulated clock.
        is_running: Whether it runs.
        steps: Steps of the simulation so far.
        poses: Of the quadcopters.
        moved: Whether each has moved in the last step.
        stuck: Numbers of quadcopters that do not move.
        on_step: Called after each step.
    """

    def __init__(self):
        self.steps, self.stuck, self.moved = 0, set(), [False] * ROBOTS
        self.on_step = lambda: None
        super().__init__(ROBOTS, lambda: rospy.Time(*divmod(self.ns, 10**9)))
        self.start_simulator()
        for robot in range(ROBOTS):
            self.start_pilot(robot)
        self.start_sequencer(False)

    def pose(self, robot):
        return self.poses[robot]

    @property
    def now_s(self):
        return self.ns * 1e-9

    # What happens to the simulator.

    def start_simulator(self):
        self.ns, self.is_running, self._is_reset = 10**8, False, False
        self._put_back()
        self._simulator = self.graph.start("/simulator", self._simulate)

    def kill_simulator(self):
        self.is_running = False
        self.graph.kill(self._simulator)

    def reset(self):
        """Put the quadcopters back with the next step, as `/simulation/reset` does."""
        self._is_reset = True

    def step_clock(self, seconds):
        self.ns = max(self.ns + round(seconds * 1e9), 0)

    # The simulator.

    def _put_back(self):
        self.poses, self._commands = list(STARTS), {}

    def _simulate(self):
        self._states = rospy.Publisher(STATES_TOPIC, StatesMessage, queue_size=9)
        resets = rospy.Publisher(RESET_TOPIC, Time, queue_size=1, latch=True)
        rospy.Service("/simulation/start", Trigger, self._on_start)
        self.hear_events()
        for robot in range(ROBOTS):
            rospy.Subscriber(f"/cmd_vel{robot}", Twist, self._on_command, robot)
        while True:
            if self._is_reset:
                self._is_reset = False
                self._put_back()
                self.on_reset()
                resets.publish(Time(rospy.Time.now()))
            if self.is_running:
                self._step()
            self._publish()
            self.graph.threads.sleep(STEP_S)

    def _on_start(self, _):
        self.is_running = True
        return TriggerResponse(True, "")

    def _on_command(self, message, robot):
        self._commands[robot] = conversions.twist_from_message(message), self.now_s

    def _step(self):
        self.ns += round(STEP_S * 1e9)
        self.steps += 1
        for robot, pose in enumerate(self.poses):
            twist, at_s = self._commands.get(robot, (Twist2D(), 0.0))
            is_late = not 0.0 <= self.now_s - at_s <= LEASE_S
            if is_late or robot in self.stuck:
                twist = Twist2D()
            self.moved[robot] = twist != Twist2D()
            dx_m, dy_m = pose.rotate(twist.vx_mps * STEP_S, twist.vy_mps * STEP_S)
            self.poses[robot] = Pose2D(pose.x_m + dx_m, pose.y_m + dy_m, pose.yaw_rad)
        self.on_step()

    def _publish(self):
        poses, numbers = (
            np.array([pose_row(pose.to_3d()) for pose in self.poses]),
            np.arange(ROBOTS),
        )
        states = States(self.now_s, "map", numbers, poses, np.zeros((ROBOTS, 6)))
        self._states.publish(states_message(states))
