"""Read a scenario: scene, goals and configurations, with every fault listed at once.

Both shells read their scenarios here, so that both refuse the same ones. Simulator, sequencer
and the processes of a fleet each read it from the same few parameters: a random mission follows
from its seed, so that no node waits for another one's files.
"""

from __future__ import annotations

import contextlib
import functools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, TypeVar

from quad_nav import config
from quad_nav.config import Configuration
from quad_nav.config.cautions import body_caution
from quad_nav.config.notes import without_effect
from quad_nav.config.robot_tree import RobotSource, robot_tree
from quad_nav.errors import InputError
from quad_nav.files.values import optional, value_faults
from quad_nav.mission.goal_file import DEFAULT_SETTINGS, SequenceSettings, load_goals
from quad_nav.mission.robot_goals import (
    GoalSource,
    RobotGoals,
    goal_paths,
    last_goal_conflicts,
    load_robot_goals,
)
from quad_nav.scenario import RANDOM
from quad_nav.scenario.coverage import Bounds, cover_area, scene_bounds
from quad_nav.scenario.goal_checks import (
    OFF_COSTMAP,
    cover_warnings,
    coverage_notes,
    file_warnings,
    goals_off_the_costmap,
    map_warnings,
    place_check,
    with_planner_tolerance,
)
from quad_nav.scenario.random_mission import RandomMission, random_mission
from quad_nav.scenario.rules import RULES
from quad_nav.sim.scene import BODY_RADIUS_M, Scene
from quad_nav.sim.scene_file import load_scene

T = TypeVar("T")
_REQUEST_RULES = {
    "scene": optional(RULES["scene"]),
    **{name: RULES[name] for name in ("goals", "robots", "seed", "size", "robot_radius")},
}
_HARMLESS: Dict[str, Any] = {
    "scene": "",
    "goals": None,
    "robots": 0,
    "seed": 0,
    "size": 0.0,
    "robot_radius": BODY_RADIUS_M,
}
Parameters = Sequence[Tuple[str, Any]]
"""Parameters on top of files: (path, value), as ("global_costmap/width", 60.0)."""
Configure = Callable[[int, Optional[Scene]], Sequence[Optional[Configuration]]]
"""Reads the configurations of so many robots, whose global costmaps are to cover a scene.

None stands for a robot whose parameters are unknown.
"""


@dataclass(frozen=True)
class ScenarioRequest:
    """Sources of scene and goals; values as the user gave them, not yet checked.

    ``scene`` is a file, ``RANDOM``, or "" if the arena is unknown. ``goals`` is a folder, a file, a
    list of files, or ``RANDOM``. ``seed`` and ``size`` are those of a random mission; size 0 has
    room for all. ``simulated`` robots have exact odometry, so that every frame of a costmap is
    ``map``; in other frames of real robots, and of simulated ones whose odometry drifts, a
    costmap's place is unknown. ``source`` is the request's name in messages.
    """

    scene: Any
    goals: Any
    robots: Any
    seed: Any = 0
    size: Any = 0.0
    robot_radius: Any = BODY_RADIUS_M
    settings: SequenceSettings = DEFAULT_SETTINGS
    simulated: bool = True
    source: str = ""


@dataclass(frozen=True)
class Scenario:
    """The readable parts of a scenario; complete if there were no faults.

    ``notes`` tell what the user did not ask for, ``warnings`` what may be a mistake.
    """

    scene: Optional[Scene]
    robots: Tuple[RobotGoals, ...] = ()
    configurations: Tuple[Optional[Configuration], ...] = ()
    warnings: Tuple[str, ...] = ()
    robot_radius_m: float = BODY_RADIUS_M
    notes: Tuple[str, ...] = ()


