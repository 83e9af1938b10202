"""What one sensor saw lately: points in the global frame, and for how long they count."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Optional


@dataclass(frozen=True)
class SourceParams:
    """One entry of an obstacle layer's ``observation_sources``.

    ``expected_update_period_s`` is what YAML calls ``expected_update_rate``: a
    period, 0 for "never stale". ``sensor_frame`` "" means the frame of the message.
    Ranges that are None are those of the layer.
    """

    name: str
    topic: str = ""
    sensor_frame: str = ""
    data_type: str = "PointCloud"
    observation_persistence_s: float = 0.0
    expected_update_period_s: float = 0.0
    min_obstacle_height_m: float = 0.0
    max_obstacle_height_m: float = 2.0
    obstacle_range_m: Optional[float] = None
    raytrace_range_m: Optional[float] = None
    marking: bool = True
    clearing: bool = False
    inf_is_valid: bool = False
