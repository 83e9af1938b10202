"""Tables of parameters: names, defaults, ranges and descriptions of upstream ``move_base``.

Defaults, ranges, order and descriptions of what is reconfigurable are those of upstream's
dynamic_reconfigure descriptions; they win over the wiki. ``fixed`` parameters are read once, at the
start. A default is the same in the table and in the dataclass that the table fills; a test compares
them.

One module for each part: ``move_base``, ``trajectory_planner``, ``dwa_planner``,
``global_planners``, ``recoveries``, ``costmap`` and ``layers``. ``quad_nav.config.spec`` defines a
table. ``docs/parameters.md`` is generated from them.
"""

from __future__ import annotations
