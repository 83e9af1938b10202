"""Namespaces of a costmap's layers, and the dataclasses that they fill."""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Tuple, cast

from quad_nav.config.notes import CAUTION, Notes, join
from quad_nav.config.plugins import LAYER, PluginLayerParams, is_dotted, plugin_of
from quad_nav.config.reader import (
    Namespace,
    Table,
    check_class,
    made,
    normalise,
    subtree,
)
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layer import LayerParams
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.costmap.voxel import VoxelLayerParams
from quad_nav.parameter import parameters_of

Chain = Tuple[Tuple[str, Mapping[str, Any]], ...]
_DATA_TYPES = ("LaserScan", "PointCloud", "PointCloud2")
_RANGES = ("obstacle_range", "raytrace_range")
# A longer expected_update_rate is probably meant as a rate.
_LONG_PERIOD_S = 2.0

# Parameters of a voxel layer that an obstacle layer lacks.
_VOXELS = tuple(
    parameter.name
    for parameter in parameters_of(VoxelLayerParams)
    if not hasattr(ObstacleLayerParams, parameter.field)
)
LAYERS: Dict[str, Table] = {
    "costmap_2d::ObstacleLayer": Table(
        (ObstacleLayerParams,),
        ignored=dict.fromkeys(_VOXELS, "only a costmap_2d::VoxelLayer reads it"),
    ),
    "costmap_2d::VoxelLayer": Table((VoxelLayerParams,)),
    "costmap_2d::InflationLayer": Table((InflationLayerParams,)),
    "costmap_2d::StaticLayer": Table((StaticLayerParams,)),
}
"""Type of each supported layer -> its parameters."""
SOURCE_TABLE = Table((SourceParams,))

_OBSTACLES = ("max_obstacle_height", *_RANGES, "track_unknown_space")

# Parameters of the costmap that override those of a layer, by the layer's type.
PARENT_PARAMETERS: Dict[str, Tuple[str, ...]] = {
    "costmap_2d::StaticLayer": (
        "map_topic",
        "unknown_cost_value",
        "lethal_cost_threshold",
        "track_unknown_space",
    ),
    "costmap_2d::VoxelLayer": _VOXELS + _OBSTACLES,
    "costmap_2d::ObstacleLayer": _OBSTACLES,
    "costmap_2d::InflationLayer": ("cost_scaling_factor", "inflation_radius"),
}


def normalise_layer(
    costmap: Namespace, costmap_path: str, name: str, layer_type: str, chain: Chain, notes: Notes
) -> None:
    """Normalise one layer's namespace as move_base does.

    ``chain`` has the enclosing (path, namespace), the innermost first, for inherited parameters.
    """
    path = join(costmap_path, name)
    layer = subtree(costmap, name, costmap_path, notes)
    if layer_type not in LAYERS:
        # A plugin checks its other parameters itself.
        normalise(layer, path, Table((LayerParams,)), notes, also_known=layer)
        check_class(layer_type, LAYER, join(costmap_path, "plugins", name), notes)
        return
    table = LAYERS[layer_type]
    if not issubclass(table.owners[0], ObstacleLayerParams):
        normalise(layer, path, table, notes)
        return
    sources = source_names(layer)
    described = {key for key, value in layer.items() if isinstance(value, dict)}
    for source in sorted(described.difference(sources)):
        text = "looks like a source, but observation_sources does not list it; not read"
        notes.remark(join(path, source), CAUTION, text)
    for source in sources:
        _normalise_source(layer, path, source, notes)
    _inherit_ranges(layer, path, chain, notes)
    normalise(layer, path, table, notes, also_known=described.union(sources))


def layer_params(
    costmap: Mapping[str, Any], costmap_path: str, name: str, layer_type: str
) -> Optional[LayerParams]:
    """Make a layer's dataclass from a normalised costmap; None if its type is not supported."""
    layer = costmap.get(name, {})
    if layer_type not in LAYERS:
        if not is_dotted(layer_type):
            return None
        plugin = plugin_of(layer_type, LAYER, layer, join(costmap_path, name))
        enabled = layer.get("enabled", True)
        return PluginLayerParams(enabled, plugin.plugin_class, plugin.parameters)
    owner = LAYERS[layer_type].owners[0]
    if not issubclass(owner, ObstacleLayerParams):
        return cast(LayerParams, made(owner, layer))
    sources = [_source_params(layer.get(one, {}), one) for one in source_names(layer)]
    return made(owner, layer, sources=tuple(sources))


def source_names(layer: Mapping[str, Any]) -> List[str]:
    """Return the names of a layer's sources."""
    names = layer.get("observation_sources", "")
    return names.split() if isinstance(names, str) else []


def _normalise_source(layer: Namespace, path: str, name: str, notes: Notes) -> None:
    place = join(path, name)
    source = subtree(layer, name, path, notes)
    normalise(source, place, SOURCE_TABLE, notes)
    data_type = source.get("data_type")
    if data_type is None:
        notes.remark(place, CAUTION, "no data_type: move_base subscribes to a PointCloud")
    elif isinstance(data_type, str) and data_type not in _DATA_TYPES:
        expected = SOURCE_TABLE["data_type"].expected
        text = f"{data_type!r} is not a type of sensor; expected {expected}"
        notes.problem(join(place, "data_type"), text)
    period = source.get("expected_update_rate")
    if isinstance(period, float) and period > _LONG_PERIOD_S:
        text = f"{period} is a period in seconds, not a rate: the sensor times out after that long"
        notes.remark(join(place, "expected_update_rate"), CAUTION, text)


def _inherit_ranges(layer: Namespace, path: str, chain: Chain, notes: Notes) -> None:
    """Look the sources' ranges up in enclosing namespaces, as ROS's ``searchParam`` does."""
    for key in _RANGES:
        above = next((one for one in chain if key in one[1]), None)
        if key not in layer and above is not None:
            layer[key] = above[1][key]
            notes.moved(join(path, key), join(above[0], key))


def _source_params(source: Mapping[str, Any], name: str) -> SourceParams:
    return made(SourceParams, source, name=name, topic=source.get("topic") or name)
