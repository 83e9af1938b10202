"""Checks what a launch file would start, before anything is started.

    roslaunch --dump-params quad two_quads.launch ... | python3 -m quad_nav.ros.common.preflight

The nodes check the same when they start; here it is done without racing each other
to be the first that refuses. Exit status 0, or 2 with every fault on stderr.
"""

from __future__ import annotations

import re
import sys
from typing import Any, Dict, List, Mapping

import yaml

from quad_nav.errors import InputError
from quad_nav.mission.summary import MissionSummary, write_json
from quad_nav.ros.sequencer import setup as mission_setup
from quad_nav.scenario import fleet_setup, simulator_setup

EXIT_BAD_INPUT = 2
_FLEET = re.compile(r"fleet\d*")


def parameter_tree(flat: Mapping[str, Any]) -> Dict[str, Any]:
    """``{"/a/b": 1}`` as ``{"a": {"b": 1}}``."""
    tree: Dict[str, Any] = {}
    for path, value in flat.items():
        *namespaces, name = path.strip("/").split("/")
        branch = tree
        for namespace in namespaces:
            branch = branch.setdefault(namespace, {})
        branch[name] = value
    return tree


def faults(tree: Mapping[str, Any]) -> List[str]:
    """What simulator, sequencer and fleet would refuse, each fault once."""
    found: List[str] = []
    if "simulator" in tree:
        try:
            simulator_setup.read_setup(tree["simulator"], "simulator")
        except InputError as error:
            found += error.problems
    if "sequencer" in tree:
        result = mission_setup.result_path(tree["sequencer"])
        try:
            mission_setup.read_setup(tree["sequencer"], "sequencer", result, tree)
        except InputError as error:
            found += error.problems
    for name in sorted(name for name in tree if _FLEET.fullmatch(name)):
        try:
            fleet_setup.read_setup(tree[name], name)
        except InputError as error:
            found += error.problems
    return list(dict.fromkeys(found))


def main() -> int:
    tree = parameter_tree(yaml.safe_load(sys.stdin) or {})
    problems = faults(tree)
    if not problems:
        return 0
    print("nothing is flown:\n  " + "\n  ".join(problems), file=sys.stderr)
    if tree.get("sequencer", {}).get("result"):
        write_json(
            MissionSummary((), reason="bad input", problems=tuple(problems)),
            mission_setup.result_path(tree["sequencer"]),
        )
    return EXIT_BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
