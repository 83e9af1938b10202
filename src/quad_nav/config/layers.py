"""The trees of a costmap's layers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Tuple

from quad_nav.config.notes import CAUTION, Notes, join
from quad_nav.config.plugins import LAYER, Parameters, PluginLayerParams, is_dotted, load_class
from quad_nav.config.reader import Namespace, check_class, fields, inherited, normalise, subtree
from quad_nav.config.spec import Table
from quad_nav.config.tables.layers import (
    ENABLED,
    INFLATION_LAYER_TABLE,
    OBSTACLE_LAYER_TABLE,
    SOURCE_TABLE,
    STATIC_LAYER_TABLE,
    VOXEL_LAYER_TABLE,
    VOXEL_PARAMETERS,
)
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layer import LayerParams
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.costmap.voxel import VoxelLayerParams

Chain = Tuple[Tuple[str, Mapping[str, Any]], ...]
_DATA_TYPES = ("LaserScan", "PointCloud", "PointCloud2")
_RANGES = ("obstacle_range", "raytrace_range")
# A longer silence than this goes unnoticed only by mistake.
_LONG_PERIOD_S = 2.0

_OBSTACLES = ("max_obstacle_height", *_RANGES, "track_unknown_space")

# What a costmap hands down to a layer of each type, over the layer's own value.
PARENT_PARAMETERS: Dict[str, Tuple[str, ...]] = {
    "costmap_2d::StaticLayer": (
        "map_topic",
        "unknown_cost_value",
        "lethal_cost_threshold",
        "track_unknown_space",
    ),
    "costmap_2d::VoxelLayer": VOXEL_PARAMETERS + _OBSTACLES,
    "costmap_2d::ObstacleLayer": _OBSTACLES,
    "costmap_2d::InflationLayer": ("cost_scaling_factor", "inflation_radius"),
}


@dataclass(frozen=True)
class LayerType:
    """A type of layer: its table, and the maker of its dataclass from (costmap, name)."""

    table: Table
    params: Callable[[Mapping[str, Any], str], LayerParams]


def normalise_layer(
    costmap: Namespace, costmap_path: str, name: str, layer_type: str, chain: Chain, notes: Notes
) -> None:
    """Brings one layer's namespace into the state in which the original leaves it.

    Args:
        chain: the namespaces above, nearest first, for what is looked for upwards.
    """
    path = join(costmap_path, name)
    layer = subtree(costmap, name, costmap_path, notes)
    if layer_type not in LAYERS:
        _normalise_plugin(layer, path, costmap_path, name, layer_type, notes)
        return
    table = LAYERS[layer_type].table
    if table not in (OBSTACLE_LAYER_TABLE, VOXEL_LAYER_TABLE):
        normalise(layer, path, table, notes)
        return
    sources = _source_names(layer)
    described = {key for key, value in layer.items() if isinstance(value, dict)}
    for source in sorted(described.difference(sources)):
        notes.remark(
            join(path, source),
            CAUTION,
            "looks like a source, and observation_sources does not name it: nothing reads it",
        )
    for source in sources:
        _normalise_source(layer, path, source, notes)
    _take_ranges_from_above(layer, path, chain, notes)
    normalise(layer, path, table, notes, also_known=described.union(sources))


def layer_params(
    costmap: Mapping[str, Any], costmap_path: str, name: str, layer_type: str
) -> Optional[LayerParams]:
    """The dataclass of a layer of a normalised costmap; None for a type that is not here."""
    if layer_type in LAYERS:
        return LAYERS[layer_type].params(costmap, name)
    if not is_dotted(layer_type):
        return None
    written = Parameters(costmap.get(name, {}), join(costmap_path, name))
    return PluginLayerParams(
        enabled=written.get("enabled", True),
        parameters=written,
        plugin_class=load_class(layer_type, LAYER),
    )


def _normalise_plugin(
    layer: Namespace, path: str, costmap_path: str, name: str, layer_type: str, notes: Notes
) -> None:
    """A layer of the user's knows its parameters itself, but for the switch that all have."""
    normalise(layer, path, Table(fixed=(ENABLED,)), notes, also_known=layer)
    check_class(layer_type, LAYER, join(costmap_path, "plugins", name), notes)


def _source_names(layer: Mapping[str, Any]) -> List[str]:
    names = layer.get("observation_sources", "")
    return names.split() if isinstance(names, str) else []


def _normalise_source(layer: Namespace, path: str, name: str, notes: Notes) -> None:
    place = join(path, name)
    source = subtree(layer, name, path, notes)
    normalise(source, place, SOURCE_TABLE, notes)
    data_type = source.get("data_type")
    if data_type is None:
        notes.remark(place, CAUTION, "no data_type: move_base listens for a PointCloud")
    elif isinstance(data_type, str) and data_type not in _DATA_TYPES:
        notes.problem(
            join(place, "data_type"),
            f"{data_type!r} is no sensor's type; expected {SOURCE_TABLE['data_type'].expected}",
        )
    period = source.get("expected_update_rate")
    if isinstance(period, float) and period > _LONG_PERIOD_S:
        notes.remark(
            join(place, "expected_update_rate"),
            CAUTION,
            f"{period} is a period in seconds, not a rate: the sensor may be silent for"
            " that long before it is missed",
        )


def _take_ranges_from_above(layer: Namespace, path: str, chain: Chain, notes: Notes) -> None:
    """Sources look for their ranges upwards to the node's level; the layer keeps what they find."""
    for key in _RANGES:
        written_at, value = inherited(key, chain)
        if key not in layer and written_at:
            layer[key] = value
            notes.moved(join(path, key), written_at)


def _seeing(table: Table, params: Callable[..., ObstacleLayerParams]) -> LayerType:
    """A layer with sources."""

    def make(costmap: Mapping[str, Any], name: str) -> LayerParams:
        layer = costmap[name]
        arguments = fields(layer, table.parameters)
        arguments["track_unknown_space"] = layer.get("track_unknown_space")
        sources = tuple(
            _source_params(layer.get(source, {}), source) for source in _source_names(layer)
        )
        return params(sources=sources, **arguments)

    return LayerType(table, make)


def _source_params(source: Mapping[str, Any], name: str) -> SourceParams:
    arguments = fields(source, SOURCE_TABLE.parameters)
    arguments["topic"] = arguments["topic"] or name
    for parameter in SOURCE_TABLE.fixed:
        if parameter.name in _RANGES:
            arguments[parameter.field] = source.get(parameter.name)
    return SourceParams(name=name, **arguments)


def _plain(table: Table, params: Callable[..., LayerParams]) -> LayerType:
    def make(costmap: Mapping[str, Any], name: str) -> LayerParams:
        return params(**fields(costmap[name], table.parameters))

    return LayerType(table, make)


LAYERS: Dict[str, LayerType] = {
    "costmap_2d::ObstacleLayer": _seeing(OBSTACLE_LAYER_TABLE, ObstacleLayerParams),
    "costmap_2d::VoxelLayer": _seeing(VOXEL_LAYER_TABLE, VoxelLayerParams),
    "costmap_2d::InflationLayer": _plain(INFLATION_LAYER_TABLE, InflationLayerParams),
    "costmap_2d::StaticLayer": _plain(STATIC_LAYER_TABLE, StaticLayerParams),
}


def layer_tables(plugins: Iterable[Mapping[str, str]]) -> Dict[str, Table]:
    """The table of each supported layer, by the layer's name."""
    return {
        plugin["name"]: LAYERS[plugin["type"]].table
        for plugin in plugins
        if plugin["type"] in LAYERS
    }
