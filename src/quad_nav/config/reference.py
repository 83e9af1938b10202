"""The reference page of parameters, written from the tables: ``docs/parameters.md``.

python -m quad_nav.config.reference > docs/parameters.md
"""

from __future__ import annotations

from typing import Iterable, List, Tuple

from quad_nav.config.fixes import FIXES_TABLE
from quad_nav.config.spec import Parameter, Table
from quad_nav.config.tables.costmap import COSTMAP_TABLE
from quad_nav.config.tables.dwa_planner import DWA_TABLE
from quad_nav.config.tables.global_planners import CARROT_TABLE, GLOBAL_PLANNER_TABLE, NAVFN_TABLE
from quad_nav.config.tables.layers import (
    INFLATION_LAYER_TABLE,
    OBSTACLE_LAYER_TABLE,
    SOURCE_TABLE,
    STATIC_LAYER_TABLE,
    VOXEL_LAYER_TABLE,
)
from quad_nav.config.tables.move_base import (
    DEFAULT_GLOBAL_PLANNER,
    DEFAULT_LOCAL_PLANNER,
    MOVE_BASE_TABLE,
)
from quad_nav.config.tables.recoveries import CLEAR_COSTMAP_TABLE, MOVE_SLOW_TABLE, ROTATE_TABLE
from quad_nav.config.tables.trajectory_planner import TRAJECTORY_PLANNER_TABLE

_HEAD = """# Parameters

Written by `python -m quad_nav.config.reference`; edit the tables in `src/quad_nav/config/`.

Parameters have the names, places and meanings that they have in ROS's `move_base` (navigation
1.17.3). A default is the value in force when nothing is set: where dynamic_reconfigure's
description and the wiki differ, it is dynamic_reconfigure's. Values outside a range are clamped to
it, and told. Parameters with a mark (R) can be changed while flying, with dynamic_reconfigure.

What cannot be a value at all (a text for a number, NaN, a negative radius) is an error; every error
is told before anything flies. What is legal and odd is told and flown: unknown keys with the
nearest known name, keys and plugins that move_base knows and this package does not, keys that the
original ignores, old names.

## Where parameters go

* A costmap with a `plugins` list reads each layer's parameters below the layer's name. Without one
  it has an `obstacle_layer` and an `inflation_layer` (and a `static_layer` first, with
  `static_map: true`), and layer parameters stand among the costmap's own, as before ROS Hydro.
* In both cases what stands at the costmap's level replaces the layer's own value:
  `inflation_radius` and `cost_scaling_factor`; `obstacle_range`, `raytrace_range`,
  `max_obstacle_height` and `track_unknown_space`; `map_topic`, `lethal_cost_threshold` and
  `unknown_cost_value`.
* Topics are relative to the node's namespace: `scan0` is `/scan0` for `/move_base0`.
* `footprint` counts before `robot_radius`. move_base's own radii are other parameters:
  `local_costmap/circumscribed_radius` and `clearing_radius`.
* Old names that still count: `pdist_scale`, `gdist_scale`, `min_in_place_rotational_vel`.
* `controller_patience` is 15 s at start, and 5 s from the first reconfiguration of move_base on,
  unless it is set: the original's two defaults differ.
* `TrajectoryPlannerROS/controller_frequency` changes what rollouts reckon with, not the loop's
  rate.
* Without `recovery_behaviors` the sequence is `conservative_reset`, `rotate_recovery`,
  `aggressive_reset`, `rotate_recovery`, and the two `reset_distance` are `conservative_reset_dist`
  and four times `local_costmap/circumscribed_radius`, whatever is set below those names.
* `map_type: voxel` makes the `obstacle_layer` of a costmap without `plugins` a
  `costmap_2d::VoxelLayer`. Voxel parameters at the costmap's level, too, replace the layer's own.
* Layers, planners and behaviours of other packages are left out, or replaced by the ones that fly
  here. Planners, layers and behaviours of your own are named as Python classes: see
  [plugins](plugins.md).
* Only the namespaces of the chosen planners are read; a turning recovery takes its limits from
  `TrajectoryPlannerROS` whatever the local planner.
"""


