"""DynaBARN: protocol, set-up and flights.

The protocol is that of the challenge's own runner: from the open side of a field of 20 m by 20 m
straight across it, through obstacles that move along keyframes and do not react to it. The clock
starts when the robot has left its start. The protocol leaves two things open. The phase of the
obstacles differs from run to run there: the robot starts some seconds of wall time after them; here
it follows from the seed. Positions between keyframes are Gazebo's spline, or straight lines as in
the paper: an option.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Iterator, List, Optional, Tuple

import numpy as np

from quad_bench.barn.dynamic_worlds import START, DynamicWorld, load_dynamic_worlds
from quad_bench.barn.protocol import TIME_LIMIT_S, Run
from quad_bench.barn.runs import judged
from quad_bench.barn.setup import (
    SCANS_PER_S,
    BarnOptions,
    BarnSetup,
    Contestant,
    read_contestant,
)
from quad_bench.flights import fly_each
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.errors import InputError
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import GoalSequence, SequenceSettings
from quad_nav.mission.robot_goals import RobotGoals, WatchedGoalFile
from quad_nav.offline.flight import Flight, FlightObserver, StopAtContact
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.scenario.rules import steps_per_scan
from quad_nav.sim.motion import SPLINE
from quad_nav.sim.movers import Movers

GOAL_M: Tuple[float, float] = (-9.0, 0.0)
GOAL_TOLERANCE_M = 1.0
LEFT_M = 0.1
"""Distance from the start at which the clock starts."""
AREA: Tuple[float, float, float, float] = (-10.0, -10.0, 12.0, 10.0)
"""Least x and y, greatest x and y of field and start, m."""
PHASE_S = 100.0
"""Phases are from 0 to this."""
PUBLISHED_SPEED_MPS = 0.5
"""``max_vel_x`` of the published figures."""
_EVASION_SPEED = "evasion/max_speed"
PUBLISHED = {"easy": 0.78, "medium": 0.43, "hard": 0.17}
"""Success rates of move_base with DWA in Gazebo, read off Fig. 5 of A. Nair et al., SSRR 2022."""

_PHASE_STREAM = 6


def _goals(timeout_s: float) -> GoalSequence:
    return GoalSequence((Goal(*GOAL_M),), SequenceSettings(GOAL_TOLERANCE_M, timeout_s, retries=0))


@dataclass(frozen=True)
class DynamicRun(Run):
    """Flight through one world; its ``metric`` is 0: the challenge's does not fit these worlds.

    Attributes:
        difficulty: 0 easy, 1 medium, 2 hard.
        phase_s: Time by which the obstacles were ahead of the clock.
        waited_s: Time at the start; ``time_s`` begins after it.
    """

    difficulty: int = 0
    phase_s: float = 0.0
    waited_s: float = 0.0


class ProtocolClock(FlightObserver):
    """Clock that starts when the robot leaves its start; it stops the flight at the time limit.

    Attributes:
        now_s: Simulation time.
        left_s: Time at which the robot left its start, None before.
    """

    def __init__(self) -> None:
        """Start with a robot at its start."""
        self.now_s = 0.0
        self.left_s: Optional[float] = None

    @property
    def waited_s(self) -> float:
        """Time that the robot has spent at its start."""
        return self.now_s if self.left_s is None else self.left_s

    @property
    def time_s(self) -> float:
        """Time since the robot left its start."""
        return self.now_s - self.waited_s

    @property
    def stop_reason(self) -> str:
        """A reason after the time limit."""
        return f"time limit of {TIME_LIMIT_S:g} s" if self.time_s >= TIME_LIMIT_S else ""

    def on_move(self, flight: Flight) -> None:
        """Keep the time, and notice that the robot leaves."""
        self.now_s = flight.now_s
        x_m, y_m = flight.states.poses[0, :2].tolist()
        if self.left_s is None and math.hypot(x_m - START.x_m, y_m - START.y_m) >= LEFT_M:
            self.left_s = self.now_s


@dataclass(frozen=True)
class DynamicSetup(BarnSetup):
    """A contestant, the worlds, the number of runs through each, and the interpolation."""

    interpolation: str = SPLINE


def read_dynamic_setup(
    options: BarnOptions, interpolation: str, max_vel_x_mps: float
) -> DynamicSetup:
    """Read worlds and configuration.

    Args:
        options: The options; ``sample`` does not count.
        interpolation: Of the obstacles' keyframes, "linear" or "spline".
        max_vel_x_mps: Greatest speed for the local planner; 0 for that of the configuration.

    Raises:
        InputError: Every fault in them.
    """
    problems: List[str] = []
    worlds: Tuple[DynamicWorld, ...] = ()
    try:
        worlds = load_dynamic_worlds(options.worlds, options.only)
    except InputError as error:
        problems += error.problems
    try:
        goals = _goals(TIME_LIMIT_S)
        contestant = read_contestant(options, goals, AREA)
        if _evasion_speed_mps(contestant) > 0.0:
            # The benchmark's speed limit holds for evasions too, unless the user sets another one.
            no_faster = (_EVASION_SPEED, 0.0)
            options = replace(options, parameters=(no_faster, *options.parameters))
            contestant = read_contestant(options, goals, AREA)
        if max_vel_x_mps > 0.0:
            limits = _speed_limits(contestant, max_vel_x_mps)
            options = replace(options, parameters=(*options.parameters, *limits))
            contestant = read_contestant(options, goals, AREA)
    except InputError as error:
        raise InputError(problems + error.problems) from error
    if problems:
        raise InputError(problems)
    return DynamicSetup(_fast_enough(contestant), worlds, options.runs, interpolation)


def _fast_enough(contestant: Contestant) -> Contestant:
    """Let the body fly as fast as its configuration lets it evade."""
    simulation = contestant.simulation
    speed_mps = max(simulation.flight.max_speed_mps, _evasion_speed_mps(contestant))
    flight = replace(simulation.flight, max_speed_mps=speed_mps)
    return replace(contestant, simulation=replace(simulation, flight=flight))


def _evasion_speed_mps(contestant: Contestant) -> float:
    filter_name, name = _EVASION_SPEED.split("/")
    return float(contestant.configuration.tree.get(filter_name, {}).get(name, 0.0))


def _speed_limits(contestant: Contestant, speed_mps: float) -> List[Tuple[str, float]]:
    """Return the parameters that limit the configuration's local planner to a speed."""
    planner = contestant.configuration.local_planner
    if isinstance(planner, TrajectoryPlannerParams):
        return [("TrajectoryPlannerROS/max_vel_x", speed_mps)]
    if isinstance(planner, DwaParams):
        return [(f"DWAPlannerROS/{name}", speed_mps) for name in ("max_vel_x", "max_vel_trans")]
    raise InputError(["--max-vel-x: the local planner has no such limit, expected 0"])


