"""Folders that a mission's set-up takes from ROS: the log folder and ROS's home.

``quad_nav.scenario.mission_setup`` reads and checks the set-up itself.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any, Mapping

import rospkg

from quad_nav.scenario import mission_setup
from quad_nav.scenario.mission_setup import MissionSetup


def result_path(parameters: Mapping[str, Any]) -> Path:
    """Return the summary's path, also for parameters that are otherwise not usable."""
    given = parameters.get("result")
    if isinstance(given, str) and given:
        return Path(given).expanduser()
    stamp = time.strftime("%Y%m%d-%H%M%S")
    return Path(rospkg.get_log_dir()) / "quad" / f"mission-{stamp}-{os.getpid()}.json"


def read_setup(
    parameters: Mapping[str, Any], name: str, result: Path, all_parameters: Mapping[str, Any]
) -> MissionSetup:
    """Read the mission of a node's private parameters; see ``mission_setup.read_setup``.

    Raises:
        InputError: Every fault in the parameters, the scene, the goal files and the navigators'
            parameters.
    """
    journals = Path(rospkg.get_ros_home()) / "quad"
    return mission_setup.read_setup(parameters, name, result, journals, all_parameters)
