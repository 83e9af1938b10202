"""Node `fleet_rviz`: RViz with a configuration for the number of quadcopters."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import rospkg
import yaml

from quad_nav.errors import InputError, printable
from quad_nav.scenario.scenario import scene_of
from quad_nav.topics.rviz_file import EXIT_BAD_INPUT, arguments, document


def main() -> int:
    """Write the configuration to the ROS log folder and replace this process by RViz.

    Returns:
        2 if the arguments are not valid; otherwise RViz's exit status is the process's own.
    """
    given, others = arguments(sys.argv[1:])
    try:
        content = document(given.robots, scene_of(vars(given)))
    except InputError as error:
        print(printable(error, "\n"), file=sys.stderr)
        return EXIT_BAD_INPUT
    path = Path(rospkg.get_log_dir()) / "quad" / f"fleet-{os.getpid()}.rviz"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    os.execvp("rviz", ["rviz", "-d", str(path), *others])
