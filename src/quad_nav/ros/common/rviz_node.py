"""Node `fleet_rviz`: RViz with a configuration for the number of quadcopters."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import rospkg
import yaml

from quad_nav.errors import InputError, printable
from quad_nav.files.output import reason, write_text
from quad_nav.scenario.scenario import scene_of
from quad_nav.topics.rviz_file import EXIT_BAD_INPUT, arguments, document

EXIT_FAILURE = 1


def main() -> int:
    """Write the configuration to the ROS log folder and replace this process by RViz.

    Returns:
        2 if the arguments are not valid, 1 if the file cannot be written; otherwise RViz's exit
        status is the process's own.
    """
    given, others = arguments(sys.argv[1:])
    try:
        content = document(given.robots, scene_of(vars(given)))
    except InputError as error:
        print(printable(error, "\n"), file=sys.stderr)
        return EXIT_BAD_INPUT
    path = Path(rospkg.get_log_dir()) / "quad" / f"fleet-{os.getpid()}.rviz"
    try:
        write_text(path, yaml.safe_dump(content, sort_keys=False))
    except OSError as error:
        message = f"fleet_rviz: {path}: cannot be written: {reason(error)}"
        print(printable(message), file=sys.stderr)
        return EXIT_FAILURE
    os.execvp("rviz", ["rviz", "-d", str(path), *others])
