"""move_base's parameters: the only place that knows how ROS spells them.

    tree = load_files("config/tutorial", {"i": "0"})   # or rospy.get_param("~")
    configuration = load(tree, "/move_base0")          # InputError names every fault
    configuration.local_costmap.resolution_m           # dataclasses of the core
    configuration.remarks                              # what is odd, unknown or unsupported
    updated(configuration, "TrajectoryPlannerROS", {"max_vel_x": 0.5})

Read ``spec`` (what a parameter is), ``tables`` and ``costmap_tables`` (which there
are), ``reader`` (how a namespace is checked), ``costmaps``, ``layers``,
``planners`` and ``recoveries`` (what move_base makes of each), ``configuration``
(the whole), ``reconfiguration`` (changes in flight) and ``files`` (YAML).
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
