"""move_base's YAML tree to dataclasses of the core, checked and complete.

    tree = load_files("config/tutorial", {"i": "0"})   # or rospy.get_param("~")
    configuration = load(tree, "/move_base0")          # InputError lists every fault
    configuration.local_costmap.resolution_m           # dataclasses of the core
    configuration.remarks                              # unknown, unsupported and odd parameters
    updated(configuration, "TrajectoryPlannerROS", {"max_vel_x": 0.5})

Parameters are declared in the dataclasses of their owners, see ``quad_nav.parameter``. Reading
order: ``reader`` (the parameters of a namespace, and its check), ``costmaps``,
``layers``, ``planners``, ``filters``, ``recoveries`` and ``fixes`` (namespaces to
dataclasses), ``configuration`` (the whole), ``reconfiguration`` (changes in flight), ``files``,
``file_sets`` and ``robot_tree`` (YAML), ``check`` (the report of ``quad check``), ``plugins``
(classes of users), ``reference`` (generates ``docs/parameters.md``).

The names above are imported when they are first used: ``load`` needs numba, reading files does not.
"""

from __future__ import annotations

import importlib
from typing import Any

_MODULES = {
    "Configuration": "configuration",
    "Remark": "notes",
    "load": "configuration",
    "load_files": "files",
    "reconfigurable": "reconfiguration",
    "updated": "reconfiguration",
    "values": "reconfiguration",
}

__all__ = [*_MODULES]


def __getattr__(name: str) -> Any:
    """Import a name from its module; ``__init__.pyi`` has the types."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)
