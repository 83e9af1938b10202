"""Size of the global costmap: it covers the scene.

A plan can only lead over cells of the global costmap. Configurations have the size of the scene
that they were made for, so that a costmap which does not cover another scene takes its size from
it. A size that the user sets for one robot or flight stays.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple

from quad_nav.config.files import ParameterTree, set_value
from quad_nav.config.robot_tree import is_users
from quad_nav.costmap.map_params import MapParams
from quad_nav.files.values import MAX_MEMORY_BYTES, is_number
from quad_nav.parameter import parameters_of
from quad_nav.sim.scene import Scene

Bounds = Tuple[float, float, float, float]
"""low x, low y, high x, high y of an area, m in ``map``."""

COSTMAP = "global_costmap"
SIZE_FROM_SCENE = "size_from_scene"
"""Parameter of a navigator whose global costmap has the size of the scene."""
BYTES_PER_CELL = 64
"""At least the memory that a cell of any costmap takes; ``config.workload`` computes it exactly."""
_DEFAULTS = {parameter.name: parameter.default for parameter in parameters_of(MapParams)}
_AXES = (("width", "origin_x"), ("height", "origin_y"))
_KEYS = ("resolution", *_AXES[0], *_AXES[1])


def scene_bounds(scene: Scene) -> Bounds:
    """The area of a scene."""
    return scene.origin_x_m, scene.origin_y_m, scene.end_x_m, scene.end_y_m


def area_text(bounds: Bounds) -> str:
    """An area, for messages."""
    low_x, low_y, high_x, high_y = bounds
    return f"x {low_x:g} to {high_x:g} m, y {low_y:g} to {high_y:g} m"


def covers(bounds: Bounds, area: Bounds, slack_m: float) -> bool:
    """Return whether bounds contain an area but for a margin of ``slack_m``."""
    return all(
        bounds[axis] <= area[axis] + slack_m and bounds[axis + 2] >= area[axis + 2] - slack_m
        for axis in (0, 1)
    )


def cover_area(
    tree: ParameterTree, area: Bounds, number: int, override: Optional[Path] = None
) -> None:
    """Give a robot's global costmap the size of an area, unless it covers it already.

    The costmap stays as it is if it rolls or takes its map's size, and if the area would take too
    much memory. Along an axis for which the user sets width or origin, the size stays too.

    Args:
        tree: The robot's parameters, changed in place.
        area: The area to cover.
        number: Number of the robot.
        override: The robot's file of overrides.
    """
    given = tree.get(COSTMAP)
    costmap: Mapping[str, Any] = given if isinstance(given, dict) else {}
    values = {key: costmap.get(key, _DEFAULTS[key]) for key in _KEYS}
    if _has_no_fixed_size(costmap) or not all(map(is_number, values.values())):
        return  # faulty values are reported when the tree is loaded
    if not is_feasible(area[2] - area[0], area[3] - area[1], values["resolution"]):
        return
    sizes: Dict[str, float] = {}
    for axis, (size, origin) in enumerate(_AXES):
        own = (tree.origins.get(f"{COSTMAP}/{key}", "") for key in (size, origin))
        low, high = values[origin], values[origin] + values[size]
        slack = values["resolution"]
        is_covered = low <= area[axis] + slack and high >= area[axis + 2] - slack
        if not is_covered and not any(is_users(one, number, override) for one in own):
            sizes[origin] = area[axis]
            sizes[size] = 1.0 * _whole_metres(area[axis + 2] - area[axis], values["resolution"])
    for key, value in sizes.items():
        set_value(tree, f"{COSTMAP}/{key}", value, "the scene")
    if sizes:
        set_value(tree, SIZE_FROM_SCENE, True, "the scene")


def is_feasible(width_m: float, height_m: float, resolution_m: float) -> bool:
    """Return whether a costmap of this size fits into the memory that one costmap may take."""
    limit_m2 = MAX_MEMORY_BYTES / BYTES_PER_CELL * resolution_m * resolution_m
    return resolution_m > 0.0 and width_m * height_m <= limit_m2


def size_line(
    area: Bounds, resolution_m: float, in_a_file: bool, with_resolution: bool = False
) -> str:
    """Return the parameters that make a global costmap cover an area, to be copied.

    They are a line of YAML for a file, or else options of ``quad fly``.
    """
    low_x, low_y, high_x, high_y = area
    values = {
        "width": _whole_metres(high_x - low_x, resolution_m),
        "height": _whole_metres(high_y - low_y, resolution_m),
        "origin_x": low_x,
        "origin_y": low_y,
        **({"resolution": resolution_m} if with_resolution else {}),
    }
    if in_a_file:
        fields = ", ".join(f"{key}: {value:.10g}" for key, value in values.items())
        return f"{COSTMAP}: {{{fields}}}"
    return " ".join(f"--set {COSTMAP}/{key}={value:.10g}" for key, value in values.items())


def robots_text(numbers: Iterable[int]) -> str:
    """Name robots in ascending order, for messages: "quad0, quad2 to quad9"."""
    runs: List[List[int]] = []
    for number in numbers:
        if runs and runs[-1][-1] == number - 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    names = []
    for run in runs:
        few = [f"quad{number}" for number in run]
        names += few if len(few) < 3 else [f"{few[0]} to {few[-1]}"]
    return ", ".join(names)


def grouped(bounds: Sequence[Optional[Bounds]]) -> Dict[Bounds, List[int]]:
    """Return the robots' numbers by their bounds; those without are left out."""
    robots: Dict[Bounds, List[int]] = {}
    for number, own in enumerate(bounds):
        if own is not None:
            robots.setdefault(own, []).append(number)
    return robots


def _has_no_fixed_size(costmap: Mapping[str, Any]) -> bool:
    """Return whether a costmap follows the robot or takes its map's size."""
    plugins = costmap.get("plugins")
    if isinstance(plugins, list):
        types = [str(one.get("type")) for one in plugins if isinstance(one, dict)]
        has_map = any(kind.endswith("StaticLayer") for kind in types)
    else:
        has_map = costmap.get("static_map") is True
    return has_map or costmap.get("rolling_window") is True


def _whole_metres(length_m: float, resolution_m: float) -> int:
    """Return a costmap's width that covers a length: move_base's widths are whole metres.

    A costmap has whole cells too, ``int(width / resolution)`` of them.
    """
    width_m = math.ceil(length_m - 1e-6)
    while int(width_m / resolution_m) * resolution_m < length_m - 1e-6:
        width_m += 1
    return width_m
