"""Recovery behaviours: what the navigator runs when it is stuck.

A behaviour is started once and then stepped until it is done; it never blocks, so a goal can
be cancelled in the middle of a turn.

Reading order: ``recovery`` (the interface), ``clear_costmap``, ``rotate``, ``move_slow``.
"""

from __future__ import annotations

from quad_nav.recovery.clear_costmap import ClearCostmap, ClearCostmapParams
from quad_nav.recovery.move_slow import MoveSlowAndClear, MoveSlowAndClearParams
from quad_nav.recovery.recovery import ParameterLimit, Recovery, RecoveryContext, Step
from quad_nav.recovery.rotate import Rotate, RotateParams, TurnLimits

__all__ = [
    "ClearCostmap",
    "ClearCostmapParams",
    "MoveSlowAndClear",
    "MoveSlowAndClearParams",
    "ParameterLimit",
    "Recovery",
    "RecoveryContext",
    "Rotate",
    "RotateParams",
    "Step",
    "TurnLimits",
]
