"""A crew in a process of its own: it is told what a crew is told, and answers through a pipe."""

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

from quad_nav.geometry import Pose2D
from quad_nav.offline.navigator_group import Navigated, NavigatorGroup
from quad_nav.peers.peer import Intention
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.sim.flight import BodyState
from quad_nav.sim.lidars import kernel_lidars
from quad_nav.sim.simulation import RobotStates

PROCESS_NAME = "navigators"
_ROBOTS_WORTH_ONE = 10  # fewer, and telling takes as long as doing
_PATIENCE_S = 5.0
# A copy of this process is there at once. Where that is not safe, another Python is begun.
_START = "fork" if sys.platform == "linux" else "spawn"


def processes_for(robots: int) -> int:
    """How many processes make a flight of so many quadcopters fast on the cores at hand."""
    cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return max(1, min(cores, robots // _ROBOTS_WORTH_ONE))


class WorkerProcessError(RuntimeError):
    """A crew's process has failed; the words are its traceback's."""


class WorkerProcess:
    """The crew of some of a setup's quadcopters. Raises ``WorkerProcessError`` when it has failed."""

    def __init__(self, setup: FlightSetup, robots: Sequence[int]):
        self.robots = tuple(robots)
        context = multiprocessing.get_context(_START)
        self._pipe, theirs = context.Pipe()
        # context.Process is what the platform's way of starting makes of it.
        self._process = context.Process(  # type: ignore[attr-defined]
            target=_serve,
            args=(theirs, self._pipe, setup, self.robots),
            name=PROCESS_NAME,
            daemon=True,
        )
        self._process.start()
        theirs.close()

    def scan(self, now_s: float, states: RobotStates) -> None:
        """As ``NavigatorGroup.scan``; what was seen stays there."""
        self._tell("scan", now_s, states.bodies.rows)

    def begin_navigating(
        self,
        now_s: float,
        states: RobotStates,
        goals: Mapping[int, Pose2D],
        news: Mapping[int, Intention],
    ) -> None:
        """As ``NavigatorGroup.navigate``; what was done is for ``navigated``."""
        self._tell("navigate", now_s, states.bodies.rows, goals, news)

    def navigated(self) -> List[Navigated]:
        """Waits for what has been begun."""
        try:
            answer = self._pipe.recv()
        except (EOFError, ConnectionError):
            answer = "it has ended"
        if isinstance(answer, str):
            raise WorkerProcessError(
                f"a process with {len(self.robots)} navigators has failed: {answer}"
            )
        return answer

    def close(self) -> None:
        """Ends the process."""
        with contextlib.suppress(ConnectionError):  # it has ended already
            self._pipe.send(())
        self._pipe.close()
        self._process.join(_PATIENCE_S)
        if self._process.is_alive():  # in the middle of something that nobody waits for
            self._process.kill()
            self._process.join()

    def _tell(self, *words: object) -> None:
        try:
            self._pipe.send(words)
        except ConnectionError:
            self.navigated()  # says why it does not listen


def _serve(
    pipe: Connection, others: Connection, setup: FlightSetup, robots: Tuple[int, ...]
) -> None:
    """Until it is told nothing. Without its copy of their end, it sees when they die."""
    others.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who began the flight
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        params = setup.simulation
        crew = NavigatorGroup(
            setup,
            robots,
            kernel_lidars(
                params.lidar, setup.scene, len(setup.robots), setup.seed, params.airframe.radius_m
            ),
        )
        for words in iter(pipe.recv, ()):
            answer = _act(crew, *words)
            if answer is not None:
                pipe.send(answer)
    except (EOFError, ConnectionError):
        pass  # the flight is over, or who flew it has died
    except Exception:  # whatever it is: it is raised again where the flight is flown
        pipe.send(traceback.format_exc())


def _act(
    crew: NavigatorGroup, what: str, now_s: float, rows: np.ndarray, *rest: Any
) -> Optional[List[Navigated]]:
    states = RobotStates(BodyState(rows))
    if what == "scan":
        crew.scan(now_s, states)
        return None
    return crew.navigate(now_s, states, *rest)
