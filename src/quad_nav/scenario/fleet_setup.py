"""Set-up of one process of a fleet, from the node's private parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Mapping

from quad_nav.config import Configuration
from quad_nav.errors import InputError
from quad_nav.files.values import unknown_names, value_faults
from quad_nav.scenario import RANDOM
from quad_nav.scenario.rules import RULES
from quad_nav.scenario.scenario import area_of, read_configurations

DEFAULTS: Dict[str, Any] = {
    "robots": 8,
    "config": "",  # folder of the navigators' YAML
    "scene": RANDOM,  # or a file
    "seed": 0,  # of a random mission, as the next
    "size": 0.0,  # the arena's side, m; 0: room for all
    "hosts": 1,  # processes that share the navigators
    "host": 0,  # which of them this is
}
_RULES = {name: RULES[name] for name in DEFAULTS}


@dataclass(frozen=True)
class FleetSetup:
    """The navigators of one process of a fleet.

    Attributes:
        configurations: Their configurations, by the robots' numbers.
    """

    configurations: Mapping[int, Configuration]


def read_setup(parameters: Mapping[str, Any], name: str) -> FleetSetup:
    """Read the navigators that one process of a fleet hosts.

    Args:
        parameters: The node's private parameters.
        name: The node's name, for messages.

    Raises:
        InputError: Every fault in the parameters and in the files of the whole fleet; no part of
            it flies if another part cannot.
    """
    values = {**DEFAULTS, **parameters}
    problems = unknown_names(parameters, DEFAULTS, name, "a parameter of the fleet")
    problems += value_faults(values, _RULES, name)
    if not problems and not values["host"] < values["hosts"] <= values["robots"]:
        problems.append(
            f"{name}: host {values['host']} of hosts {values['hosts']} for "
            f"{values['robots']} robots; expected a robot for each host"
        )
    if problems:
        raise InputError(problems)
    configurations = read_configurations(
        values["config"], values["robots"], area_of(values), numbered=True
    )
    share = range(values["host"], values["robots"], values["hosts"])
    return FleetSetup({number: configurations[number] for number in share})
