"""The loop of a simulation and of the navigators that share its process.

Without navigators it is the loop of the simulation alone. With them the simulation waits for the
navigators: it does not run ahead, and every command is in time in simulated time.
"""

from __future__ import annotations

import math
import multiprocessing
import time
from typing import Dict, List, NamedTuple, Tuple

import rospy

from quad_nav.geometry import Twist2D
from quad_nav.loop import LoopSetup, shares_of
from quad_nav.loop.flight_loop import FlightLoop
from quad_nav.loop.worker_process import WorkerProcessError, processes_for
from quad_nav.peers.peer import Intention, idle_priority, peer_at
from quad_nav.ros.composed.group import ComposedGroup, GroupMaker
from quad_nav.ros.composed.own_nodes import OwnNodes
from quad_nav.ros.navigator.intention_topics import IntentionListener
from quad_nav.scenario.simulator_setup import SimulatorSetup
from quad_nav.sim.localization import believed_states

PATIENCE_S = 0.5
"""Wall time for which the simulation waits for a process, which may be stopped."""
RESPAWN_DELAY_S = 1.0
"""Wall time after which a process that ended soon after its start is started again."""
_SOON_S = 5.0
_ROBOTS_PER_PROCESS = 15  # at real time, with a processor core of which others use a part
_MAP_FRAME = "map"


class OwnCommand(NamedTuple):
    """Command of a navigator of the fleet, and the name of its node."""

    robot: int
    node: str
    twist: Twist2D


class ComposedFleet:
    """The loop, its processes and what they need of robots with other navigators.

    Attributes:
        loop: The loop.
        hosted: Numbers of the robots whose navigators are in the loop.
    """

    def __init__(self, setup: SimulatorSetup, start_step: int, own: OwnNodes) -> None:
        """Start the processes, build this one's navigators, and name the nodes in ``own``."""
        self.hosted = tuple(sorted(setup.configurations))
        shares = shares_of(self.hosted, _processes(setup))
        nodes = [rospy.get_name()]
        nodes += [rospy.resolve_name(f"fleet{process}") for process in range(1, len(shares))]
        own.names = tuple(nodes) if self.hosted else ()
        self._nodes = {robots: node for robots, node in zip(shares, nodes)}
        self._node_of = {robot: node for robots, node in self._nodes.items() for robot in robots}
        self._started_s = dict.fromkeys(shares, time.monotonic())
        self._lost: Dict[Tuple[int, ...], float] = {}  # with the time to start it again
        # Workers are forked from a process without threads, which has loaded the modules.
        multiprocessing.set_forkserver_preload([ComposedGroup.__module__])
        self.loop = FlightLoop(
            _loop_setup(setup, start_step),
            shares,
            GroupMaker(tuple(nodes), tuple(shares), setup.localization),
            "forkserver",
            self._on_loss,
            PATIENCE_S,
            whole_ticks=False,
        )
        others = [robot for robot in range(setup.robots) if robot not in self._node_of]
        self._others = others if self.hosted else []
        if self._others:
            assert isinstance(self.loop.group, ComposedGroup)
            self._intentions = IntentionListener(
                self._others, self.loop.group.transforms, _MAP_FRAME
            )

    def navigate(self) -> List[OwnCommand]:
        """Tick the navigators that are due and return their commands.

        A process that was stopped sends what it computed before. Such a command is too old.
        """
        if not self.hosted:
            return []
        self._restart()
        self._hear_others()
        now_s = self.loop.now_s
        return [
            OwnCommand(result.robot, self._node_of[result.robot], result.tick.command)
            for result in self.loop.navigate()
            if result.tick.command is not None and result.tick.now_s >= now_s
        ]

    def _hear_others(self) -> None:
        """Tell the navigators what robots with other navigators intend."""
        now_s = self.loop.now_s
        states = believed_states(self.loop.states, self.loop.group.localization)
        for robot in self._others:
            state = states[robot]
            peer = peer_at(f"quad{robot}", state.map_from_base.to_2d(), state.twist, now_s)
            self.loop.set_intention(robot, self._intentions.of(robot, peer, now_s))

    def _on_loss(self, robots: Tuple[int, ...], error: WorkerProcessError) -> None:
        wall_s = time.monotonic()
        ended_soon = wall_s - self._started_s[robots] < _SOON_S
        self._lost[robots] = wall_s + (RESPAWN_DELAY_S if ended_soon else 0.0)
        for robot in robots:
            self.loop.set_intention(robot, Intention(idle_priority(robot)))
        rospy.logerr(
            "%s has died, its quadcopters hover until it is started again: %s",
            self._nodes[robots].lstrip("/"),
            error,
        )

    def _restart(self) -> None:
        wall_s = time.monotonic()
        for robots in [robots for robots, due_s in self._lost.items() if wall_s >= due_s]:
            del self._lost[robots]
            self._started_s[robots] = wall_s
            self.loop.add_worker(robots)


def _processes(setup: SimulatorSetup) -> int:
    """Return the number of processes that share the navigators."""
    if setup.params.lidar_caster != "kernel" or setup.localization == "amcl":
        return 1  # the engine's rays need the bodies, and an amcl the peers, in the same process
    load = len(setup.configurations) * setup.rate / _ROBOTS_PER_PROCESS
    return setup.hosts or processes_for(math.ceil(load), "forkserver")


def _loop_setup(setup: SimulatorSetup, start_step: int) -> LoopSetup:
    return LoopSetup(
        setup.scene,
        setup.params,
        tuple(f"quad{robot}" for robot in range(setup.robots)),
        setup.configurations,
        setup.steps_per_scan,
        setup.seed,
        start_step,
        setup.gui,
    )
