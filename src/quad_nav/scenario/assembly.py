"""Assembly: a navigator made from a configuration, and changed by another one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Callable, Dict, Mapping, Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.config import Configuration
from quad_nav.config.plugins import Plugin
from quad_nav.config.recoveries import RecoveryParams
from quad_nav.control.controller import LocalPlanner
from quad_nav.control.dwa_planner import DwaParams, DwaPlanner
from quad_nav.control.trajectory_planner import TrajectoryPlanner, TrajectoryPlannerParams
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layer import LayerParams
from quad_nav.costmap.layered import CostmapParams, LayeredCostmap
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.peer_layer import PeerLayerParams
from quad_nav.costmap.scan_filter import ScanFilters
from quad_nav.costmap.scan_validator import ScanValidator
from quad_nav.navigator.command_filter import VoronoiCell
from quad_nav.navigator.navigator import Navigator
from quad_nav.navigator.recovery_sequence import NamedRecovery
from quad_nav.peers.coordinator import PeerCoordinator
from quad_nav.plan.carrot import Carrot, CarrotParams
from quad_nav.plan.global_planner import SearchPlanner, SearchPlannerParams
from quad_nav.plan.navfn import Navfn, NavfnParams
from quad_nav.plan.planner import GlobalPlanner
from quad_nav.recovery import (
    ClearCostmap,
    ClearCostmapParams,
    MoveSlowAndClear,
    MoveSlowAndClearParams,
    Recovery,
    Rotate,
    RotateParams,
)

# The planner that each dataclass of parameters is for; both take the footprint, float64[n, 2].
GLOBAL_PLANNERS: Dict[type, Callable[[Any, NDArray[np.float64]], GlobalPlanner]] = {
    NavfnParams: lambda params, footprint: Navfn(params),
    SearchPlannerParams: lambda params, footprint: SearchPlanner(params),
    CarrotParams: Carrot,
}
LOCAL_PLANNERS: Dict[type, Callable[[Any, NDArray[np.float64], float], LocalPlanner]] = {
    TrajectoryPlannerParams: TrajectoryPlanner,
    DwaParams: DwaPlanner,
}

_RECOVERIES: Dict[type, Callable[[Any], Recovery]] = {
    ClearCostmapParams: ClearCostmap,
    MoveSlowAndClearParams: MoveSlowAndClear,
    RotateParams: Rotate,
}
_PEER_LAYER = ("peer_layer", PeerLayerParams())


def build_navigator(configuration: Configuration, number: Optional[int] = None) -> Navigator:
    """Build the idle navigator that a configuration describes.

    ``number`` is that of the robot among its peers, by default the configuration's ``robot``.
    """
    global_costmap = LayeredCostmap(_global_costmap(configuration))
    local_costmap = LayeredCostmap(_local_costmap(configuration))
    return Navigator(
        configuration.navigator,
        global_costmap,
        local_costmap,
        build_global_planner(configuration.global_planner, global_costmap.footprint),
        build_local_planner(configuration, local_costmap.footprint),
        [NamedRecovery(name, build_recovery(params)) for name, params in configuration.recoveries],
        PeerCoordinator(
            configuration.peers,
            global_costmap,
            local_costmap,
            configuration.robot if number is None else number,
        ),
        [
            kind.make() if isinstance(kind, Plugin) else VoronoiCell()
            for _, kind in configuration.command_filters
        ],
    )


def build_scan_filters(configuration: Configuration) -> ScanFilters:
    """Build the scan filters of one robot, for all of its sensors."""
    validator = ScanValidator(configuration.scan_validator)
    kinds = (kind for _, kind in configuration.scan_filters)
    return ScanFilters([kind.make() if isinstance(kind, Plugin) else validator for kind in kinds])


def apply_configuration(navigator: Navigator, configuration: Configuration) -> None:
    """Change every parameter of a navigator that may change in flight; the goal stays.

    Another planner stops the robot, which then plans anew. Otherwise the plan stays.
    """
    before, after = navigator.params, configuration.navigator
    footprint = navigator.global_costmap.footprint
    navigator.global_costmap.reconfigure(_global_costmap(configuration))
    navigator.local_costmap.reconfigure(_local_costmap(configuration))
    new_footprint = navigator.global_costmap.footprint
    local_footprint = navigator.local_costmap.footprint
    # A user's class may refuse: the rest follows only when both planners are there.
    if after.base_local_planner != before.base_local_planner:
        controller = build_local_planner(configuration, local_footprint)
    else:
        controller = navigator.controller
    if after.base_global_planner != before.base_global_planner:
        planner = build_global_planner(configuration.global_planner, new_footprint)
        navigator.change_planner(planner)
    # A user's planner has no parameters that change, and may hold a state of its own.
    elif not isinstance(configuration.global_planner, Plugin) or not np.array_equal(
        footprint, new_footprint
    ):
        navigator.set_planner(build_global_planner(configuration.global_planner, new_footprint))
    navigator.set_params(after)
    navigator.peers.params = configuration.peers
    if controller is not navigator.controller:
        navigator.change_controller(controller)
        _slow_down(navigator, configuration)
    elif not isinstance(configuration.local_planner, Plugin):
        navigator.set_controller_params(configuration.local_planner)
    controller.set_footprint(local_footprint)


def _slow_down(navigator: Navigator, configuration: Configuration) -> None:
    """Let recoveries limit the speeds of the local planner in use."""
    for named, (_, params) in zip(navigator.recoveries, configuration.recoveries):
        if isinstance(params, MoveSlowAndClearParams) and isinstance(
            named.behaviour, MoveSlowAndClear
        ):
            named.behaviour.params = params


def _made(makers: Mapping[type, Callable[..., Any]], params: Any, *arguments: Any) -> Any:
    """Make a plugin, or the part of the core that a dataclass of parameters is for."""
    if isinstance(params, Plugin):
        return params.make(*arguments)
    return makers[type(params)](params, *arguments)


def build_global_planner(params: Any, footprint: NDArray[np.float64]) -> GlobalPlanner:
    """Build a global planner from its parameters and the footprint, float64[n, 2]."""
    planner: GlobalPlanner = _made(GLOBAL_PLANNERS, params, footprint)
    return planner


def build_local_planner(
    configuration: Configuration, footprint: NDArray[np.float64]
) -> LocalPlanner:
    """Build the local planner of a configuration for a footprint, float64[n, 2]."""
    planner: LocalPlanner = _made(
        LOCAL_PLANNERS,
        configuration.local_planner,
        footprint,
        configuration.local_planner_period_s,
    )
    return planner


def _global_costmap(configuration: Configuration) -> CostmapParams:
    """Add the peer layer after the inflation layer: peers are no obstacles in this costmap."""
    costmap = _with_sensor_timeout(configuration, configuration.global_costmap)
    return replace(costmap, layers=(*costmap.layers, _PEER_LAYER))


def _local_costmap(configuration: Configuration) -> CostmapParams:
    """Add the peer layer before the inflation layer: peers are obstacles in this costmap."""
    costmap = _with_sensor_timeout(configuration, configuration.local_costmap)
    kinds = [isinstance(layer, InflationLayerParams) for _, layer in costmap.layers]
    place = kinds.index(True) if any(kinds) else len(kinds)
    return replace(costmap, layers=(*costmap.layers[:place], _PEER_LAYER, *costmap.layers[place:]))


def _with_sensor_timeout(configuration: Configuration, costmap: CostmapParams) -> CostmapParams:
    """Limit the period of every sensor to the sensor timeout.

    ``expected_update_rate`` is a period in seconds. Many configurations set 21.0 for a LIDAR of
    20 Hz; the robot would fly 21 s without sensor data.
    """
    limit_s = configuration.navigator.sensor_timeout_s
    if limit_s <= 0.0:
        return costmap
    layers = tuple((name, _layer_with_timeout(layer, limit_s)) for name, layer in costmap.layers)
    return replace(costmap, layers=layers)


def _layer_with_timeout(layer: LayerParams, limit_s: float) -> LayerParams:
    if not isinstance(layer, ObstacleLayerParams):
        return layer
    sources = tuple(
        replace(
            source,
            expected_update_period_s=min(source.expected_update_period_s or limit_s, limit_s),
        )
        for source in layer.sources
    )
    return replace(layer, sources=sources)


def build_recovery(params: RecoveryParams) -> Recovery:
    """Build a recovery behaviour."""
    recovery: Recovery = _made(_RECOVERIES, params)
    return recovery
