"""Generate ``docs/parameters.md`` from the declarations of the parameters.

python -m quad_nav.config.reference > docs/parameters.md
"""

from __future__ import annotations

from typing import Iterator, List, Tuple

from quad_nav.config.configuration import MOVE_BASE_TABLE
from quad_nav.config.costmaps import COSTMAP_TABLE
from quad_nav.config.fixes import FIXES, GROUPS
from quad_nav.config.layers import LAYERS, SOURCE_TABLE
from quad_nav.config.planners import (
    CARROT,
    DWA_PLANNER,
    GLOBAL_PLANNERS,
    LOCAL_PLANNERS,
    SEARCH_PLANNER,
)
from quad_nav.config.plugins import plugin_name
from quad_nav.config.reader import Table
from quad_nav.config.recoveries import CLEAR, MOVE_SLOW, ROTATE, TABLES
from quad_nav.navigator.params import DEFAULT_GLOBAL_PLANNER, DEFAULT_LOCAL_PLANNER
from quad_nav.parameter import Parameter

_HEAD = """# Parameters

Look up the name, default, range and meaning of every parameter of the navigator.

`python -m quad_nav.config.reference` generates this page from the declarations of the
parameters, see `src/quad_nav/parameter.py`.

Parameters have the names, places and meanings of ROS's `move_base` (navigation 1.17.3). A default
is the value in force when nothing is set. Where the wiki differs from dynamic_reconfigure's
description, the latter is used. Ranges are in parentheses. Values outside a range are clamped,
with a warning. Parameters marked (R) can change in flight, with dynamic_reconfigure. Those marked
(own) are not in upstream move_base.

The navigator refuses wrong types and impossible values, such as a string for a number, NaN or a
negative radius. It lists all errors before anything flies. It starts, with a warning for each, with
unknown keys, with keys and plugins that `move_base` knows and this package does not, with keys that
`move_base` ignores too, and with old names. [`quad check`](check.md) lists the same errors and
warnings without flying.

## Where parameters go

* A costmap with a `plugins` list reads each layer's parameters from a namespace of the layer's
  name. Without the list it has an `obstacle_layer` and an `inflation_layer`, and with
  `static_map: true` a `static_layer` before them. Its layer parameters are then among the
  costmap's own, as before ROS Hydro.
* In both cases these parameters of the costmap override the layer's: `inflation_radius` and
  `cost_scaling_factor`; `obstacle_range`, `raytrace_range`, `max_obstacle_height` and
  `track_unknown_space`; `map_topic`, `lethal_cost_threshold` and `unknown_cost_value`; all
  parameters of voxels.
* `map_type: voxel` makes the `obstacle_layer` of a costmap without `plugins` a
  `costmap_2d::VoxelLayer`.
* Topics are relative to the node's namespace: `scan0` is `/scan0` for `/move_base0`.
* `footprint` overrides `robot_radius`. move_base has radii of its own:
  `local_costmap/circumscribed_radius` and `clearing_radius`.
* These old names still work: `pdist_scale`, `gdist_scale`, `min_in_place_rotational_vel`.
* If `controller_patience` is not set, it is 15 s at the start, and 5 s from the first
  reconfiguration of move_base on. Upstream has these two defaults.
* `TrajectoryPlannerROS/controller_frequency` changes the rate that rollouts assume, not the rate of
  the control loop.
* Without `recovery_behaviors`, or with a mistake in it, the sequence is `conservative_reset`,
  `rotate_recovery`, `aggressive_reset`, `rotate_recovery`. The `reset_distance` of the first is
  `conservative_reset_dist`, that of the third is four times
  `local_costmap/circumscribed_radius`. Values in their namespaces have no effect.
* Without `scan_filters` the list is `quad/ScanValidator`, without `command_filters` it is
  `quad/VoronoiCell`. Parameters of other filters are below the filter's name: see
  [plugins](plugins.md#command-filter) and [moving obstacles](moving_obstacles.md).
* Layers of other packages are skipped. Planners of other packages, and a list with recoveries of
  other packages, are replaced by the defaults. Planners, layers and recoveries of your own are
  named as Python classes: see [plugins](plugins.md).
* Only the namespaces of the chosen planners are read. `rotate_recovery` reads its limits from
  `TrajectoryPlannerROS` whatever the local planner.
"""

