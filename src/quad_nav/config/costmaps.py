"""Namespaces of ``global_costmap`` and ``local_costmap``.

There are two styles. With a ``plugins`` list each layer has a namespace of its name. Without it (as
before ROS Hydro) layer parameters are among the costmap's own, and move_base moves them:
``observation_sources`` and the sources to ``obstacle_layer``, ``inflation_radius`` to
``inflation_layer``, and so on. In both styles some parameters of the costmap override the layer's.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Dict, List, Mapping, Set, Tuple

from quad_nav.config.fixes import with_fixes
from quad_nav.config.layers import LAYERS, PARENT_PARAMETERS, layer_params, normalise_layer
from quad_nav.config.notes import IGNORED, UNSUPPORTED, Notes, join
from quad_nav.config.plugins import is_dotted
from quad_nav.config.reader import Namespace, Table, made, named_types, normalise, subtree
from quad_nav.costmap.layered import CostmapParams
from quad_nav.files.number_texts import polygon_from_list, text_from_polygon

COSTMAP_TABLE = Table((CostmapParams,))
OBSTACLE, VOXEL = "costmap_2d::ObstacleLayer", "costmap_2d::VoxelLayer"
STATIC, INFLATION = "costmap_2d::StaticLayer", "costmap_2d::InflationLayer"
FOOTPRINT_KEYS = (
    "footprint",
    "robot_radius",
    "footprint_topic",
    "published_footprint_topic",
)
"""Parameters of a costmap that move_base looks for upwards too, to the node's level."""
_OLD_STYLE = ("static_map", "map_type")


def normalise_costmap(tree: Namespace, name: str, notes: Notes) -> None:
    """Normalise a costmap's namespace as move_base does; it inherits from the node's ``tree``."""
    costmap = subtree(tree, name, "", notes)
    _normalise_footprint(costmap, name, tree, notes)
    is_old_style = "plugins" not in costmap
    if is_old_style:
        _normalise_old_style(costmap, name, notes)
    plugins = _checked_plugins(costmap, name, notes)
    if not is_old_style and plugins != _old_style_layers(costmap):
        _remark_on_old_style(costmap, name, [layer_type for _, layer_type in plugins], notes)
    for layer, _ in plugins:
        if layer in _OLD_STYLE and not isinstance(costmap.get(layer), dict):
            costmap.pop(layer, None)  # the layer's namespace replaces it
    for layer, layer_type in plugins:
        _copy_parent_parameters(costmap, name, layer, layer_type, notes)
    chain = ((name, costmap), ("", tree))
    for layer, layer_type in plugins:
        if layer_type in LAYERS or is_dotted(layer_type):
            normalise_layer(costmap, name, layer, layer_type, chain, notes)
    known = {layer for layer, _ in plugins} | {"plugins", *_OLD_STYLE}
    for _, layer_type in plugins:
        known |= set(PARENT_PARAMETERS.get(layer_type, ()))
    normalise(costmap, name, _table_with_misplaced(costmap, known), notes, known)


def costmap_params(tree: Mapping[str, Any], name: str) -> CostmapParams:
    """Make the dataclass of a costmap from a normalised tree."""
    costmap = tree[name]
    layers = []
    for plugin in costmap["plugins"]:
        params = layer_params(costmap, name, plugin["name"], plugin["type"])
        if params is not None:
            layers.append((plugin["name"], with_fixes(params, tree)))
    return with_fixes(made(CostmapParams, costmap, layers=tuple(layers)), tree)


def _normalise_footprint(costmap: Namespace, name: str, tree: Namespace, notes: Notes) -> None:
    """Inherit the outline and its topics from the node's level; convert a list to a string."""
    for key in FOOTPRINT_KEYS:
        if key not in costmap and key in tree:
            costmap[key] = tree[key]
            notes.moved(join(name, key), key)
    if not isinstance(costmap.get("footprint"), list):
        return
    try:
        polygon = polygon_from_list(costmap["footprint"])
    except ValueError as error:
        expected = COSTMAP_TABLE["footprint"].expected
        text = f"{costmap['footprint']}: {error}; expected {expected}"
        notes.problem(join(name, "footprint"), text)
        polygon = None
    costmap["footprint"] = "[]" if polygon is None else text_from_polygon(polygon)


