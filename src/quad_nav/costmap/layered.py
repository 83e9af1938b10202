"""The layered costmap: layers write into one master grid, in order."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layer import LayerParams
from quad_nav.costmap.obstacle import ObstacleLayerParams

NamedLayers = Tuple[Tuple[str, LayerParams], ...]


@dataclass(frozen=True)
class CostmapParams:
    """One costmap: ``global_costmap`` or ``local_costmap``.

    ``footprint`` is unpadded, in the robot's frame; None means a circle of
    ``robot_radius_m``. ``layers`` are (name, parameters) in the order of updates.
    """

    global_frame: str = "map"
    robot_base_frame: str = "base_link"
    update_frequency_hz: float = 5.0
    publish_frequency_hz: float = 0.0
    width_m: float = 10.0
    height_m: float = 10.0
    resolution_m: float = 0.05
    origin_x_m: float = 0.0
    origin_y_m: float = 0.0
    rolling_window: bool = False
    track_unknown_space: bool = False
    always_send_full_costmap: bool = False
    footprint: Optional[Tuple[Tuple[float, float], ...]] = None
    robot_radius_m: float = 0.46
    footprint_padding_m: float = 0.01
    transform_tolerance_s: float = 0.3
    layers: NamedLayers = (("obstacle_layer", ObstacleLayerParams()),
                           ("inflation_layer", InflationLayerParams()))
