"""A navigator group in a worker process.

The bodies' states and the switches of the LIDARs are in memory that both processes share. Orders
and results go through a pipe. There is no order while the group has nothing to do.
"""

from __future__ import annotations

import contextlib
import math
import multiprocessing
import os
import signal
import sys
import threading
import traceback
from multiprocessing.connection import Connection
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError, PluginError
from quad_nav.files.user_files import in_folder, outside_current_folder
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.loop import LoopSetup
from quad_nav.loop.inspection import Change, Inspection, NavigatorView, inspect_group
from quad_nav.loop.navigator_group import GroupFactory, NavigatorGroup, NavigatorResult
from quad_nav.navigator.tick import RobotPoses, State, Tick
from quad_nav.peers.peer import Intention
from quad_nav.sim.casters import Lidars, kernel_lidars
from quad_nav.sim.flight import BODY_VALUES, BodyState
from quad_nav.sim.odometry import OdomFrames
from quad_nav.sim.robot_state import RobotStates
from quad_nav.sim.simulation_params import STEPS_PER_S
from quad_nav.timing import is_due

PROCESS_NAME = "navigators"
START_METHOD = "fork" if sys.platform == "linux" else "spawn"
"""A fork is there at once. Where forking is not safe, a new Python starts."""
_JOIN_TIMEOUT_S = 5.0
_READY = "ready"
_STATES = tuple(State)
_NOWHERE = RobotPoses(None, None)