def phase_of(seed: int, world: int) -> float:
    """Return the phase of a flight in s, the same for every contestant."""
    return float(PHASE_S * np.random.default_rng([seed, _PHASE_STREAM, world]).random())


def flight_setup(
    contestant: Contestant, world: DynamicWorld, interpolation: str, run: int
) -> FlightSetup:
    """Set up one flight; run 0 has the contestant's seed, run 1 the next one, in every world.

    A phase at which an obstacle is at the start is replaced by a later one.
    """
    seed, radius_m = contestant.seed + run, contestant.simulation.airframe.radius_m
    goals = _goals(TIME_LIMIT_S)
    phase_s = phase_of(seed, world.number)
    while _start_distance_m(world, interpolation, phase_s) <= radius_m:
        phase_s += 1.0
    return FlightSetup(
        world.scene(interpolation, phase_s),
        (RobotGoals("quad0", WatchedGoalFile("dynabarn"), goals),),
        (contestant.configuration,),
        contestant.name,
        contestant.simulation,
        steps_per_scan(SCANS_PER_S),
        seed,
    )


def _start_distance_m(world: DynamicWorld, interpolation: str, phase_s: float) -> float:
    movers = Movers(world.scene(interpolation, phase_s))
    return float(movers.distances_m(np.array([[START.x_m, START.y_m]]), np.zeros(1))[0])


def fly_all(setup: DynamicSetup, count: int) -> Iterator[DynamicRun]:
    """Yield every run of every world as soon as it is flown, in any order; see ``fly_each``."""
    tasks = [
        (setup.contestant, world, setup.interpolation, run)
        for run in range(setup.runs)
        for world in setup.worlds
    ]
    return fly_each(fly_world, tasks, count)


def fly_world(
    contestant: Contestant, world: DynamicWorld, interpolation: str, run: int
) -> DynamicRun:
    """Fly through a world until the goal, the first contact or the time limit."""
    setup = flight_setup(contestant, world, interpolation, run)
    clock = ProtocolClock()
    summary = fly(setup, (StopAtContact(), clock))
    return DynamicRun(
        world.number,
        run,
        metric=0.0,
        difficulty=world.difficulty,
        phase_s=setup.scene.motion_phase_s or 0.0,
        waited_s=clock.waited_s,
        **judged(summary, clock.time_s),
    )
