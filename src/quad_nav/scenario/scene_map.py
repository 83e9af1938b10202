"""Map of a scene at the flying altitude, for static layers offline."""

from __future__ import annotations

import math
from typing import Dict

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.layered import CostmapParams, LayeredCostmap
from quad_nav.costmap.static import StaticLayer, StaticLayerParams, StaticMap
from quad_nav.files.values import memory_problem
from quad_nav.grid import GridSpec
from quad_nav.sim.scene import Scene
from quad_nav.sim.scene_cells import touched_cells


class SceneMaps:
    """Maps of a scene; makes one for each resolution when it is first needed."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._maps: Dict[float, StaticMap] = {}

    def set_map_of(self, costmap: LayeredCostmap) -> None:
        """Set the map of a costmap with static layers."""
        if not any(isinstance(layer, StaticLayer) for layer in costmap.layers.values()):
            return
        resolution_m = costmap.params.resolution_m
        if resolution_m not in self._maps:
            self._maps[resolution_m] = scene_map(self._scene, resolution_m)
        costmap.set_map(self._maps[resolution_m])


def scene_map_problem(scene: Scene, params: CostmapParams) -> str:
    """Return the reason why a costmap with static layers cannot hold the scene, or ""."""
    if not any(isinstance(layer, StaticLayerParams) for _, layer in params.layers):
        return ""
    margin_m = 2 * scene.walls.thickness_m
    return memory_problem(
        math.ceil((scene.size_x_m + margin_m) / params.resolution_m),
        math.ceil((scene.size_y_m + margin_m) / params.resolution_m),
        "cells of the scene's map",
        3 if params.rolling_window else params.bytes_per_cell,
        "a smaller scene, a larger resolution, or no static layer",
    )


def scene_map(scene: Scene, resolution_m: float) -> StaticMap:
    """Map a scene up to the outer faces of its walls.

    A cell is occupied if its centre is in a wall or an obstacle that a hull in flight can touch.
    """
    margin_m = scene.walls.thickness_m
    low_x, low_y = scene.origin_x_m - margin_m, scene.origin_y_m - margin_m
    spec = GridSpec(
        math.ceil((scene.size_x_m + 2 * margin_m) / resolution_m),
        math.ceil((scene.size_y_m + 2 * margin_m) / resolution_m),
        resolution_m,
        low_x,
        low_y,
    )
    return StaticMap(scene_occupancy(scene, spec), spec)


def scene_occupancy(scene: Scene, spec: GridSpec, margin_m: float = 0.0) -> NDArray[np.int8]:
    """Return the occupancy of a grid in ``map``, int8[H, W].

    It is 100 for the cells of ``touched_cells``, else 0.
    """
    return np.where(touched_cells(scene, spec, margin_m), np.int8(100), np.int8(0))
