"""The inflation layer: costs that fall with the distance to the nearest obstacle."""
from __future__ import annotations

from dataclasses import dataclass

from quad_nav.costmap.layer import LayerParams


@dataclass(frozen=True)
class InflationLayerParams(LayerParams):
    """``cost_scaling_factor`` is the decay in 1/m beyond the inscribed radius."""

    inflation_radius_m: float = 0.55
    cost_scaling_factor: float = 10.0
    inflate_unknown: bool = False
