"""The static layer: a map made beforehand."""
from __future__ import annotations

from dataclasses import dataclass

from quad_nav.costmap.layer import LayerParams


@dataclass(frozen=True)
class StaticLayerParams(LayerParams):
    """``lethal_cost_threshold`` and ``unknown_cost_value`` are occupancies (-1..100)."""

    map_topic: str = "map"
    first_map_only: bool = False
    subscribe_to_updates: bool = False
    track_unknown_space: bool = True
    use_maximum: bool = False
    lethal_cost_threshold: int = 100
    unknown_cost_value: int = -1
    trinary_costmap: bool = True