def _normalise_old_style(costmap: Namespace, name: str, notes: Notes) -> None:
    """Add the plugins list to a costmap without one, and move the layers' parameters."""
    static_map = costmap.get("static_map", False)
    if not isinstance(static_map, bool):
        text = f"{static_map!r} is not a boolean; expected true or false"
        notes.problem(join(name, "static_map"), text)
    plugins = _old_style_layers(costmap)
    for layer, layer_type in plugins:
        keys = list(PARENT_PARAMETERS[layer_type])
        if layer == "obstacle_layer":
            sources = costmap.get("observation_sources", "")
            keys += sources.split() if isinstance(sources, str) else []
            keys.append("observation_sources")
        for key in keys:
            keep = key == "track_unknown_space"  # the costmap itself reads it too
            _move(costmap, name, layer, key, notes, keep=keep)
    costmap["plugins"] = [{"name": layer, "type": kind} for layer, kind in plugins]


def _old_style_layers(costmap: Namespace) -> List[Tuple[str, str]]:
    """Return (name, type) of the layers that move_base adds to a costmap without ``plugins``."""
    static = [("static_layer", STATIC)] if costmap.get("static_map") is True else []
    obstacles = VOXEL if costmap.get("map_type") == "voxel" else OBSTACLE
    return [*static, ("obstacle_layer", obstacles), ("inflation_layer", INFLATION)]


def _remark_on_old_style(costmap: Namespace, name: str, types: List[str], notes: Notes) -> None:
    """Add remarks on old switches for layers beside ``plugins``; move_base warns about them too."""
    for key, value, promised in (("static_map", True, STATIC), ("map_type", "voxel", VOXEL)):
        if key not in costmap or isinstance(costmap[key], dict):
            continue
        if costmap[key] == value and promised not in types:
            reason = f"plugins has no {promised}"
        else:
            reason = "it is unused beside plugins"
        notes.remark(join(name, key), IGNORED, f"ignored by move_base: {reason}")


def _copy_parent_parameters(
    costmap: Namespace, name: str, layer: str, layer_type: str, notes: Notes
) -> None:
    for key in PARENT_PARAMETERS.get(layer_type, ()):
        own = costmap.get(layer)
        if isinstance(own, dict) and key in costmap and own.get(key, costmap[key]) != costmap[key]:
            text = f"ignored by move_base: {join(name, key)} overrides it"
            notes.remark(join(name, layer, key), IGNORED, text)
        _move(costmap, name, layer, key, notes, keep=True)


def _move(costmap: Namespace, name: str, layer: str, key: str, notes: Notes, keep: bool) -> None:
    if key not in costmap:
        return
    subtree(costmap, layer, name, notes)[key] = costmap[key]
    notes.moved(join(name, layer, key), join(name, key))
    value = costmap[key] if keep else costmap.pop(key)
    for below in value if isinstance(value, dict) else ():
        notes.moved(join(name, layer, key, below), join(name, key, below))


def _checked_plugins(costmap: Namespace, name: str, notes: Notes) -> List[Tuple[str, str]]:
    """Return (name, type) of each layer; report entries that are not supported."""
    place = join(name, "plugins")
    plugins = named_types(costmap["plugins"], place, "a layer", notes)
    for layer, layer_type in plugins.items():
        if layer_type not in LAYERS and not is_dotted(layer_type):
            expected = ", ".join(sorted(LAYERS))
            text = f"{layer_type} is not supported, skipping this layer; expected one of {expected}"
            notes.remark(join(place, layer), UNSUPPORTED, text)
    return list(plugins.items())


def _table_with_misplaced(costmap: Namespace, known: Set[str]) -> Table:
    """Return the costmap's table, with keys of layers that are not listed as ignored keys."""
    misplaced: Dict[str, str] = {}
    for layer_type, keys in PARENT_PARAMETERS.items():
        for key in set(keys) - known:
            misplaced[key] = f"plugins has no {layer_type}"
    if "observation_sources" in costmap:
        reason = "with plugins, expected in the obstacle layer's namespace"
        for key in ("observation_sources", *str(costmap["observation_sources"]).split()):
            misplaced[key] = reason
    for key, value in costmap.items():
        if isinstance(value, dict) and key not in known:
            misplaced.setdefault(key, "plugins has no layer of this name")
    return replace(COSTMAP_TABLE, ignored=misplaced)
