"""Whether the navigators' global costmaps hold the arena that they are to fly in."""

from __future__ import annotations

from typing import List, Mapping

from quad_nav.config import Configuration
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.scenario.scene_check import arena_text
from quad_nav.sim.scene import Scene


def uncovered(scene: Scene, navigators: Mapping[str, Configuration]) -> List[str]:
    """Global costmaps that neither follow the robot nor a map and end within the arena.

    No fault: the mission may well stay in the part that is covered.
    """
    warnings = []
    for name, navigator in navigators.items():
        params = navigator.global_costmap
        has_map = any(isinstance(layer, StaticLayerParams) for _, layer in params.layers)
        x, y, slack_m = params.origin_x_m, params.origin_y_m, params.resolution_m
        if (
            params.rolling_window
            or has_map
            or (
                x <= scene.origin_x_m + slack_m
                and x + params.width_m >= scene.end_x_m - slack_m
                and y <= scene.origin_y_m + slack_m
                and y + params.height_m >= scene.end_y_m - slack_m
            )
        ):
            continue
        warnings.append(
            f"/{name}: global_costmap covers {_span('x', x, params.width_m)}, "
            f"{_span('y', y, params.height_m)}, but the arena is {arena_text(scene)}: there are no "
            "plans beyond the costmap; expected origin_x, origin_y, width and height to hold it"
        )
    return warnings


def _span(axis: str, start_m: float, length_m: float) -> str:
    return f"{axis} {start_m:g} to {start_m + length_m:g} m"
