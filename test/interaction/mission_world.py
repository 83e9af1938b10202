"""A real sequencer, three simulated quadcopters that fly straight, on a virtual clock.

The simulator has a clock of its own, which stands still until `/simulation/start` is called.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
import rospy
from interaction.pilots import Pilot
from interaction.virtual_ros import Graph
from std_msgs.msg import String, Time
from std_srvs.srv import Trigger, TriggerResponse
from geometry_msgs.msg import Twist

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.mission import journal
from quad_nav.ros.common import conversions
from quad_nav.ros.common.packed_messages import (
    STATES_TOPIC,
    States,
    StatesMessage,
    pose_row,
    states_message,
)
from quad_nav.ros.sequencer import node
from quad_nav.ros.sequencer.mission import MissionRunner
from quad_nav.scenario.mission_setup import read_setup
from quad_nav.topics.flight_info import EVENTS_TOPIC, RESET_TOPIC

ROBOTS = 3
STEP_NS = 100_000_000
STEP_S = STEP_NS * 1e-9
SPACING_M = 5.0
LEASE_S = 0.5
TIMEOUT_S, RETRIES = 12.0, 1


def start_of(robot):
    return Pose2D(SPACING_M * robot, 0.0)


def goals_of(robot, places=((0.0, 2.0), (0.0, 0.0), (1.5, 1.0)), wait_s=1.0):
    """Return the text of a goal file; the robot stays at its first goal."""
    goals = [{"x": SPACING_M * robot + x, "y": y} for x, y in places]
    goals[0]["wait_s"] = wait_s
    settings = {"goal_timeout": TIMEOUT_S, "retries": RETRIES, "goal_tolerance": 0.2}
    return json.dumps({"goals": goals, **settings})


class MissionWorld:
    """The quadcopters, their simulator, and the sequencer.

    Attributes:
        graph: The nodes.
        ns: The simulated clock.
        poses: Of the quadcopters.
        moved: Whether each has moved in the last step.
        stuck: Numbers of quadcopters that do not move.
        pilots: The navigators by number.
        sequencer: Its node, None while it is dead.
        runner: Its mission.
        events: What it has said on its topic.
        steps: Steps of the simulation so far.
        on_step: Called after each step, and with each event: `on_step(None)`, `on_step(event)`.
    """

    def __init__(self):
        self.ns, self.is_running, self.steps, self.stuck = 0, False, 0, set()
        self.poses = [start_of(robot) for robot in range(ROBOTS)]
        self.moved = [False] * ROBOTS
        self._commands = {}
        self.graph = Graph(lambda: rospy.Time(*divmod(self.ns, 10**9)))
        self.events, self.pilots, self._pilot_nodes = [], {}, {}
        self.on_step = lambda event: None
        self._folder = tempfile.TemporaryDirectory(prefix="quad_mission_")
        self.folder = Path(self._folder.name)
        for robot in range(ROBOTS):
            self.write_goals(robot, goals_of(robot))
        self._context = self.graph.running()
        self._context.__enter__()
        self.start_simulator()
        for robot in range(ROBOTS):
            self.start_pilot(robot)
        self.start_sequencer(False)
        assert self.graph.run(5.0, lambda: self.is_running), self.graph.log

    def close(self):
        self._context.__exit__(None, None, None)
        self._folder.cleanup()

    @property
    def now_s(self):
        return self.ns * 1e-9

    # Nodes.

    def start_pilot(self, robot):
        self.pilots[robot] = Pilot(robot, lambda: self.poses[robot])
        self._pilot_nodes[robot] = self.graph.start(f"/move_base{robot}", self.pilots[robot].run)

    def kill_pilot(self, robot):
        self.graph.kill(self._pilot_nodes.pop(robot))
        self.pilots.pop(robot)

    def start_sequencer(self, is_respawned):
        """Start it, as the launch file or the supervisor does."""

        def main():
            given = {"robots": ROBOTS, "goals": str(self.folder), "journal": str(self.folder / "j")}
            setup = read_setup(given, "sequencer", self.folder / "result.json", self.folder)
            self.runner = MissionRunner(setup, is_respawned)
            try:
                node.fly(self.runner, setup, self.folder / "result.json", lambda: "")
            finally:  # a process that ends closes its files
                self.runner._record.journal._journal.close()

        self.runner = None
        self.sequencer = self.graph.start("/sequencer", main)

    def kill_sequencer(self):
        self.graph.kill(self.sequencer)
        self.sequencer = None

    # Requests of people.

    def write_goals(self, robot, text):
        (self.folder / f"quad{robot}_goals.json").write_text(text)

    def call(self, name):
        """Call a service; return its response, None if nobody offers it."""
        try:
            return self.graph.call(name)
        except rospy.ServiceException:
            return None

    # The simulator.

    def start_simulator(self):
        self.ns, self.is_running, self._is_reset = 10**8, False, False
        self.poses = [start_of(robot) for robot in range(ROBOTS)]
        self._commands = {}
        self._simulator = self.graph.start("/simulator", self._simulate)

    def kill_simulator(self):
        self.is_running = False
        self.graph.kill(self._simulator)

    def reset(self):
        """Put the quadcopters back with the next step, as `/simulation/reset` does."""
        self._is_reset = True

    def step_clock(self, seconds):
        self.ns = max(self.ns + round(seconds * 1e9), 0)

    def _simulate(self):
        self._states = rospy.Publisher(STATES_TOPIC, StatesMessage, queue_size=9)
        self._resets = rospy.Publisher(RESET_TOPIC, Time, queue_size=1, latch=True)
        rospy.Service("/simulation/start", Trigger, self._on_start)
        rospy.Subscriber(EVENTS_TOPIC, String, self._on_event)
        for robot in range(ROBOTS):
            rospy.Subscriber(f"/cmd_vel{robot}", Twist, self._on_command, robot)
        while True:
            if self._is_reset:
                self._is_reset = False
                self.poses, self._commands = [start_of(robot) for robot in range(ROBOTS)], {}
                self.on_step({"event": "reset"})
                self._resets.publish(Time(rospy.Time.now()))
            if self.is_running:
                self.ns += STEP_NS
                self.steps += 1
                for robot in range(ROBOTS):
                    self._move(robot)
                self.on_step(None)
            self._publish()
            self.graph.threads.sleep(STEP_S)

    def _on_start(self, _):
        self.is_running = True
        return TriggerResponse(True, "")

    def _on_event(self, message):
        self.events.append(json.loads(message.data))
        self.on_step(self.events[-1])

    def _on_command(self, message, robot):
        self._commands[robot] = conversions.twist_from_message(message), self.now_s

    def _move(self, robot):
        twist, at_s = self._commands.get(robot, (Twist2D(), 0.0))
        is_late = not 0.0 <= self.now_s - at_s <= LEASE_S
        x_m, y_m = (0.0, 0.0) if is_late or robot in self.stuck else (twist.vx_mps, twist.vy_mps)
        pose = self.poses[robot]
        self.moved[robot] = bool(x_m or y_m)
        dx_m, dy_m = pose.rotate(x_m * STEP_S, y_m * STEP_S)
        self.poses[robot] = Pose2D(pose.x_m + dx_m, pose.y_m + dy_m, pose.yaw_rad)

    def _publish(self):
        states = States(
            self.now_s,
            "map",
            np.arange(ROBOTS),
            np.array([pose_row(pose.to_3d()) for pose in self.poses]),
            np.zeros((ROBOTS, 6)),
        )
        self._states.publish(states_message(states))


journal.os.fsync = lambda _: None