_LAYERS = ("Obstacle", "Voxel", "Inflation", "Static")
_BEHAVIOUR = "in the namespace of the behaviour's name."
_PLANNERS = {
    DEFAULT_LOCAL_PLANNER: "The local planner `{}`.",
    DWA_PLANNER: "The local planner `{}`.",
    DEFAULT_GLOBAL_PLANNER: "The global planner `{}`.",
    SEARCH_PLANNER: "The global planner `{}`.",
    CARROT: "The global planner `{}`: a straight line to the goal.",
}
_RECOVERIES = {
    CLEAR: f"`{{}}`, {_BEHAVIOUR} `layer_names` lists the layers that are cleared; the obstacle"
    " layers if unset.",
    ROTATE: f"`{{}}`, {_BEHAVIOUR} Speeds and accelerations are those of TrajectoryPlannerROS.",
    MOVE_SLOW: f"`{{}}`, {_BEHAVIOUR} It clears the obstacle layers around the robot and limits"
    " all speeds of the local planner until the robot has moved away.",
}


def _sections() -> Iterator[Tuple[str, str, Table]]:
    """Yield title, text and table of each section."""
    yield "move_base", "At the node's level.", MOVE_BASE_TABLE
    for name, text in _PLANNERS.items():
        yield plugin_name(name), text.format(name), {**GLOBAL_PLANNERS, **LOCAL_PLANNERS}[name]
    text = "Our own: `upstream: true` restores [upstream bugs](upstream_bugs.md)."
    yield FIXES, text, GROUPS[FIXES]
    yield "peers", "Our own: see [avoidance between robots](peers.md).", GROUPS["peers"]
    yield "Costmaps", "In `global_costmap` and `local_costmap`.", COSTMAP_TABLE
    for kind in _LAYERS:
        name = f"costmap_2d::{kind}Layer"
        yield f"{kind} layer", f"`{name}`.", LAYERS[name]
        if kind == "Voxel":
            text = "Each name in `observation_sources` is a namespace in the layer's."
            yield "Sources", text, SOURCE_TABLE
    for name, text in _RECOVERIES.items():
        yield plugin_name(name), text.format(name), TABLES[name]


def reference() -> str:
    """Return the page as Markdown."""
    parts = [_HEAD]
    for title, text, table in _sections():
        parts.append(f"\n## {title}\n\n{text}\n\n" + "\n".join(_rows(table)) + "\n")
    return "".join(parts)


def _rows(table: Table) -> List[str]:
    rows = ["| name and default | meaning |", "| --- | --- |"]
    for parameter in table.parameters:
        mark = "" if parameter.is_fixed else " (R)"
        mark += " (own)" if parameter.is_own and not table.is_own else ""
        unit = "" if parameter.kind == "str" or parameter.default is None else parameter.unit
        values = f"{_default(parameter)} {unit}".strip()
        if _range(parameter):
            values += f" ({_range(parameter)})"
        rows.append(f"| `{parameter.name}`{mark}<br>{values} | {parameter.description} |")
    for name, reason in table.unsupported.items():
        rows.append(f"| `{name}` | not supported: {reason} |")
    for name, reason in table.ignored.items():
        rows.append(f"| `{name}` | ignored: {reason} |")
    return rows


def _default(parameter: Parameter) -> str:
    if parameter.default is None:
        return "unset"
    if parameter.kind == "bool":
        return str(parameter.default).lower()
    if parameter.kind == "str":
        breakable = str(parameter.default).replace("/", "/<wbr>")
        return f"<code>{breakable}</code>" if "/" in breakable else f'`"{parameter.default}"`'
    return f"{parameter.in_force:g}"


def _range(parameter: Parameter) -> str:
    if parameter.choices:
        return ", ".join(f"{choice.value} {choice.name}" for choice in parameter.choices)
    if parameter.low is None and parameter.high is None:
        return ""
    if parameter.high is None:
        return f"{parameter.low:g} or more"
    return f"{parameter.low:g} to {parameter.high:g}"


if __name__ == "__main__":
    print(reference(), end="")
