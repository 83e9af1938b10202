"""Check what a launch file would start, before it starts.

    roslaunch --dump-params quad two_quads.launch ... | python3 -m quad_nav.ros.common.preflight

The nodes check the same when they start, but the first that fails ends the launch, and the faults
that the others would have reported are lost. Exit status 0, or 2 with every fault on stderr.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping

import rospkg
import yaml

from quad_nav.errors import InputError, printable
from quad_nav.mission.summary import MissionSummary, write_json
from quad_nav.scenario import fleet_setup, mission_setup, simulator_setup
from quad_nav.scenario.mission_setup import MissionSetup
from quad_nav.scenario.robot_parameters import FAULTS

EXIT_BAD_INPUT = 2
_FLEET = re.compile(r"fleet\d*")


def parameter_tree(flat: Mapping[str, Any]) -> Dict[str, Any]:
    """Return ``{"a": {"b": 1}}`` for ``{"/a/b": 1}``."""
    tree: Dict[str, Any] = {}
    for path, value in flat.items():
        *namespaces, name = path.strip("/").split("/")
        branch = tree
        for namespace in namespaces:
            branch = branch.setdefault(namespace, {})
        branch[name] = value
    return tree


def faults(tree: Mapping[str, Any]) -> List[str]:
    """Return the faults that simulator, sequencer and fleet would report, each once."""
    result = result_path(tree.get("sequencer", {}))
    readers: Dict[str, Callable[[Mapping[str, Any], str], object]] = {
        "simulator": partial(simulator_setup.read_setup, all_parameters=tree),
        "sequencer": partial(read_mission_setup, result=result, all_parameters=tree),
    }
    fleets = sorted(name for name in tree if _FLEET.fullmatch(name))
    tree = dict(tree)
    found = _take_faults_of_files(tree)
    for name, read in {**readers, **dict.fromkeys(fleets, fleet_setup.read_setup)}.items():
        try:
            if name in tree:
                read(tree[name], name)
        except InputError as error:
            found += error.problems
    return list(dict.fromkeys(found))


def _take_faults_of_files(tree: Dict[str, Any]) -> List[str]:
    """Remove navigators whose files have faults, and return the faults.

    The parameters of such a navigator are unknown, so that no goal is checked against them.
    """
    faulty = {
        name: list(map(str, node[FAULTS]))
        for name, node in tree.items()
        if isinstance(node, Mapping) and FAULTS in node
    }
    for name in faulty:
        del tree[name]
    return [fault for found in faulty.values() for fault in found]


def result_path(parameters: Mapping[str, Any]) -> Path:
    """Return the summary's path, also for parameters that are otherwise not usable."""
    given = parameters.get("result")
    if isinstance(given, str) and given:
        return Path(given).expanduser()
    stamp = time.strftime("%Y%m%d-%H%M%S")
    return Path(rospkg.get_log_dir()) / "quad" / f"mission-{stamp}-{os.getpid()}.json"


def read_mission_setup(
    parameters: Mapping[str, Any], name: str, result: Path, all_parameters: Mapping[str, Any]
) -> MissionSetup:
    """Read the mission of a node's private parameters; journals are in ROS's home.

    Raises:
        InputError: Every fault in the parameters, the scene, the goal files and the navigators'
            parameters.
    """
    journals = Path(rospkg.get_ros_home()) / "quad"
    return mission_setup.read_setup(parameters, name, result, journals, all_parameters)


def main() -> int:
    """Check the parameters on standard input.

    Returns:
        Exit status: 0 if everything can be flown, 2 otherwise.
    """
    tree = parameter_tree(yaml.safe_load(sys.stdin) or {})
    problems = faults(tree)
    if not problems:
        return 0
    lines = "flight not started, invalid input:\n  " + "\n  ".join(problems)
    print(printable(lines, "\n"), file=sys.stderr)
    if tree.get("sequencer", {}).get("result"):
        with contextlib.suppress(OSError):  # that is one of the faults above
            write_json(
                MissionSummary((), reason="bad input", problems=tuple(problems)),
                result_path(tree["sequencer"]),
            )
    return EXIT_BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