def read_scenario(request: ScenarioRequest, configure: Configure) -> Tuple[Scenario, List[str]]:
    """Read and check scene, configurations and goals.

    Args:
        request: Where they come from.
        configure: Reads the configurations; raises ``InputError`` with every fault in them.

    Returns:
        The scenario as far as it could be read, and every fault in it, each once.
    """
    problems = value_faults(vars(request), _REQUEST_RULES, request.source)
    request = _without_faulty_values(request)
    values = vars(request)
    mission, scene = tried(lambda: (mission_of(values), _scene(values)), problems) or (None, None)
    configurations = tried(lambda: tuple(configure(request.robots, scene)), problems) or ()
    if configurations:
        radius = body_radius_m(configurations, request.robot_radius)
        request = replace(request, robot_radius=radius)
    located = [one if _is_located(one, request.simulated) else None for one in configurations]
    if values["scene"] and scene is None:
        located = []  # an unreadable scene may be what gives the costmaps their size
    if request.goals == RANDOM:
        robots, faults = _random_goals(request, mission, located)
    else:
        robots, faults = _read_goals(request, scene, located, configurations)
    small = cover_warnings(scene, located, bool(request.source)) if scene else []
    if any(OFF_COSTMAP in fault for fault in faults):
        faults += small
    warnings = (
        *last_goal_conflicts(robots, request.robot_radius),
        *file_warnings(robots, configurations),
        *small,
        *(map_warnings(scene, configurations, bool(request.source)) if scene else ()),
        *_body_cautions(configurations, float(request.robot_radius)),
    )
    read_as = (f"{one.file.path}: {one.sequence.read_as}" for one in robots if one.sequence.read_as)
    notes = (*coverage_notes(configurations), *read_as)
    radius_m = float(request.robot_radius)
    scenario = Scenario(scene, tuple(robots), configurations, warnings, radius_m, notes)
    return scenario, list(dict.fromkeys(problems + faults))


def _body_cautions(configurations: Sequence[Optional[Configuration]], body_m: float) -> List[str]:
    """Return a line on each robot whose footprint is smaller than its body."""
    return [
        f"quad{number}: {place}: {text}"
        for number, one in enumerate(configurations)
        for place, text in (body_caution(one.local_costmap, body_m) if one else ())
    ]


def body_radius_m(configurations: Sequence[Optional[Configuration]], own_m: float) -> float:
    """Return the radius of the simulated bodies, the largest that the configurations ask for.

    ``own_m`` is that of a quadcopter without ``body_radius``.
    """
    radii = [one.body_radius_m if one else None for one in configurations]
    return max((own_m if one is None else one for one in radii), default=own_m)


def mission_of(values: Mapping[str, Any]) -> Optional[RandomMission]:
    """Return the random mission of ``robots``, ``seed`` and ``size`` if ``scene`` is ``RANDOM``.

    Raises:
        InputError: An arena of that size has no room for so many robots.
    """
    if values["scene"] != RANDOM:
        return None
    return _cached_mission(values["robots"], values["seed"], float(values["size"]))


def scene_of(values: Mapping[str, Any]) -> Scene:
    """Return the scene of a file, or of the random mission, that ``scene`` asks for.

    Starts that the file does not give are chosen where the robots can reach their ``goals``.

    Raises:
        InputError: The file cannot be read or has faults, or a random arena is too small.
    """
    mission = mission_of(values)
    return mission.scene if mission else load_scene(values["scene"], _first_goals(values))


def _first_goals(values: Mapping[str, Any]) -> List[Optional[Tuple[float, float]]]:
    """Return the place of each robot's first goal, None if no file that can be read has it."""
    goals = {}
    files, _ = _goal_files(values.get("goals"), values.get("robots"))
    for number, (path, robot) in files.items():
        with contextlib.suppress(InputError):  # its faults are told when the mission is read
            for first in load_goals(path, robot=robot).goals[:1]:
                goals[number] = (first.x_m, first.y_m)
    return [goals.get(number) for number in range(max(goals, default=-1) + 1)]


def area_of(values: Mapping[str, Any]) -> Optional[Bounds]:
    """Return the area of the scene that ``scene`` asks for, None if it is unknown.

    Raises:
        InputError: The file cannot be read or has faults, or a random arena is too small.
    """
    return scene_bounds(scene_of(values)) if values["scene"] else None


