"""Which robot a node `move_base` flies, where its launch file does not say so.

A launch file in the tutorial's form sets no parameter of ours. The robot's number is in the names
of its node, its frames or its topics; its peers are found on the graph, see `peer_topics`.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any, Dict, Iterable, List, Mapping, Optional

import rospy

from quad_nav.config import Configuration

MAX_ROBOTS = 100
"""Robots have numbers of one or two digits; longer ones are those of anonymous nodes."""
_NUMBER = re.compile(r"(?<!\d)\d{1,2}$")


def identified(configuration: Configuration, given: Mapping[str, Any]) -> Configuration:
    """Return the configuration with the robot's number, and warn if its names leave it open.

    Args:
        configuration: The configuration.
        given: The parameters of the node; a `robot` among them always counts.
    """
    number, names = configuration.robot, _names(configuration)
    if "robot" not in given:
        numbers = numbers_of(names)
        number = next(iter(numbers.values()), number)
        if len(set(numbers.values())) != 1:
            told = "; ".join(
                f"{numbers.get(source, 'none')} in its {source} ({', '.join(sorted(set(found)))})"
                for source, found in names.items()
            )
            problem = "CONTRADICTORY" if numbers else "UNKNOWN"
            _warn(f"THE NUMBER OF THIS ROBOT IS {problem}: {told}", number)
    robots = configuration.robots
    if 0 < robots <= number:
        _warn(f"IT IS ROBOT {number} OF {robots}, but the numbers start at 0", number)
        robots = 0
    return replace(configuration, robot=number, robots=robots)


def number_in(name: str) -> Optional[int]:
    """Return the number at the end of a name, or else of the innermost namespace that has one.

    ``move_base1``, ``/robot1/move_base`` and ``robot_1/base_link`` have the number 1.
    """
    for part in reversed(name.split("/")):
        found = _NUMBER.search(part)
        if found:
            return int(found.group())
    return None


def numbers_of(sources: Mapping[str, Iterable[str]]) -> Dict[str, int]:
    """Return the number of each source whose names have one and agree on it.

    Args:
        sources: Names by what they are names of.
    """
    numbers = {}
    for source, names in sources.items():
        found = {number_in(name) for name in names} - {None}
        if len(found) == 1:
            numbers[source] = found.pop()
    return {source: number for source, number in numbers.items() if number is not None}


def _warn(problem: str, number: int) -> None:
    rospy.logwarn(
        "%s: %s. It flies as quad%d. ROBOTS DO NOT AVOID EACH OTHER if they have the same number or"
        " do not know each other's. Add two lines to its <node>: its number, from 0 on, and the"
        ' number of all robots:\n  <param name="robot" value="%d" />\n'
        '  <param name="robots" value="%d" />',
        rospy.get_name().lstrip("/"),
        problem,
        number,
        number,
        max(number + 1, 2),
    )


def _names(configuration: Configuration) -> Dict[str, List[str]]:
    """Return the names that may have the robot's number, those that count most first."""
    costmaps, odom = configuration.costmaps.values(), configuration.odom_topic
    sensors = [
        source.topic or source.name
        for costmap in costmaps
        for _, layer in costmap.layers
        for source in getattr(layer, "sources", ())
    ]
    return {
        "node's name": [rospy.get_name()],
        "frames": [costmap.robot_base_frame for costmap in costmaps],
        "topics": [rospy.resolve_name(name) for name in (odom, "cmd_vel", *sensors)],
    }
