"""The obstacle layer: what the sensors see, marked and cleared by ray tracing."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from quad_nav.costmap.layer import LayerParams
from quad_nav.costmap.observation import SourceParams

COMBINE_OVERWRITE = 0
COMBINE_MAXIMUM = 1


@dataclass(frozen=True)
class ObstacleLayerParams(LayerParams):
    """``track_unknown_space`` None means as the costmap does. ``obstacle_range_m``
    and ``raytrace_range_m`` count for the sources that set none of their own."""

    footprint_clearing_enabled: bool = True
    max_obstacle_height_m: float = 2.0
    combination_method: int = COMBINE_MAXIMUM
    obstacle_range_m: float = 2.5
    raytrace_range_m: float = 3.0
    track_unknown_space: Optional[bool] = None
    sources: Tuple[SourceParams, ...] = ()
