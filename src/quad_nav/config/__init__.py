"""move_base's YAML tree to parameters of the core; the only package with ROS spellings.

    tree = load_files("config/tutorial", {"i": "0"})   # or rospy.get_param("~")
    configuration = load(tree, "/move_base0")          # InputError lists every fault
    configuration.local_costmap.resolution_m           # dataclasses of the core
    configuration.remarks                              # unknown, unsupported and odd parameters
    updated(configuration, "TrajectoryPlannerROS", {"max_vel_x": 0.5})

Reading order: ``spec`` (parameters and tables), ``tables`` (the tables), ``reader`` (check of a
namespace), ``costmaps``, ``layers``, ``planners``, ``local_planners``, ``recoveries`` and ``fixes``
(namespaces to dataclasses), ``configuration`` (the whole), ``reconfiguration`` (changes in flight),
``files`` and ``file_sets`` (YAML), ``check`` (the report of ``quad check``), ``plugins`` (classes
of users), ``reference`` (generates ``docs/parameters.md``).
"""

from __future__ import annotations

from quad_nav.config.configuration import Configuration, load
from quad_nav.config.files import load_files
from quad_nav.config.notes import Remark
from quad_nav.config.reconfiguration import reconfigurable, updated, values
from quad_nav.config.spec import Parameter

__all__ = [
    "Configuration",
    "Parameter",
    "Remark",
    "load",
    "load_files",
    "reconfigurable",
    "updated",
    "values",
]
