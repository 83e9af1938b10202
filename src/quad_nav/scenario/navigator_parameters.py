"""Load the parameters that a launch file has set for a navigator.

A launch file cannot know the size of a scene. With ``cover_scene: true`` the global costmap covers
the simulator's, see ``coverage``. Sizes in the namespace ``override``, a copy of the user's
parameters for this robot, stay.
"""

from __future__ import annotations

from copy import deepcopy
from typing import Any, Dict, List, Mapping

from quad_nav import config
from quad_nav.config import Configuration
from quad_nav.config.files import ParameterTree
from quad_nav.config.robot_tree import COMMAND_LINE
from quad_nav.errors import InputError
from quad_nav.scenario.coverage import COSTMAP, cover_area
from quad_nav.scenario.rules import RULES

COVER_SCENE, OVERRIDE = "cover_scene", "override"
_ANY_NUMBER = 0  # of the robot, which only matters to files that are named after robots


def load_navigator(
    tree: Mapping[str, Any], name: str, all_parameters: Mapping[str, Any]
) -> Configuration:
    """Load a navigator's parameters.

    Args:
        tree: The navigator's parameters.
        name: The navigator's name, for messages.
        all_parameters: The whole parameter tree, with those of ``simulator``.

    Raises:
        InputError: Every fault in the parameters; or the scene cannot be read.
    """
    parameters = {key: value for key, value in tree.items() if key not in (COVER_SCENE, OVERRIDE)}
    simulator = all_parameters.get("simulator")
    if tree.get(COVER_SCENE) is True and isinstance(simulator, Mapping):
        parameters = _sized(parameters, tree.get(OVERRIDE), simulator)
    return config.load(parameters, name)


def load_navigators(
    trees: Mapping[int, Any], all_parameters: Mapping[str, Any]
) -> Dict[int, Configuration]:
    """Load the parameters of the nodes ``move_base{i}`` by their trees on the server.

    Raises:
        InputError: Every fault in any of them.
    """
    found: Dict[int, Configuration] = {}
    problems: List[str] = []
    for number, tree in trees.items():
        try:
            found[number] = load_navigator(tree, f"/move_base{number}", all_parameters)
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return found


def _sized(
    parameters: Mapping[str, Any], override: Any, simulator: Mapping[str, Any]
) -> Dict[str, Any]:
    from quad_nav.scenario.scenario import area_of  # here: it needs more than a navigator does

    values = {"scene": "", "robots": 2, "seed": 0, "size": 0.0, **simulator}
    if any(not RULES[name].accepts(values[name]) for name in ("scene", "robots", "seed", "size")):
        return dict(parameters)  # the simulator tells what is wrong
    area = area_of(values)
    if area is None:
        return dict(parameters)
    tree = ParameterTree()
    tree.update(deepcopy(dict(parameters)))
    users = override.get(COSTMAP) if isinstance(override, Mapping) else None
    for key in users if isinstance(users, Mapping) else ():
        tree.origins[f"{COSTMAP}/{key}"] = COMMAND_LINE
    cover_area(tree, area, _ANY_NUMBER)
    return tree
