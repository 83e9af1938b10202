"""The loop of a flight: bodies, LIDARs and navigators, advanced in simulated time.

Time advances in the simulation's steps of 1/240 s. Scans are taken and delivered at their own
steps. Every 1/40 s there is odometry: then the navigators run what is due. Equal set-ups and equal
calls give equal flights, bit for bit, whatever the division into processes.
"""

from __future__ import annotations

from functools import partial
from operator import attrgetter
from typing import Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.loop import LoopSetup, inspection
from quad_nav.loop.inspection import Change, Inspection, NavigatorView, inspect_group
from quad_nav.loop.navigator_group import (
    GroupFactory,
    LocatedScan,
    NavigatorGroup,
    NavigatorResult,
)
from quad_nav.loop.worker_process import START_METHOD, WorkerProcess, WorkerProcessError
from quad_nav.peers.peer import Intention
from quad_nav.sim.contacts import Contact
from quad_nav.sim.robot_state import RobotStates
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEPS_PER_ODOMETRY
from quad_nav.timing import is_due

WorkerLoss = Callable[[Tuple[int, ...], WorkerProcessError], None]
"""Receiver of a lost worker process: the numbers of its robots, and the reason."""


class Progress(NamedTuple):
    """Events of one call of ``FlightLoop.advance``.

    Attributes:
        contacts: The contacts that began.
        scans: The scans that this process took, by the robots' numbers.
        is_odometry: An instant of odometry is reached; ``navigate`` is to be called.
    """

    contacts: List[Contact]
    scans: Mapping[int, LocatedScan]
    is_odometry: bool


