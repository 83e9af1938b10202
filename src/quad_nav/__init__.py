"""Fleets of LIDAR quadcopters on the ROS navigation stack.

The project is one loop. A quadcopter's LIDAR scan marks obstacles in its costmaps; the global
planner plans a path over the costmap to the goal; the local planner computes a velocity that
follows the path; the body moves; and the LIDAR scans again. The loop is plain Python without
ROS and takes the time as an argument. ``offline`` runs it in one process on a virtual clock;
``ros`` cuts it at the topics.

Reading order:

1. ``geometry``, ``grid``, ``footprint``: poses, cells, hulls.
2. ``costmap``, ``plan``, ``control``: scan to costs, costs to path, path to velocity.
3. ``recovery``, ``peers``: robots that are stuck, and robots that meet.
4. ``navigator``: move_base's state machine, which calls all of these.
5. ``sim``: velocity to motion, pose to scan.
6. ``mission``: goal files, the sequencer, contacts, the summary.
7. ``config``, ``scenario``: move_base's YAML to parameters; scene, goals and configuration to a
   checked set-up. ``files`` reads what users give.
8. ``offline``, ``topics``, ``ros``: the two shells, and the contents of the topics.
9. ``recording``, ``report``, ``cli``, ``api``: what is built on flights.

``docs/architecture.md`` has the walk from ``tick`` to the command, and a picture of the packages.
"""

from __future__ import annotations

import importlib
from typing import Any, List

from quad_nav.versions import package_version

__version__ = package_version()

# The names of ``quad_nav.api``, loaded at their first use: importing the package must stay fast.
# ``__init__.pyi`` lists them with their types.
_API = (
    "TRAJECTORY_COLUMNS",
    "Box",
    "Command",
    "Configuration",
    "Contact",
    "Cylinder",
    "Flight",
    "FlightObserver",
    "FlightResult",
    "FlightSetup",
    "Goal",
    "GoalSequence",
    "InputError",
    "MissionSummary",
    "Observation",
    "Pose2D",
    "Scan",
    "Scene",
    "SequenceSettings",
    "Sphere",
    "Walls",
    "fly",
    "lidar_simulation",
    "load_configuration",
    "load_goals",
    "load_scene",
    "prepare",
)


def __getattr__(name: str) -> Any:
    if name not in _API:
        raise AttributeError(f"module 'quad_nav' has no attribute {name!r}")
    value = globals()[name] = getattr(importlib.import_module("quad_nav.api"), name)
    return value


def __dir__() -> List[str]:
    return sorted([*globals(), *_API])