def read_configurations(
    name: str,
    robots: int,
    area: Optional[Bounds] = None,
    parameters: Parameters = (),
    check: Callable[[Configuration, int], List[str]] = lambda *_: [],
    numbered: bool = False,
    strict: bool = True,
) -> List[Configuration]:
    """Read every robot's configuration.

    Args:
        name: A shipped configuration, a folder or files, see ``config.sources``.
        robots: Number of robots.
        area: Area that the global costmaps cover.
        parameters: Parameters on top of the files, from the command line.
        check: Returns further faults of a robot's configuration.
        numbered: Set the parameters ``robot`` and ``robots``, as the launch files do.
        strict: Refuse ``parameters`` that have no effect.

    Raises:
        InputError: Every fault in any robot's files; a fault in a shared file is listed once.
    """
    configurations: List[Configuration] = []
    problems: List[str] = []
    for number in range(robots):
        source = RobotSource(name, number, robots if numbered else None, parameters=parameters)
        try:
            configuration = _read_configuration(source, area)
        except InputError as error:
            problems += error.problems
            continue
        problems += check(configuration, number)
        if strict:
            paths = [path for path, _ in parameters]
            problems += without_effect(configuration.remarks, paths, name)
        configurations.append(configuration)
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    return configurations


def _read_configuration(source: RobotSource, area: Optional[Bounds]) -> Configuration:
    """Read a robot's parameters, with a global costmap that covers an area."""
    tree = robot_tree(source)
    if area is not None:
        cover_area(tree, area, source.number)
    return config.load(tree)


def _without_faulty_values(request: ScenarioRequest) -> ScenarioRequest:
    """Replace values that their rules refuse, so that the faults in files are found, too.

    A random mission is left out if one of its values is faulty.
    """
    values = vars(request)
    faulty = {name for name, rule in _REQUEST_RULES.items() if not rule.accepts(values[name])}
    if request.scene == RANDOM and faulty & {"robots", "seed", "size"}:
        faulty |= {"scene", "goals"} if request.goals == RANDOM else {"scene"}
    return replace(request, **{name: _HARMLESS[name] for name in faulty})


def _scene(values: Mapping[str, Any]) -> Optional[Scene]:
    return scene_of(values) if values["scene"] else None


@functools.lru_cache(maxsize=1)
def _cached_mission(robots: int, seed: int, size_m: float) -> RandomMission:
    return random_mission(robots, seed, size_m)


def _is_located(configuration: Optional[Configuration], simulated: bool) -> bool:
    """True if the place of the global costmap in the map is known."""
    if configuration is None or simulated:
        return configuration is not None
    return configuration.global_costmap.global_frame.lstrip("/") == "map"


def _random_goals(
    request: ScenarioRequest,
    mission: Optional[RandomMission],
    configurations: Sequence[Optional[Configuration]],
) -> Tuple[List[RobotGoals], List[str]]:
    if request.scene != RANDOM:
        place = f"{request.source}: goals" if request.source else "goals"
        return [], [
            f"{place}: {RANDOM} with scene {request.scene!r}; expected a folder of goal files, "
            f"or scene {RANDOM}"
        ]
    if mission is None:
        return [], []
    robots = mission.robot_goals(request.settings)
    return robots, goals_off_the_costmap(robots, configurations)


def _read_goals(
    request: ScenarioRequest,
    scene: Optional[Scene],
    located: Sequence[Optional[Configuration]],
    configurations: Sequence[Optional[Configuration]],
) -> Tuple[List[RobotGoals], List[str]]:
    paths, missing = _goal_files(request.goals, request.robots, request.source)
    known, placed = dict(enumerate(configurations)), dict(enumerate(located))
    checks = {
        number: place_check(scene, request.robot_radius, placed.get(number)) for number in paths
    }
    settings = {
        number: with_planner_tolerance(request.settings, known.get(number)) for number in paths
    }
    robots, faults = load_robot_goals(paths, checks, settings)
    return robots, missing + faults


def _goal_files(
    goals: Any, count: Any, source: str = ""
) -> Tuple[Dict[int, GoalSource], List[str]]:
    """Return the existing goal files, by the robots' numbers, and a fault for those missing."""
    if not goals or not count:
        return {}, []
    if isinstance(goals, str):
        return goal_paths(Path(goals).expanduser(), count)
    problems = []
    if len(goals) != count:
        place = f"{source}: goals" if source else "goals"
        problems = [f"{place}: lists {len(goals)} files; expected one for each of {count} robots"]
    return {k: GoalSource(Path(path).expanduser()) for k, path in enumerate(goals)}, problems


def tried(read: Callable[[], T], problems: List[str]) -> Optional[T]:
    """Return what ``read`` returns, or None with its faults added to ``problems``."""
    try:
        return read()
    except InputError as error:
        problems += error.problems
        return None
