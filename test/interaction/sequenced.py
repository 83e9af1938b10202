"""What the worlds with a real sequencer have in common: its node, goal files, and navigators."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import rospy
from interaction.pilots import Pilot
from interaction.virtual_ros import Graph
from quad.msg import MissionEvent
from ros.own_messages import event_of

from quad_nav.mission import journal
from quad_nav.ros.sequencer import node
from quad_nav.ros.sequencer.mission import MissionRunner
from quad_nav.scenario.mission_setup import read_setup
from quad_nav.topics.mission_events import EVENTS_TOPIC

journal.os.fsync = lambda _: None  # a node dies here, but never the machine
SPACING_M = 5.0
SETTINGS = {"goal_timeout": 12.0, "retries": 1, "goal_tolerance": 0.2}
PLACES = ((0.0, 2.0), (0.0, 0.0), (1.5, 1.0))


class SequencedWorld:
    """A sequencer and navigators that fly straight.

    Attributes:
        graph: The nodes.
        pilots: The navigators by number.
        sequencer: Node of the sequencer, None while it is dead.
        runner: Its mission, None before it has begun.
        on_event: Called with what the sequencer says.
        on_reset: Called when the simulation is reset.
    """

    parameters = {}

    def __init__(self, robots, clock):
        """Write the goal files; a subclass starts the nodes."""
        self.robots, self.graph = robots, Graph(clock)
        self.pilots, self._pilot_nodes = {}, {}
        self.sequencer = self.runner = None
        self.on_event, self.on_reset = lambda event: None, lambda: None
        self._folder = tempfile.TemporaryDirectory(prefix="quad_mission_")
        self.folder = Path(self._folder.name)
        for robot in range(robots):
            self.write_goals(robot, PLACES)
        self._context = self.graph.running()
        self._context.__enter__()

    def close(self):
        self._context.__exit__(None, None, None)
        self._folder.cleanup()

    def pose(self, robot):
        """Return where a quadcopter is, in ``map``."""
        raise NotImplementedError

    def write_goals(self, robot, places):
        """Write a goal file; the robot stays at its first goal for 1 s."""
        goals = [{"x": SPACING_M * robot + x, "y": y} for x, y in places]
        goals[0]["wait_s"] = 1.0
        text = json.dumps({"goals": goals, **SETTINGS})
        (self.folder / f"quad{robot}_goals.json").write_text(text)

    def start_pilot(self, robot):
        self.pilots[robot] = Pilot(robot, lambda: self.pose(robot))
        self._pilot_nodes[robot] = self.graph.start(f"/move_base{robot}", self.pilots[robot].run)

    def kill_pilot(self, robot):
        self.graph.kill(self._pilot_nodes.pop(robot))
        del self.pilots[robot]

    def start_sequencer(self, is_respawned):
        """Start it, as the launch file does, or its supervisor after it was killed."""
        given = {"robots": self.robots, "goals": str(self.folder), **self.parameters}
        given["journal"], result = str(self.folder / "journal"), self.folder / "result.json"

        def main():
            setup = read_setup(given, "sequencer", result, self.folder)
            self.runner = MissionRunner(setup, is_respawned)
            try:
                node.fly(self.runner, setup, result, lambda: "")
            finally:  # a process that ends closes its files
                self.runner._record.journal._journal.close()

        self.runner, self.sequencer = None, self.graph.start("/sequencer", main)

    def kill_sequencer(self):
        self.graph.kill(self.sequencer)
        self.sequencer = None

    def hear_events(self):
        """Subscribe to what the sequencer says, as the node whose code runs."""
        rospy.Subscriber(EVENTS_TOPIC, MissionEvent, lambda one: self.on_event(event_of(one)))

    def call(self, name):
        """Call a service; return its response, None if nobody offers it."""
        try:
            return self.graph.call(name)
        except rospy.ServiceException:
            return None
