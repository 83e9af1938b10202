"""Print the start poses of all robots in a scene, where amcl begins, for roslaunch to load.

    run_module quad_localization.start --scene arena.yaml --robots 2

The options are those of the simulator, which chooses the same starts. With faults in the scene or
in an option there are no poses here: the simulator tells the faults.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
from typing import List, Optional, Sequence

import yaml

from quad_nav.errors import InputError, printable
from quad_nav.files.values import value_faults
from quad_nav.geometry import Pose2D
from quad_nav.scenario.rules import RULES
from quad_nav.scenario.scenario import scene_of


def main(arguments: Optional[List[str]] = None) -> int:
    """Print ``quad0: [x, y, yaw]`` and so on; return 0."""
    parser = argparse.ArgumentParser(prog="start", description=__doc__.splitlines()[0])
    parser.add_argument("--scene", required=True, help="file, or random")
    parser.add_argument("--goals", default="", help="folder of goals, or random")
    parser.add_argument("--robots", type=int, required=True, help="number of robots")
    parser.add_argument("--seed", type=int, default=0, help="seed of a random scene")
    parser.add_argument("--size", type=float, default=0.0, help="side of a random scene, m")
    given = parser.parse_args(arguments)
    starts: Sequence[Pose2D] = ()
    rules = {name: RULES[name] for name in ("robots", "seed", "size")}
    if not value_faults(vars(given), rules, ""):
        with contextlib.suppress(InputError):
            starts = scene_of(vars(given)).starts
    rows = {f"quad{k}": [one.x_m, one.y_m, one.yaw_rad] for k, one in enumerate(starts)}
    print(printable(yaml.safe_dump(rows), "\n"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
