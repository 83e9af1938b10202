"""Print a robot's parameters as YAML, for roslaunch to load: see ``launch/quad.launch``.

    run_module quad_nav.scenario.robot_parameters --config default --robot 0 --robots 2

The faults of the files go to stderr, one a line, with exit status 2, which ends roslaunch. With
``QUAD_COLLECT_FAULTS`` in the environment they are printed as a parameter instead, exit status 0:
``quad_nav.ros.common.preflight`` lists them together with the faults of goals, scene and values.
roslaunch waits for this command, so it imports neither numba nor pybullet unless the scene is
random.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any, Dict, List, Optional

import yaml

from quad_nav.config.files import set_value
from quad_nav.config.notes import LEFT_OUT, MAPPED, OTHER_ROBOT
from quad_nav.config.robot_tree import RobotSource, plain_tree, robot_tree
from quad_nav.errors import InputError, printable
from quad_nav.scenario import RANDOM
from quad_nav.scenario.coverage import Bounds, cover_area, scene_bounds
from quad_nav.sim.scene_file import load_scene

COLLECT = "QUAD_COLLECT_FAULTS"
FAULTS = "files_with_faults"
"""Parameter that has the faults while they are collected."""
EXIT_BAD_INPUT = 2


def main(arguments: Optional[List[str]] = None) -> int:
    """Print the parameters of the robot that the command line names, sized to the scene.

    Returns:
        Exit status: 0, or 2 for files that cannot be read.
    """
    given = _parser().parse_args(arguments)
    source = _source(given)
    try:
        tree = robot_tree(source)
        area = _area(given)
    except InputError as error:
        if os.environ.get(COLLECT):
            print(printable(_yaml({FAULTS: error.problems}), "\n"))
            return 0
        lines = "\n  ".join(error.problems)
        print(
            printable(f"quad{given.robot}: invalid configuration:\n  {lines}", "\n"),
            file=sys.stderr,
        )
        return EXIT_BAD_INPUT
    if area is not None:
        cover_area(tree, area, source.number, source.override)
    told = [str(one) for one in tree.remarks if one.kind in (MAPPED, LEFT_OUT)]
    if told:
        set_value(tree, OTHER_ROBOT, told, "")
    print(printable(_yaml(plain_tree(tree)), "\n"))
    return 0


def _yaml(tree: Dict[str, Any]) -> str:
    text: str = yaml.safe_dump(tree, sort_keys=False)
    return text


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="robot_parameters", description=__doc__.splitlines()[0])
    parser.add_argument("--config", required=True, help="folder, or name of a shipped one")
    parser.add_argument("--robot", type=int, required=True, help="number of the robot")
    parser.add_argument("--robots", type=int, help="number of robots that fly together")
    parser.add_argument("--override", default="", help="file that is loaded last")
    parser.add_argument("--scene", default="", help="file of the scene that the costmap covers")
    parser.add_argument("--seed", type=int, default=0, help="seed of a random scene")
    parser.add_argument("--size", type=float, default=0.0, help="side of a random scene, m")
    return parser


def _area(given: argparse.Namespace) -> Optional[Bounds]:
    """Return the area of a scene file or of a random scene, None for "".

    Raises:
        InputError: The file cannot be read or has faults, or there is no such random scene. While
            faults are collected, they are left to the simulator's.
    """
    try:
        if given.scene == RANDOM:
            from quad_nav.scenario.scenario import area_of

            return area_of(vars(given))
        return scene_bounds(load_scene(given.scene)) if given.scene else None
    except InputError:
        if os.environ.get(COLLECT):
            return None
        raise


def _source(given: argparse.Namespace) -> RobotSource:
    return RobotSource(
        given.config,
        given.robot,
        given.robots,
        Path(given.override) if given.override else None,
    )


if __name__ == "__main__":
    sys.exit(main())
