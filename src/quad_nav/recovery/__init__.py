"""What the navigator tries when it is stuck: forget obstacles, look around, go slowly.

A recovery is started once and then stepped in every cycle until it says that it
is done; it never blocks, so a goal can be cancelled in the middle of a turn.
"""

from __future__ import annotations

from quad_nav.recovery.clear_costmap import ClearCostmap, ClearCostmapParams
from quad_nav.recovery.move_slow import MoveSlowAndClear, MoveSlowAndClearParams
from quad_nav.recovery.recovery import ParameterLimit, Recovery, RecoveryContext, Step
from quad_nav.recovery.rotate import FootprintCost, Rotate, RotateParams

__all__ = [
    "ClearCostmap",
    "ClearCostmapParams",
    "FootprintCost",
    "MoveSlowAndClear",
    "MoveSlowAndClearParams",
    "Recovery",
    "Rotate",
    "RotateParams",
    "ParameterLimit",
    "Step",
    "RecoveryContext",
]