def reference() -> str:
    """The page, as Markdown."""
    parts = [_HEAD]
    for title, text, table in _sections():
        parts.append(f"\n## {title}\n\n{text}\n\n" + "\n".join(_rows(table)) + "\n")
    return "".join(parts)


def _sections() -> Iterable[Tuple[str, str, Table]]:
    yield "move_base", "At the node's level.", MOVE_BASE_TABLE
    yield (
        "TrajectoryPlannerROS",
        f"The local planner `{DEFAULT_LOCAL_PLANNER}`.",
        TRAJECTORY_PLANNER_TABLE,
    )
    yield "DWAPlannerROS", "The local planner `dwa_local_planner/DWAPlannerROS`.", DWA_TABLE
    yield "NavfnROS", f"The global planner `{DEFAULT_GLOBAL_PLANNER}`.", NAVFN_TABLE
    yield (
        "GlobalPlanner",
        "The global planner `global_planner/GlobalPlanner`.",
        GLOBAL_PLANNER_TABLE,
    )
    yield (
        "CarrotPlanner",
        "The global planner `carrot_planner/CarrotPlanner`: straight for the goal.",
        CARROT_TABLE,
    )
    yield (
        "fixes",
        "[Upstream bugs](upstream_bugs.md) that are fixed by default, and how to restore each.",
        FIXES_TABLE,
    )
    yield "Costmaps", "Below `global_costmap` and `local_costmap`.", COSTMAP_TABLE
    yield ("Obstacle layer", "`costmap_2d::ObstacleLayer`.", OBSTACLE_LAYER_TABLE)
    yield ("Voxel layer", "`costmap_2d::VoxelLayer`.", VOXEL_LAYER_TABLE)
    yield (
        "Sources",
        "Each name in `observation_sources` is a namespace below the layer.",
        SOURCE_TABLE,
    )
    yield ("Inflation layer", "`costmap_2d::InflationLayer`.", INFLATION_LAYER_TABLE)
    yield "Static layer", "`costmap_2d::StaticLayer`.", STATIC_LAYER_TABLE
    yield (
        "Clearing",
        "`clear_costmap_recovery/ClearCostmapRecovery`, below the behaviour's name."
        " `layer_names` lists the layers that are cleared; the obstacle layers when unset.",
        CLEAR_COSTMAP_TABLE,
    )
    yield (
        "Turning",
        "`rotate_recovery/RotateRecovery`, below the behaviour's name. Speeds and"
        " accelerations are those of TrajectoryPlannerROS.",
        ROTATE_TABLE,
    )
    yield (
        "Going slowly",
        "`move_slow_and_clear/MoveSlowAndClear`, below the behaviour's name. It"
        " frees the obstacle layers around the robot and limits the local planner's speeds,"
        " forwards, backwards and turning, until the robot has moved away.",
        MOVE_SLOW_TABLE,
    )


def _rows(table: Table) -> List[str]:
    rows = ["| name | default | range | unit | meaning |", "| --- | --- | --- | --- | --- |"]
    for parameter in table.parameters:
        mark = " (R)" if parameter in table.reconfigurable else ""
        unit = "" if parameter.kind == "str" else parameter.unit
        rows.append(
            f"| `{parameter.name}`{mark} | {_default(parameter)} | {_range(parameter)} |"
            f" {unit} | {parameter.description} |"
        )
    for name, reason in table.unsupported:
        rows.append(f"| `{name}` | | | | not supported here: {reason} |")
    for name, reason in table.ignored:
        rows.append(f"| `{name}` | | | | ignored: {reason} |")
    return rows


def _default(parameter: Parameter) -> str:
    if parameter.kind == "bool":
        return str(parameter.default).lower()
    if parameter.kind == "str":
        return f'`"{parameter.default}"`'
    return f"{parameter.in_force:g}"


def _range(parameter: Parameter) -> str:
    if parameter.choices:
        return ", ".join(f"{choice.value} {choice.name}" for choice in parameter.choices)
    if parameter.low is None and parameter.high is None:
        return ""
    ends = ("" if end is None else f"{end:g}" for end in (parameter.low, parameter.high))
    return " .. ".join(ends)


if __name__ == "__main__":
    print(reference(), end="")
