"""A navigator group in a worker process: commands and results go through a pipe."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import traceback
from multiprocessing.connection import Connection
from typing import Any, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import PluginError
from quad_nav.geometry import Pose2D
from quad_nav.offline.navigator_group import NavigatorGroup, NavigatorResult
from quad_nav.peers.peer import Intention
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.sim.casters import kernel_lidars
from quad_nav.sim.flight import BodyState
from quad_nav.sim.simulation import RobotStates

PROCESS_NAME = "navigators"
_ROBOTS_PER_PROCESS = 10  # with fewer, the pipe takes as long as the navigators
_JOIN_TIMEOUT_S = 5.0
# A fork is there at once. Where forking is not safe, a new Python starts.
_START_METHOD = "fork" if sys.platform == "linux" else "spawn"


def processes_for(robots: int) -> int:
    """Number of processes that make a flight of so many robots fast on this machine."""
    cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return max(1, min(cores, robots // _ROBOTS_PER_PROCESS))


class WorkerProcessError(RuntimeError):
    """A worker process failed; the message has its traceback."""


class WorkerProcess:
    """A navigator group in a process of its own."""

    def __init__(self, setup: FlightSetup, robots: Sequence[int]) -> None:
        """Start the process for the robots with these numbers."""
        self.robots = tuple(robots)
        context = multiprocessing.get_context(_START_METHOD)
        self._pipe, worker_end = context.Pipe()
        self._process = context.Process(  # type: ignore[attr-defined]
            target=_serve,
            args=(worker_end, self._pipe, setup, self.robots),
            name=PROCESS_NAME,
            daemon=True,
        )
        self._process.start()
        worker_end.close()

    def scan(self, now_s: float, states: RobotStates) -> None:
        """Start ``NavigatorGroup.scan``; the scans stay in the worker process.

        Raises:
            WorkerProcessError: The process failed.
        """
        self._send("scan", now_s, states.bodies.rows)

    def begin_navigating(
        self,
        now_s: float,
        states: RobotStates,
        goals: Mapping[int, Pose2D],
        updates: Mapping[int, Intention],
    ) -> None:
        """Start ``NavigatorGroup.navigate``; ``results`` returns what it returns.

        Raises:
            WorkerProcessError: The process failed.
        """
        self._send("navigate", now_s, states.bodies.rows, goals, updates)

    def results(self) -> List[NavigatorResult]:
        """Wait for the results of ``begin_navigating``.

        Raises:
            WorkerProcessError: The process failed.
            PluginError: A plugin has a mistake.
        """
        try:
            answer = self._pipe.recv()
        except (EOFError, ConnectionError):
            answer = "it has ended"
        if isinstance(answer, PluginError):
            raise answer
        if isinstance(answer, str):
            raise WorkerProcessError(
                f"a worker process with {len(self.robots)} navigators failed: {answer}"
            )
        results: List[NavigatorResult] = answer
        return results

    def close(self) -> None:
        """End the process; kill it if it does not end within 5 s."""
        with contextlib.suppress(ConnectionError):  # the process has ended already
            self._pipe.send(())
        self._pipe.close()
        self._process.join(_JOIN_TIMEOUT_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _send(self, *command: object) -> None:
        try:
            self._pipe.send(command)
        except ConnectionError:
            self.results()  # raises with the reason


def _serve(
    pipe: Connection, parent_end: Connection, setup: FlightSetup, robots: Tuple[int, ...]
) -> None:
    """Run commands from the pipe until an empty one comes or the parent process dies."""
    parent_end.close()  # with a copy open, the parent's death would not close the pipe
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process handles Ctrl-C
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        params = setup.simulation
        group = NavigatorGroup(
            setup,
            robots,
            kernel_lidars(
                params.lidar, setup.scene, len(setup.robots), setup.seed, params.airframe.radius_m
            ),
        )
        for command in iter(pipe.recv, ()):
            answer = _run(group, *command)
            if answer is not None:
                pipe.send(answer)
    except (EOFError, ConnectionError):
        pass  # the flight is over, or the parent process died
    except PluginError as error:
        pipe.send(error)
    except Exception:  # the parent process raises it again
        pipe.send(traceback.format_exc())


def _run(
    group: NavigatorGroup, command: str, now_s: float, rows: NDArray[np.float64], *rest: Any
) -> Optional[List[NavigatorResult]]:
    states = RobotStates(BodyState(rows))
    if command == "scan":
        group.scan(now_s, states)
        return None
    return group.navigate(now_s, states, *rest)