def processes_for(robots: int, start_method: str = START_METHOD, robots_each: int = 1) -> int:
    """Number of processes that make a flight of so many robots fast on this machine.

    Offline a second process pays from two robots on.

    Args:
        robots: Number of robots.
        start_method: Of the worker processes. There are none to fork if this process has threads,
            whose locks they would inherit.
        robots_each: Number of robots from which on a process pays.
    """
    if start_method == "fork" and threading.active_count() > 1:
        return 1
    cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return max(1, min(cores, robots // robots_each))


class WorkerProcessError(RuntimeError):
    """A worker process failed; the message has its traceback."""


class SharedStates:
    """Memory that both processes share: the bodies at the last few instants, and switches."""

    SLOTS = 16

    def __init__(self, robots: int, moving: int, context: Any) -> None:
        """Allocate it in the ``context`` of its process."""
        self._shape = (self.SLOTS, robots, BODY_VALUES)
        self._moving_shape = (self.SLOTS, moving, 3)
        self._rows = context.RawArray("d", self.SLOTS * robots * BODY_VALUES)
        self._obstacles = context.RawArray("d", self.SLOTS * moving * 3)
        self._odom_frames = context.RawArray("d", self.SLOTS * robots * 3)
        self._enabled = context.RawArray("b", robots)
        self.lidar_enabled[:] = True

    @property
    def rows(self) -> NDArray[np.float64]:
        """float64[SLOTS, n, 13], ``BodyState.rows``."""
        return np.ndarray(self._shape, float, self._rows)

    @property
    def obstacles(self) -> NDArray[np.float64]:
        """float64[SLOTS, m, 3], ``BodyState.obstacles``."""
        return np.ndarray(self._moving_shape, float, self._obstacles)

    @property
    def odom_frames(self) -> NDArray[np.float64]:
        """float64[SLOTS, n, 3], ``OdomFrames.rows``."""
        return np.ndarray((self.SLOTS, self._shape[1], 3), float, self._odom_frames)

    @property
    def lidar_enabled(self) -> NDArray[np.bool_]:
        """bool[n], LIDARs that are on."""
        return np.frombuffer(self._enabled, dtype=bool)


class WorkerProcess:
    """A navigator group in a process of its own.

    A process that builds its navigators, or is late with results, gets no orders; what is in the
    attributes waits until it can take some. Every method raises ``WorkerProcessError`` if the
    process has failed.

    Attributes:
        robots: Numbers of the robots.
        goals: New goals in ``map`` by robot, for the next ``begin_navigating``.
        intentions: Intentions in ``map`` by robot that have changed, for it as well.
    """

    def __init__(
        self,
        setup: LoopSetup,
        robots: Sequence[int],
        make_group: GroupFactory = NavigatorGroup,
        start_method: str = START_METHOD,
        whole_ticks: bool = True,
    ) -> None:
        """Start the process for the robots with these numbers; see ``FlightLoop``."""
        self.robots = tuple(robots)
        self.goals: Dict[int, Pose2D] = {}
        self.intentions: Dict[int, Intention] = {}
        self._is_ready = self._owes_results = self._is_late = self._owes_views = False
        self._due_s = -math.inf
        self._slot, self._unanswered = 0, 0
        self._written: Optional[RobotStates] = None  # what is in the slot
        context = multiprocessing.get_context(start_method)
        self._shared = SharedStates(len(setup.names), len(setup.scene.moving_shapes), context)
        self._pipe, worker_end = context.Pipe()
        parent_end = self._pipe if start_method == "fork" else None
        worker = _Worker(setup, self.robots, make_group, self._shared, whole_ticks)
        arguments = os.getcwd(), _serve, worker_end, parent_end, worker
        self._process = context.Process(  # type: ignore[attr-defined]
            target=in_folder, args=arguments, name=PROCESS_NAME, daemon=True
        )
        with outside_current_folder():
            self._process.start()
        worker_end.close()

    @property
    def lidar_enabled(self) -> NDArray[np.bool_]:
        """LIDARs that are on, bool[n]; changes take effect at the next scan."""
        return self._shared.lidar_enabled

    @property
    def pid(self) -> int:
        """Number of the process in the operating system."""
        pid: int = self._process.pid
        return pid

    @property
    def is_ready(self) -> bool:
        """True once the navigators are built and while no results are owed."""
        if not self._is_ready and self._pipe.poll():
            self.wait_until_ready()
        return self._is_ready and not self._owes_results

    def wait_until_ready(self) -> None:
        """Wait until the navigators are built.

        Raises:
            InputError: A plugin refuses its parameters.
        """
        if not self._is_ready:
            self._receive()
            self._is_ready = True

    def scan(self, now_s: float, states: RobotStates) -> None:
        """Start ``NavigatorGroup.scan``; the scans stay in the worker process."""
        if self.is_ready:
            self._send("scan", now_s, self._write(states))

    def begin_navigating(self, now_s: float, states: RobotStates) -> None:
        """Start ``NavigatorGroup.navigate`` if it is due; ``results`` returns what it returns."""
        is_wanted = self.goals or is_due(self._due_s, now_s)
        # The slots of unanswered scans are not written again.
        is_wanted = is_wanted or self._unanswered >= SharedStates.SLOTS - STEPS_PER_S // 40
        if is_wanted and self.is_ready:
            slot = self._write(states)
            self._send("navigate", now_s, slot, self.goals, self.intentions)
            self.goals, self.intentions = {}, {}
            self._owes_results = True

    def results(self, patience_s: Optional[float] = None) -> List[NavigatorResult]:
        """Wait for the results of ``begin_navigating``.

        Args:
            patience_s: Wall time after which to return [] instead; the results come with a later
                call, which does not wait for them again.

        Raises:
            PluginError: A plugin has a mistake.
        """
        if not self._owes_results:
            return []
        if patience_s is not None and not self._pipe.poll(0.0 if self._is_late else patience_s):
            self._is_late = True
            return []
        self._due_s, results = self._receive()
        self._owes_results = self._is_late = False
        self._unanswered = 0
        return [one if isinstance(one, NavigatorResult) else _expanded(one) for one in results]

    def begin_inspecting(self, what: Inspection, now_s: float) -> None:
        """Start to look at the navigators unless results are owed; ``views`` has the answer."""
        if self.is_ready:
            self._send("inspect", what, now_s)
            self._owes_views = True

    def views(self) -> List[NavigatorView]:
        """Wait for the answer to ``begin_inspecting``; [] if it did not start."""
        if not self._owes_views:
            return []
        self._owes_views = False
        views: List[NavigatorView] = self._receive()
        return views

    def change(self, change: Change) -> bool:
        """Start a change of a navigator; return False while results are owed."""
        if not self.is_ready:
            return False
        self._send("change", change)
        self._due_s = -math.inf
        return True

    def reset(self, now_s: float, seed: int, jumped_back: bool) -> None:
        """Start ``NavigatorGroup.reset``."""
        self._send("reset", now_s, seed, jumped_back)

    def close(self) -> None:
        """End the process; kill it if it does not end within 5 s."""
        with contextlib.suppress(ConnectionError):  # the process has ended already
            self._pipe.send(())
        self._pipe.close()
        self._process.join(_JOIN_TIMEOUT_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _write(self, states: RobotStates) -> int:
        """Return the slot with the robots' states."""
        if states is not self._written:
            bodies, frames = states.bodies, states.frames.rows
            self._slot = (self._slot + 1) % SharedStates.SLOTS
            self._unanswered += 1
            self._shared.rows[self._slot] = bodies.rows
            self._shared.obstacles[self._slot] = bodies.obstacles
            if frames is not None:
                self._shared.odom_frames[self._slot] = frames
            self._written = states
        return self._slot

    def _send(self, *command: object) -> None:
        try:
            self._pipe.send(command)
        except ConnectionError:
            self._receive()  # raises with the reason

    def _receive(self) -> Any:
        try:
            answer = self._pipe.recv()
        except (EOFError, ConnectionError):
            answer = "it has ended"
        if isinstance(answer, (InputError, PluginError)):
            raise answer
        if isinstance(answer, str) and answer != _READY:
            raise WorkerProcessError(
                f"a worker process with {len(self.robots)} navigators failed: {answer}"
            )
        return answer


def _serve(pipe: Connection, parent_end: Optional[Connection], worker: _Worker) -> None:
    """Run orders from the pipe until an empty one comes or the parent process dies."""
    if parent_end is not None:
        parent_end.close()  # with a copy open, the parent's death would not close the pipe
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process handles Ctrl-C
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        worker.start()
        pipe.send(_READY)
        for name, *arguments in iter(pipe.recv, ()):
            answer = getattr(worker, name)(*arguments)
            if answer is not None:
                pipe.send(answer)
        worker.group.close()
    except (EOFError, ConnectionError):
        pass  # the flight is over, or the parent process died
    except (InputError, PluginError) as error:
        pipe.send(error)
    except Exception:  # the parent process raises it again
        pipe.send(traceback.format_exc())


class _Worker:
    """The orders of a worker process, which starts it."""

    group: NavigatorGroup

    def __init__(
        self,
        setup: LoopSetup,
        robots: Tuple[int, ...],
        make_group: GroupFactory,
        shared: SharedStates,
        whole_ticks: bool,
    ) -> None:
        self._setup, self._robots, self._make_group = setup, robots, make_group
        self._shared, self._whole_ticks = shared, whole_ticks

    def start(self) -> None:
        self.group = self._make_group(self._setup, self._robots, self._lidars(self._setup.seed))
        self.group.lidar_enabled = self._shared.lidar_enabled

    def _lidars(self, seed: int) -> Lidars:
        setup, params = self._setup, self._setup.simulation
        radius_m = params.airframe.radius_m
        return kernel_lidars(params.lidar, setup.scene, len(setup.names), seed, radius_m)

    def _states(self, slot: int) -> RobotStates:
        bodies = BodyState(self._shared.rows[slot], self._shared.obstacles[slot])
        if self._setup.simulation.odom_drift.is_zero:
            return RobotStates(bodies)
        return RobotStates(bodies, OdomFrames(self._shared.odom_frames[slot]))

    def scan(self, now_s: float, slot: int) -> None:
        self.group.scan(now_s, self._states(slot))

    def navigate(
        self,
        now_s: float,
        slot: int,
        goals: Dict[int, Pose2D],
        intentions: Dict[int, Intention],
    ) -> Tuple[float, List[Any]]:
        for robot, intention in intentions.items():
            self.group.intentions[robot] = intention
        results = self.group.navigate(now_s, self._states(slot), goals)
        if not self._whole_ticks:
            return self.group.due_s, [_packed(result) for result in results]
        return self.group.due_s, results

    def inspect(self, what: Inspection, now_s: float) -> List[NavigatorView]:
        return inspect_group(self.group, what, now_s)

    def change(self, change: Change) -> None:
        change(self.group)

    def reset(self, now_s: float, seed: int, jumped_back: bool) -> None:
        self.group.reset(now_s, jumped_back, self._lidars(seed))


def _packed(result: NavigatorResult) -> Tuple[Any, ...]:
    """Convert a result to a short message; ``_expanded`` converts it back."""
    tick, command = result.tick, result.tick.command
    return (
        result.robot,
        tick.now_s,
        _STATES.index(tick.state),
        tick.cycle,
        command and (command.vx_mps, command.vy_mps, command.vyaw_radps),
        tick.recovery,
        tick.outcome,
        result.wall_s,
        result.goal_waits,
        result.intention,
    )


def _expanded(packed: Tuple[Any, ...]) -> NavigatorResult:
    robot, now_s, state, cycle, command, recovery, outcome, *rest = packed
    tick = Tick(
        now_s,
        _STATES[state],
        cycle=cycle,
        command=command and Twist2D(*command),
        recovery=recovery,
        outcome=outcome,
    )
    return NavigatorResult(robot, tick, _NOWHERE, *rest)
