"""The loop scan -> costmap -> plan -> velocity -> body -> scan, which both shells advance.

Reading order: this module has the loop's input, ``flight_loop`` the loop, ``navigator_group`` the
LIDARs and navigators that share a process, and ``worker_process`` such a group in a process of its
own.

A shell owns what is around the loop: goals, logs, topics, the pace. It repeats these calls::

    loop = FlightLoop(setup, shares)
    loop.start()                                     # the first scans
    while ...:
        progress = loop.advance(steps)               # at most to the next scan or odometry
        ... progress.contacts, progress.scans, loop.simulation.body_state
        if progress.is_odometry:
            loop.send_goal(robot, pose)              # where there is a new one
            for result in loop.navigate():           # in the order of the robots' numbers
                loop.command(result.robot, result.tick.command)   # unless the shell refuses it

``FlightLoop`` documents what else a shell can do: fly some robots by commands from outside, switch
LIDARs off, replace worker processes, reset the simulation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Mapping, Optional, Sequence, Tuple

from quad_nav.config import Configuration
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.sim.localization import LocalizationMaker
from quad_nav.sim.scene import Scene
from quad_nav.sim.simulation_params import SimulationParams


@dataclass(frozen=True)
class LoopSetup:
    """Input of a loop; it can be pickled.

    Attributes:
        scene: The scene.
        simulation: Parameters of bodies and LIDARs.
        names: Names of all robots, by their numbers.
        configurations: Configurations of the robots that the loop navigates, by number. The others
            fly by the commands that the shell sets.
        steps_per_scan: Steps of the simulation from one scan to the next.
        seed: Of jitter, noise and drift.
        start_step: Step at which the clock starts.
        gui: Open the engine's window.
        localization: Makes what finds the robots' places; None if they know them. All robots have
            to be in one process with it.
    """

    scene: Scene
    simulation: SimulationParams
    names: Tuple[str, ...]
    configurations: Mapping[int, Configuration]
    steps_per_scan: int
    seed: int = 0
    start_step: int = 0
    gui: bool = False
    localization: Optional[LocalizationMaker] = None


def offline_setup(setup: FlightSetup) -> LoopSetup:
    """Return the loop's part of an offline flight's set-up: every robot has a navigator."""
    return LoopSetup(
        setup.scene,
        setup.simulation,
        tuple(goals.name for goals in setup.robots),
        dict(enumerate(setup.configurations)),
        setup.steps_per_scan,
        setup.seed,
        localization=setup.localization,
    )


def shares_of(robots: Sequence[int], processes: int) -> List[Tuple[int, ...]]:
    """Divide robots among processes in turn; there is at least one share, and only it is empty."""
    count = max(1, min(processes, len(robots)))
    return [tuple(robots[first::count]) for first in range(count)]
