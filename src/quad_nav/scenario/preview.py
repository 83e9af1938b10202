"""Preview of a mission before it flies: costs, goals with their faults, and plans between them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.config import Configuration
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.mission.goal_file import GoalSequence, readable_goals
from quad_nav.mission.place_check import PlaceCheck
from quad_nav.mission.robot_goals import GoalSource, goal_paths
from quad_nav.scenario.flight_setup import (
    FlightOptions,
    read_readable_parts,
    read_setup,
    with_default_files,
)
from quad_nav.scenario.goal_checks import place_check
from quad_nav.scenario.goal_plans import GoalPlans
from quad_nav.sim.movers import Movers
from quad_nav.sim.obstacles import Obstacle
from quad_nav.sim.scene_file import readable_scene


@dataclass(frozen=True)
class RobotPreview:
    """One robot's goals and the plans between them.

    Attributes:
        number: Number of the robot.
        start: Start pose in ``map``; None if the scene has none for this robot.
        sequence: Content of the goal file, faulty positions included.
        faults: What is wrong with each goal's position, "" for a good one.
        plans: float64[n, 2] of (x_m, y_m) in ``map`` for each goal, from the goal before it or the
            start; empty without a plan.
        warnings: A line for each goal that no plan leads to.
    """

    number: int
    start: Optional[Pose2D]
    sequence: GoalSequence
    faults: Tuple[str, ...]
    plans: Tuple[NDArray[np.float64], ...]
    warnings: Tuple[str, ...]

    @property
    def name(self) -> str:
        """Name of the robot."""
        return f"quad{self.number}"


class MissionPreview:
    """Everything of a mission that can be shown, also if it cannot fly.

    Attributes:
        scene: The scene; None if it cannot be read.
        problems: The faults for which ``quad fly`` refuses the mission.
        warnings: The warnings of ``quad fly``.
        files: Goal files by the robots' numbers; none for a random mission.
        robot_radius_m: Radius of the robots' hulls.
        moving: Moving obstacles and people where they start; without people who react to
            quadcopters.
    """

    def __init__(self, options: FlightOptions) -> None:
        """Read whatever can be read of the files that a flight needs."""
        self.problems: Tuple[str, ...] = ()
        try:
            setup = read_setup(options)
        except InputError as error:
            parts = read_readable_parts(options)
            self.problems, self.warnings = tuple(error.problems), parts.warnings
            self.scene, robots = parts.scene, parts.robots
            file = with_default_files(options).scene
            if self.scene is None and file is not None:
                self.scene = readable_scene(file)
            self.robot_radius_m = parts.robot_radius_m
            configurations: Sequence[Optional[Configuration]] = parts.configurations
        else:
            self.scene, self.warnings, robots = setup.scene, setup.warnings, setup.robots
            configurations = setup.configurations
            self.robot_radius_m = setup.robot_radius_m
        self.moving = self._starting(options.seed)
        self._configurations = dict(enumerate(configurations))
        self._sequences = {int(one.name[len("quad") :]): one.sequence for one in robots}
        self._plans = GoalPlans(self.scene, self._configurations)
        self.files: Dict[int, Path] = {}
        options = with_default_files(options)
        if options.goals is not None:
            sources, _ = goal_paths(Path(options.goals).expanduser(), options.robots or 1)
            self.files = {number: source.path for number, source in sources.items()}
            self._read_faulty_files(sources)

    def _starting(self, seed: int) -> Tuple[Obstacle, ...]:
        """Return the moving obstacles where they start; note if there is no room for people."""
        if self.scene is None:
            return ()
        try:
            return tuple(Movers(self.scene, seed).at(0.0))
        except InputError as error:
            self.problems += tuple(error.problems)
            return ()

    def _read_faulty_files(self, sources: Mapping[int, GoalSource]) -> None:
        """Read what can be read of faulty files, whose faults are among the problems."""
        for number, (path, robot) in sources.items():
            sequence = None if number in self._sequences else readable_goals(path, robot)
            if sequence is not None:
                self._sequences[number] = sequence

    @property
    def numbers(self) -> List[int]:
        """Numbers of the robots whose goals can be shown."""
        return sorted(self._sequences)

    def check(self, number: int) -> PlaceCheck:
        """Return the check for positions of a robot's goals, as ``quad fly`` has it."""
        return place_check(self.scene, self.robot_radius_m, self._configurations.get(number))

    def robot(self, number: int, sequence: Optional[GoalSequence] = None) -> RobotPreview:
        """Check and plan a robot's goals, those of its file unless others are given."""
        sequence = sequence or self._sequences[number]
        check = self.check(number)
        faults = tuple(check(goal.x_m, goal.y_m) or "" for goal in sequence.goals)
        starts = self.scene.starts if self.scene else ()
        start = starts[number] if number < len(starts) else None
        plans, warnings = self._plans.plans(number, start, sequence, faults)
        return RobotPreview(number, start, sequence, faults, tuple(plans), tuple(warnings))

    def costmap(self, number: int) -> Optional[LayeredCostmap]:
        """Return a robot's global costmap as if it had seen the whole scene; None if unknown."""
        return self._plans.costmap(number)
