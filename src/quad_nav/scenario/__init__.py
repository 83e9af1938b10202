"""Scene, goals and configurations -> a checked set-up, for both shells.

``scenario`` reads them and lists every fault at once; ``rules`` has the rules for single values,
``goal_checks`` those for goals. Four thin readers translate what a shell is given: ``flight_setup``
(offline flights), ``simulator_setup``, ``mission_setup`` and ``fleet_setup`` (private parameters
of the ROS nodes). ``random_mission`` makes scenes and goals, ``scene_map`` the map of a scene,
``assembly`` a navigator, and ``warm_up`` compiles the kernels.
"""

from __future__ import annotations

RANDOM = "random"
"""Value of ``scene`` and ``goals`` that asks for a random mission."""
