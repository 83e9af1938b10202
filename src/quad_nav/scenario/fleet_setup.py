"""What a fleet is: a mission for N quadcopters and the parameters of their navigators.

Simulator, sequencer and the fleet's hosts each work it out from the same few parameters, so
nobody has to wait for another one's files: the mission follows from its seed, and the
navigators' parameters from a folder.
"""

from __future__ import annotations

import difflib
import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional

from quad_nav import config
from quad_nav.config.files import set_value
from quad_nav.errors import InputError
from quad_nav.scenario.random_mission import RandomMission, random_mission
from quad_nav.sim.scene import Scene
from quad_nav.sim.scene_file import load_scene

RANDOM = "random"
_MOST_ROBOTS = 100
DEFAULTS: Dict[str, Any] = {
    "robots": 8,
    "config": "",  # folder of the navigators' YAML
    "scene": RANDOM,  # or a file
    "seed": 0,  # of a random mission, as the next
    "size": 0.0,  # the arena's side, m; 0: room for all
    "hosts": 1,  # processes that share the navigators
    "host": 0,  # which of them this is
}


@dataclass(frozen=True)
class FleetSetup:
    """The navigators that one process hosts, by the robots' numbers."""

    configurations: Mapping[int, config.Configuration]


def read_setup(parameters: Mapping[str, Any], name: str) -> FleetSetup:
    """The part of a fleet that a node's private parameters describe.

    Raises:
        InputError: every fault in the parameters and in the files of the whole fleet: no
            part of it is to fly when another one cannot.
    """
    values = {**DEFAULTS, **parameters}
    problems = [_unknown(key, name) for key in parameters if key not in DEFAULTS]
    problems += _faults(values, name)
    if problems:
        raise InputError(problems)
    everybody = configurations(values["config"], values["robots"], mission_of(values))
    return FleetSetup(
        {
            number: one
            for number, one in enumerate(everybody)
            if number % values["hosts"] == values["host"]
        }
    )


def mission_of(values: Mapping[str, Any]) -> Optional[RandomMission]:
    """The random mission that parameters ask for by their ``scene``; None for a file."""
    if values["scene"] != RANDOM:
        return None
    return _mission(values["robots"], values["seed"], float(values["size"]))


def scene_of(values: Mapping[str, Any]) -> Scene:
    """The scene that parameters ask for.

    Raises:
        InputError: the file cannot be read, or an arena of that size is too small.
    """
    mission = mission_of(values)
    return load_scene(values["scene"]) if mission is None else mission.scene


def configurations(
    folder: str, robots: int, mission: Optional[RandomMission]
) -> List[config.Configuration]:
    """Every navigator's, from a folder's files; global costmaps hold a random arena.

    Raises:
        InputError: every fault in any robot's files, once for all that share the file.
    """
    made: List[config.Configuration] = []
    problems: List[str] = []
    for number in range(robots):
        try:
            tree = config.load_files(Path(folder).expanduser(), {"i": str(number)})
            for path, value in _given(number, robots, mission).items():
                set_value(tree, path, value, "the fleet")
            made.append(config.load(tree))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    return made


def _given(number: int, robots: int, mission: Optional[RandomMission]) -> Dict[str, Any]:
    given: Dict[str, Any] = {"robot": number, "robots": robots}
    if mission is not None:
        given.update(
            {
                "global_costmap/width": mission.scene.size_x_m,
                "global_costmap/height": mission.scene.size_y_m,
            }
        )
    return given


@functools.lru_cache(maxsize=1)
def _mission(robots: int, seed: int, size_m: float) -> RandomMission:
    return random_mission(robots, seed, size_m)


def _faults(values: Mapping[str, Any], name: str) -> List[str]:
    rules = {
        "robots": (
            lambda v: _is_whole(v) and 1 <= v <= _MOST_ROBOTS,
            f"a whole number, 1 to {_MOST_ROBOTS}",
        ),
        "config": (lambda v: isinstance(v, str) and v != "", "a folder of YAML files"),
        "scene": (lambda v: isinstance(v, str) and v != "", f"a scene file, or {RANDOM}"),
        **MISSION_RULES,
        "hosts": (lambda v: _is_whole(v) and v >= 1, "a whole number, 1 or more"),
        "host": (lambda v: _is_whole(v) and 0 <= v, "a whole number below hosts"),
    }
    problems = [
        f"{name}: {key}: is {values[key]!r}, expected {expected}"
        for key, (accepts, expected) in rules.items()
        if not accepts(values[key])
    ]
    if not problems and not values["host"] < values["hosts"] <= values["robots"]:
        problems.append(
            f"{name}: host {values['host']} of hosts {values['hosts']} for "
            f"{values['robots']} robots, expected a robot for each host"
        )
    return problems


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_amount(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and 0 <= value < 1e4


MISSION_RULES = {
    "seed": (lambda v: _is_whole(v) and v >= 0, "a whole number, 0 or more"),
    "size": (_is_amount, "a number of metres, 0 for room for all"),
}


def _unknown(key: str, name: str) -> str:
    near = difflib.get_close_matches(key, list(DEFAULTS), n=1) or [f"one of {', '.join(DEFAULTS)}"]
    return f"{name}: {key}: is not a parameter of the fleet, expected {near[0]}"
