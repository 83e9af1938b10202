"""Random missions: a scene with start poses, and goals, for any number of robots, from a seed.

Obstacles are as large and as frequent as in the tutorial's arena. A robot fits between any two
of them, and between them and the walls, so that it can reach every goal. Equal arguments give
equal missions.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, List, Tuple

import numpy as np

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import DEFAULT_SETTINGS, GoalSequence, SequenceSettings
from quad_nav.mission.robot_goals import RobotGoals, WatchedGoalFile
from quad_nav.sim.obstacles import Box, Cylinder, Obstacle
from quad_nav.sim.scene import BODY_RADIUS_M, Scene, Walls
from quad_nav.sim.scene_writer import write_scene

AREA_PER_OBSTACLE_M2 = 18.0  # the tutorial's arena: 8 obstacles on 144 m2
SMALLEST_SIZE_M = 12.0
AREA_PER_ROBOT_M2 = 36.0  # 100 quadcopters on 60 m x 60 m
_ALTITUDE_M = 1.0
_PASSAGE_M = 1.6  # between obstacles: two hulls (0.6 m each) and 0.4 m
_HEIGHT_M = 2.0
_ROOM_M = BODY_RADIUS_M + 0.4  # around starts and goals
_APART_M = 1.5  # between the starts, and between the last goals, of two
_LEG_M = (4.0, 12.0)  # straight length of the flight to a goal
_TRIES = 2000

Place = Tuple[float, float]


@dataclass(frozen=True)
class RandomMission:
    """A scene, and the goals of each robot: ``goals[i]`` are robot i's (x, y) in ``map``, m."""

    scene: Scene
    goals: Tuple[Tuple[Place, ...], ...]

    def robot_goals(self, settings: SequenceSettings = DEFAULT_SETTINGS) -> List[RobotGoals]:
        """Return the goals as if they were read from files."""
        return [
            RobotGoals(
                f"quad{index}",
                WatchedGoalFile(f"quad{index}_goals.json"),
                GoalSequence(tuple(Goal(x, y) for x, y in own), settings),
            )
            for index, own in enumerate(self.goals)
        ]

    def write(self, scene_path: Path, goals_folder: Path) -> None:
        """Write a scene file, and a goal file for each robot."""
        scene_path.parent.mkdir(parents=True, exist_ok=True)
        goals_folder.mkdir(parents=True, exist_ok=True)
        write_scene(self.scene, scene_path)
        for index, goals in enumerate(self.goals):
            text = json.dumps({"goals": [list(goal) for goal in goals]})
            (goals_folder / f"quad{index}_goals.json").write_text(text + "\n", encoding="utf-8")


def default_size_m(robots: int) -> float:
    """Side of a square arena with room for so many robots, in whole metres."""
    return float(math.ceil(max(SMALLEST_SIZE_M, math.sqrt(AREA_PER_ROBOT_M2 * robots))))


def random_mission(
    robots: int, seed: int, size_m: float = 0.0, goals_each: int = 3
) -> RandomMission:
    """Make a random mission in a square arena.

    Args:
        robots: Number of robots.
        seed: Seed of obstacles, starts and goals.
        size_m: Side of the arena; 0 for ``default_size_m``.
        goals_each: Number of goals of each robot.

    Raises:
        InputError: The arena has no room for so many robots.
    """
    size_m = size_m or default_size_m(robots)
    ground = _Ground(size_m, np.random.default_rng([seed, 2]))
    for index in range(round(size_m * size_m / AREA_PER_OBSTACLE_M2)):
        ground.add_obstacle(index)
    starts: List[Place] = []
    for robot in range(robots):
        starts.append(ground.place(f"start {robot}", lambda p: _is_apart(p, starts)))
    goals = [ground.legs(start, goals_each) for start in starts]
    _separate_last_goals(ground, starts, goals)
    poses = [Pose2D(x, y, _heading((x, y), own[0])) for (x, y), own in zip(starts, goals)]
    scene = Scene(
        f"random {seed}",
        size_m,
        size_m,
        _ALTITUDE_M,
        Walls(),
        tuple(ground.obstacles),
        tuple(poses),
    )
    return RandomMission(scene, tuple(tuple(own) for own in goals))


