"""Cautions on values that are legal one by one, and together let a robot touch what it could see.

Upstream says nothing of them. Nav2 logs an error for an inflation radius below the inscribed one.
"""

from __future__ import annotations

import math
from typing import Iterator, Mapping, Optional, Tuple

from quad_nav import footprint
from quad_nav.config.planners import CARROT
from quad_nav.config.plugins import PluginLayerParams
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layered import CostmapParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.navigator.params import NavigatorParams

Caution = Tuple[str, str]
"""Path and text."""
_ROUNDING_M = 0.01
"""The polygon of 16 corners that stands for a circle is as much smaller."""


def cautions(
    navigator: NavigatorParams, local_planner: object, costmaps: Mapping[str, CostmapParams]
) -> Iterator[Caution]:
    """Yield what may let a robot with these parameters touch something."""
    yield from _costmap_cautions(costmaps)
    yield from _motion_cautions(navigator, local_planner, costmaps)


def _costmap_cautions(costmaps: Mapping[str, CostmapParams]) -> Iterator[Caution]:
    for name, costmap in costmaps.items():
        inscribed_m, _ = footprint.radii(costmap.unpadded_footprint)
        for layer, params in costmap.layers:
            if isinstance(params, InflationLayerParams):
                radius_m = params.inflation_radius_m
                if radius_m < inscribed_m - _ROUNDING_M:
                    yield (
                        f"{name}/{layer}/inflation_radius",
                        f"{radius_m:g} m is below the inscribed radius of {inscribed_m:.2f} m: "
                        "plans lead where the robot does not fit",
                    )
        if not _has(costmap, StaticLayerParams, PluginLayerParams) and not _sees(costmap):
            yield name, "no map and no observation_sources: this costmap never has obstacles"
        elif name == "local_costmap" and not _sees(costmap):
            yield name, "no observation_sources: the local planner sees nothing but the map"


def _motion_cautions(
    navigator: NavigatorParams, local_planner: object, costmaps: Mapping[str, CostmapParams]
) -> Iterator[Caution]:
    local = costmaps["local_costmap"]
    sees_m = min(local.width_m, local.height_m) / 2
    if navigator.base_global_planner == CARROT and not _sees(costmaps["global_costmap"]):
        text = "CarrotPlanner flies straight on, and the global costmap has no observation_sources"
        yield "base_global_planner", text
    speeds = _speeds(local_planner)
    if speeds is None:
        return
    speed_mps, turn_radps, sideways = speeds
    period_s = 1.0 / max(navigator.controller_frequency_hz, 1e-9)
    if isinstance(local_planner, DwaParams):
        yield from _start_caution(local_planner, period_s)
    if speed_mps * period_s > sees_m / 2:
        text = f"a command is flown for {period_s:g} s, which is {speed_mps * period_s:.1f} m"
        yield "controller_frequency", f"{text}; the local costmap reaches {sees_m:g} m"
    if not sideways and speed_mps > turn_radps * sees_m:
        yield (
            "max_vel_theta",
            f"at {speed_mps:g} m/s and {turn_radps:g} rad/s the robot turns with a radius of "
            f"{speed_mps / turn_radps if turn_radps else math.inf:.1f} m; the local costmap "
            f"reaches {sees_m:g} m",
        )


def _start_caution(dwa: DwaParams, period_s: float) -> Iterator[Caution]:
    """Yield why a robot at rest finds no velocity among those that one period reaches."""
    reached = dwa.acc_lim_x_mps2 * period_s, dwa.acc_lim_theta_radps2 * period_s
    least = dwa.min_vel_trans_mps, dwa.min_vel_theta_radps
    if dwa.use_dwa and reached[0] < least[0] and reached[1] < least[1]:
        yield (
            "acc_lim_x",
            f"in a control period, {period_s:g} s, the robot reaches {reached[0]:g} m/s and "
            f"{reached[1]:g} rad/s, less than min_vel_trans and min_vel_theta: it never starts",
        )


def body_caution(costmap: CostmapParams, body_m: float) -> Iterator[Caution]:
    """Yield what is wrong with a footprint around a body of this radius."""
    inscribed_m, _ = footprint.radii(costmap.unpadded_footprint)
    if inscribed_m < body_m - _ROUNDING_M:
        text = (
            f"the footprint has an inscribed radius of {inscribed_m:.2f} m, the body {body_m:g} m"
        )
        yield "local_costmap", f"{text}: the body touches what the footprint passes"


def _has(costmap: CostmapParams, *kinds: type) -> bool:
    return any(isinstance(params, kinds) for _, params in costmap.layers)


def _sees(costmap: CostmapParams) -> bool:
    layers = [params for _, params in costmap.layers]
    sources = [one.sources for one in layers if isinstance(one, ObstacleLayerParams)]
    return any(sources) or _has(costmap, PluginLayerParams)


def _speeds(planner: object) -> Optional[Tuple[float, float, bool]]:
    """Return the greatest speed and turn rate, and whether the robot flies sideways."""
    if isinstance(planner, TrajectoryPlannerParams):
        return planner.max_vel_x_mps, planner.max_vel_theta_radps, planner.holonomic_robot
    if isinstance(planner, DwaParams):
        return planner.max_vel_x_mps, planner.max_vel_theta_radps, planner.max_vel_y_mps > 0.0
    return None