class FlightLoop:
    """Simulation and navigators of one fleet.

    Every method raises ``WorkerProcessError`` if a worker process has failed and there is no
    ``on_worker_loss``.

    Args:
        setup: The set-up.
        shares: Numbers of the robots that each process navigates, each robot at most once. The
            first share is that of this process and may be empty. Robots of no share are flown by
            the shell: with ``command``, and their intentions with ``set_intention``.
        make_group: Makes the group of a process, in that process. It must be picklable unless the
            processes are forked. ``NavigatorGroup`` lists the methods that a subclass may extend.
        start_method: Of the worker processes: "fork", "forkserver" or "spawn". Forked ones must be
            started before there are threads.
        on_worker_loss: Called when a worker process has failed or ended. Without it the loop raises
            the error. With it the loop goes on: the robots hover when their last commands time
            out, and ``add_worker`` may host them again.
        patience_s: Longest wall time to wait for the results of a worker process. One that takes
            longer misses scans until it answers, and its late results are those of the next
            ``navigate``. None to wait without limit.
        whole_ticks: Results of worker processes have all of their ticks, which takes time. Without
            it they have time, state, cycle, command, recovery and outcome, and no poses.

    Attributes:
        setup: The set-up.
        simulation: The simulation; commands from outside may be set here too.
        group: The navigators of this process.
        workers: The worker processes.
    """

    def __init__(
        self,
        setup: LoopSetup,
        shares: Sequence[Sequence[int]],
        make_group: GroupFactory = NavigatorGroup,
        start_method: str = START_METHOD,
        on_worker_loss: Optional[WorkerLoss] = None,
        patience_s: Optional[float] = None,
        whole_ticks: bool = True,
    ) -> None:
        self.setup = setup
        self._whole_ticks = whole_ticks
        self._make_group, self._start_method = make_group, start_method
        self._on_worker_loss, self._patience_s = on_worker_loss, patience_s
        # Before the engine is created: forked processes must not inherit it.
        self.workers = [self._new_worker(share) for share in shares[1:]]
        self.simulation = Simulation(
            setup.scene,
            len(setup.names),
            setup.simulation,
            setup.seed,
            setup.gui,
            setup.start_step,
        )
        self.group = make_group(setup, tuple(shares[0]), self.simulation.lidars)
        self._states: Optional[RobotStates] = None
        self._intentions: Dict[int, Intention] = {}
        self._new_goals: Dict[int, Pose2D] = {}

    @property
    def hosted(self) -> Tuple[int, ...]:
        """Numbers of the robots that a process navigates now, in order."""
        numbers = list(self.group.robots)
        for worker in self.workers:
            numbers += worker.robots
        return tuple(sorted(numbers))

    @property
    def now_s(self) -> float:
        """Simulated time."""
        return self.simulation.now_s

    @property
    def states(self) -> RobotStates:
        """States of all robots now; the same object until they move."""
        bodies = self.simulation.body_state
        if self._states is None or self._states.bodies is not bodies:
            self._states = RobotStates(bodies, self.simulation.odom_frames)
        return self._states

    # -- time ----------------------------------------------------------------------------

    def start(self) -> Mapping[int, LocatedScan]:
        """Wait for the worker processes and take the first scans; return those of this process."""
        self._for_each_worker(WorkerProcess.wait_until_ready)
        return self._scan()

    def advance(self, steps: int = STEPS_PER_ODOMETRY) -> Progress:
        """Advance by at most so many steps: the next scan or odometry ends it earlier."""
        count, per_scan = self.simulation.step_count, self.setup.steps_per_scan
        next_scan = (count // per_scan + 1) * per_scan
        next_odometry = (count // STEPS_PER_ODOMETRY + 1) * STEPS_PER_ODOMETRY
        end = min(count + steps, next_scan, next_odometry)
        contacts = self.simulation.advance(end - count)
        scans = self._scan() if end == next_scan else {}
        return Progress(contacts, scans, end == next_odometry)

    def navigate(self) -> List[NavigatorResult]:
        """Tick the navigators that are due, in all processes at the same time.

        Returns:
            The results in the order of the robots' numbers. No command is set yet.

        Raises:
            PluginError: A plugin has a mistake.
        """
        now_s, states, own = self.now_s, self.states, {}
        if self._new_goals:
            goals, self._new_goals = self._new_goals, {}
            own = {number: goals[number] for number in self.group.robots if number in goals}
            for worker in self.workers:
                worker.goals.update((n, goals[n]) for n in worker.robots if n in goals)
        self._for_each_worker(lambda worker: worker.begin_navigating(now_s, states))
        results: List[NavigatorResult] = []
        if own or is_due(self.group.due_s, now_s):
            results += self.group.navigate(now_s, states, own)
        self._for_each_worker(lambda worker: results.extend(worker.results(self._patience_s)))
        for result in results:
            if result.intention is not None:
                self.set_intention(result.robot, result.intention)
        return sorted(results, key=attrgetter("robot"))

    # -- robots --------------------------------------------------------------------------

    def send_goal(self, robot: int, goal: Pose2D) -> None:
        """Send a goal in ``map`` to a navigator, which takes it at its next cycle."""
        self._new_goals[robot] = goal

    def cancel_goal(self, robot: int) -> None:
        """Drop the goal of a navigator, and one that it has not taken."""
        self._new_goals.pop(robot, None)
        self.change(robot, partial(inspection.cancel_goal, robot=robot))

    def command(self, robot: int, twist: Optional[Twist2D]) -> None:
        """Set a robot's command from the next step on; None changes nothing.

        Raises:
            ValueError: The velocity is not finite.
        """
        if twist is not None:
            self.simulation.set_command(robot, twist)

    def set_intention(self, robot: int, intention: Intention) -> None:
        """Tell all navigators a robot's intention in ``map``, from the next ``navigate`` on."""
        self._intentions[robot] = intention
        self.group.intentions[robot] = intention
        for worker in self.workers:
            worker.intentions[robot] = intention

    def enable_lidar(self, robot: int, is_on: bool) -> None:
        """Switch a robot's LIDAR on or off, from the next scan on."""
        self.group.lidar_enabled[robot] = is_on
        for worker in self.workers:
            worker.lidar_enabled[robot] = is_on

    # -- views ---------------------------------------------------------------------------

    def inspect(self, what: Inspection) -> List[NavigatorView]:
        """Look at the navigators of all processes, between two calls of ``navigate``.

        Returns:
            The views in the order of the robots' numbers; those of late processes are missing.
        """
        now_s = self.now_s
        self._for_each_worker(lambda worker: worker.begin_inspecting(what, now_s))
        views = inspect_group(self.group, what, now_s)
        self._for_each_worker(lambda worker: views.extend(worker.views()))
        return sorted(views, key=attrgetter("robot"))

    def change(self, robot: int, change: Change) -> bool:
        """Change a navigator before its next tick; return False if its process is late."""
        if robot in self.group.robots:
            change(self.group)
            return True
        changed: List[bool] = []
        self._for_each_worker(
            lambda one: changed.append(robot in one.robots and one.change(change))
        )
        return any(changed)

    # -- resets and processes ------------------------------------------------------------

    def reset(self, seed: Optional[int] = None, start_step: Optional[int] = None) -> None:
        """Reset the simulation, see ``Simulation.reset``; the LIDARs' noise starts again.

        The navigators continue. If the clock has jumped back, they restart their schedules and
        costmaps.

        Raises:
            InputError: There is no free position near a start.
        """
        before_s = self.now_s
        self.simulation.reset(seed, start_step)
        now_s, seed = self.now_s, self.simulation.seed
        self.group.reset(now_s, now_s < before_s, self.simulation.lidars)
        self._for_each_worker(lambda worker: worker.reset(now_s, seed, now_s < before_s))

    def add_worker(self, robots: Sequence[int]) -> None:
        """Start a worker process for robots that no process hosts.

        The loop goes on meanwhile. The process takes part as soon as its navigators are built.
        """
        worker = self._new_worker(robots)
        worker.intentions.update(self._intentions)
        worker.lidar_enabled[:] = self.group.lidar_enabled
        self.workers.append(worker)

    def close(self) -> None:
        """End the worker processes and close the simulation."""
        self.simulation.close()
        for worker in self.workers:
            worker.close()
        self.group.close()

    def _new_worker(self, robots: Sequence[int]) -> WorkerProcess:
        return WorkerProcess(
            self.setup, robots, self._make_group, self._start_method, self._whole_ticks
        )

    def _scan(self) -> Mapping[int, LocatedScan]:
        now_s, states = self.now_s, self.states
        self._for_each_worker(lambda worker: worker.scan(now_s, states))
        return self.group.scan(now_s, states)

    def _for_each_worker(self, call: Callable[[WorkerProcess], None]) -> None:
        for worker in tuple(self.workers):
            try:
                call(worker)
            except WorkerProcessError as error:
                if self._on_worker_loss is None:
                    raise
                self.workers.remove(worker)
                worker.close()
                self._on_worker_loss(worker.robots, error)