class _Ground:
    """The arena's obstacles, each as a disc, and its free places."""

    def __init__(self, size_m: float, random: np.random.Generator) -> None:
        self.obstacles: List[Obstacle] = []
        self._size_m = size_m
        self._random = random
        self._discs = np.empty((0, 3))  # x, y, radius

    def room_m(self, place: Place) -> float:
        """Distance to the nearest disc or wall."""
        walls_m = min(*place, self._size_m - place[0], self._size_m - place[1])
        gaps = np.hypot(self._discs[:, 0] - place[0], self._discs[:, 1] - place[1])
        return min(walls_m, float(np.min(gaps - self._discs[:, 2], initial=math.inf)))

    def add_obstacle(self, index: int) -> None:
        """Add an obstacle if there is room for it."""
        for _ in range(_TRIES):
            (x, y), round_ = self._anywhere(), self._random.random() < 0.5
            radius, (a, b), yaw = (
                self._number(0.25, 0.45),
                (self._number(0.5, 1.4), self._number(0.5, 1.4)),
                self._number(0.0, math.pi),
            )
            reach = radius if round_ else math.hypot(a, b) / 2
            if self.room_m((x, y)) >= reach + _PASSAGE_M:
                self.obstacles.append(
                    Cylinder(f"pillar_{index}", x, y, radius, _HEIGHT_M)
                    if round_
                    else Box(f"box_{index}", x, y, a, b, _HEIGHT_M, yaw)
                )
                self._discs = np.vstack([self._discs, (x, y, reach)])
                return

    def place(self, what: str, accepts: Callable[[Place], bool]) -> Place:
        """Return a random place with room for a robot; raise ``InputError`` if there is none."""
        for _ in range(_TRIES):
            place = self._anywhere()
            if accepts(place) and self.room_m(place) >= _ROOM_M:
                return place
        raise InputError(
            [
                f"no room for {what} in an arena of {self._size_m:g} m; expected a "
                "larger size or fewer robots"
            ]
        )

    def next_goal(
        self, here: Place, accepts: Callable[[Place], bool] = lambda place: True
    ) -> Place:
        return self.place(
            "a goal", lambda p: _LEG_M[0] <= _distance_m(p, here) <= _LEG_M[1] and accepts(p)
        )

    def legs(self, start: Place, count: int) -> List[Place]:
        """Return goals, each within ``_LEG_M`` of the one before."""
        places = [start]
        for _ in range(count):
            places.append(self.next_goal(places[-1]))
        return places[1:]

    def _anywhere(self) -> Place:
        return self._number(0.0, self._size_m), self._number(0.0, self._size_m)

    def _number(self, low: float, high: float) -> float:
        """Return a random number, rounded to centimetres as a person would write it."""
        return round(float(self._random.uniform(low, high)), 2)


def _separate_last_goals(ground: _Ground, starts: List[Place], goals: List[List[Place]]) -> None:
    """Replace last goals that are close to each other: robots stay there."""
    last: List[Place] = []
    for start, own in zip(starts, goals):
        if not _is_apart(own[-1], last):
            here = own[-2] if len(own) > 1 else start
            own[-1] = ground.next_goal(here, lambda p: _is_apart(p, last))
        last.append(own[-1])


def _is_apart(place: Place, others: List[Place]) -> bool:
    return all(_distance_m(place, other) >= _APART_M for other in others)


def _distance_m(a: Place, b: Place) -> float:
    return math.hypot(b[0] - a[0], b[1] - a[1])


def _heading(start: Place, goal: Place) -> float:
    return round(math.atan2(goal[1] - start[1], goal[0] - start[0]), 2)
