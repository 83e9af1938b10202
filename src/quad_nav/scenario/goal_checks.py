"""Check goals against the scene and against the robot's global costmap."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import List, Optional, Sequence

from quad_nav.config import Configuration
from quad_nav.costmap.layered import CostmapParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.files.values import MAX_MEMORY_BYTES
from quad_nav.mission.goal_file import SequenceSettings
from quad_nav.mission.place_check import PlaceCheck, clearance_check
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.scenario.coverage import (
    BYTES_PER_CELL,
    COSTMAP,
    SIZE_FROM_SCENE,
    Bounds,
    area_text,
    covers,
    grouped,
    is_feasible,
    robots_text,
    scene_bounds,
    size_line,
)
from quad_nav.sim.scene import Scene

_MAP = f"{COSTMAP}/static_map=true"
_YAW_FIELD = "yaw_goal_tolerance_rad"  # of both local planners
OFF_COSTMAP = "is off the global costmap"
"""Beginning of the fault of a goal to which no plan can lead."""


def scene_check(scene: Scene, robot_radius_m: float) -> PlaceCheck:
    """Check for positions in the arena, at least ``robot_radius_m`` from walls and obstacles."""
    distance_m, area = scene.flight_surface_distance_m, area_text(scene_bounds(scene))
    return clearance_check(scene.contains, distance_m, robot_radius_m, area)


def costmap_check(costmap: CostmapParams) -> Optional[PlaceCheck]:
    """Check for positions on a global costmap; None without a fixed place, see ``bounds_of``."""
    bounds = bounds_of(costmap)
    if bounds is None:
        return None
    low_x, low_y, high_x, high_y = bounds

    def check(x_m: float, y_m: float) -> Optional[str]:
        if low_x <= x_m < high_x and low_y <= y_m < high_y:
            return None
        expected = "expected a position on it, or a global_costmap that covers it"
        return f"{OFF_COSTMAP}, {area_text(bounds)}; {expected}"

    return check


def place_check(
    scene: Optional[Scene], robot_radius_m: float, configuration: Optional[Configuration]
) -> PlaceCheck:
    """Check for positions of a robot's goals, as far as scene and configuration are known."""
    checks = [
        scene_check(scene, robot_radius_m) if scene else None,
        costmap_check(configuration.global_costmap) if configuration else None,
    ]

    def check(x_m: float, y_m: float) -> Optional[str]:
        faults = (one(x_m, y_m) for one in checks if one is not None)
        return next((fault for fault in faults if fault), None)

    return check


def goals_off_the_costmap(
    robots: Sequence[RobotGoals], configurations: Sequence[Optional[Configuration]]
) -> List[str]:
    """A message for each goal outside its robot's global costmap: no plan can lead to it.

    For goals that no file gives; those of files are checked as they are read.
    """
    problems = []
    for robot, configuration in zip(robots, configurations):
        check = costmap_check(configuration.global_costmap) if configuration else None
        for number, goal in enumerate(robot.sequence.goals, start=1):
            fault = check(goal.x_m, goal.y_m) if check else None
            if fault:
                problems.append(
                    f"{robot.file.path}: goals[{number - 1}] (goal {number}): "
                    f"({goal.x_m:g}, {goal.y_m:g}) {fault}"
                )
    return problems


def with_planner_tolerance(
    settings: SequenceSettings, configuration: Optional[Configuration]
) -> SequenceSettings:
    """Return settings with the local planner's yaw tolerance if they have none of their own.

    The configuration may be unknown, and a planner of the user's without ``yaw_goal_tolerance``.
    """
    planners_rad = getattr(configuration and configuration.local_planner, _YAW_FIELD, None)
    if settings.yaw_tolerance_rad is not None or planners_rad is None:
        return settings
    return replace(settings, yaw_tolerance_rad=planners_rad)


def file_warnings(
    robots: Sequence[RobotGoals], configurations: Sequence[Optional[Configuration]]
) -> List[str]:
    """The warnings of each goal file, with its name."""
    planners = [one.local_planner if one else None for one in configurations]
    return [
        f"{robot.file.path}: {line}"
        for robot, planner in zip(robots, planners)
        for line in robot.sequence.warnings(
            getattr(planner, "xy_goal_tolerance_m", 0.0), getattr(planner, _YAW_FIELD, 0.0)
        )
    ]


def coverage_notes(configurations: Sequence[Optional[Configuration]]) -> List[str]:
    """A line for each size of global costmaps that is the scene's, with the robots' names."""
    sizes = [
        bounds_of(one.global_costmap) if one and one.tree.get(SIZE_FROM_SCENE) else None
        for one in configurations
    ]
    return [
        f"{robots_text(robots)}: global_costmap covers the scene, {area_text(bounds)}; its size in "
        "the configuration does not"
        for bounds, robots in grouped(sizes).items()
    ]


def cover_warnings(
    scene: Scene, configurations: Sequence[Optional[Configuration]], in_a_file: bool
) -> List[str]:
    """A warning for each global costmap that ends within the arena, with the robots that use it.

    It is no fault: the mission may stay in the part that is covered. ``in_a_file`` tells that the
    user sets parameters in files, not on the command line.
    """
    area = scene_bounds(scene)
    small = [_bounds_if_small(one, area) for one in configurations]
    lines = []
    for bounds, robots in grouped(small).items():
        costmap = next(one for one, own in zip(configurations, small) if own == bounds)
        lines.append(
            f"{robots_text(robots)}: global_costmap covers {area_text(bounds)}, but the scene is "
            f"{area_text(area)}: no plan leads beyond the costmap; "
            + _expected_size(area, costmap, in_a_file)
        )
    return lines


def map_warnings(
    scene: Scene, configurations: Sequence[Optional[Configuration]], in_a_file: bool
) -> List[str]:
    """A warning on global costmaps without the map that the scene is, see ``cover_warnings``."""
    without = [
        number
        for number, one in enumerate(configurations)
        if one and not any(isinstance(p, StaticLayerParams) for _, p in one.global_costmap.layers)
    ]
    if not without or not scene.is_map:
        return []
    place = " in the file of override0:= or in robot0.yaml" if in_a_file else ""
    line = "global_costmap: {static_map: true}, and map_server" if in_a_file else f"--set {_MAP}"
    return [
        f"{robots_text(without)}: global_costmap does not use the scene's map: plans lead through "
        f"walls that were not seen yet; expected{place} {line} (or a StaticLayer among its plugins)"
    ]


def _bounds_if_small(configuration: Optional[Configuration], area: Bounds) -> Optional[Bounds]:
    costmap = configuration.global_costmap if configuration else None
    bounds = bounds_of(costmap) if costmap else None
    return bounds if costmap and bounds and not covers(bounds, area, costmap.resolution_m) else None


def _expected_size(area: Bounds, configuration: Optional[Configuration], in_a_file: bool) -> str:
    """The end of a message on a global costmap that does not cover an area."""
    assert configuration is not None
    resolution_m = configuration.global_costmap.resolution_m
    width_m, height_m = area[2] - area[0], area[3] - area[1]
    if is_feasible(width_m, height_m, resolution_m):
        place = " in the file of override0:= or in robot0.yaml" if in_a_file else ""
        return f"expected{place} {size_line(area, resolution_m, in_a_file)}"
    cells_m = math.sqrt(width_m * height_m * BYTES_PER_CELL / MAX_MEMORY_BYTES)
    coarse_m = math.ceil(cells_m * 10.5) / 10
    return (
        f"with cells of {resolution_m:g} m a costmap of the scene takes more than "
        f"{MAX_MEMORY_BYTES / 1e9:g} GB; expected a smaller scene, or "
        + size_line(area, coarse_m, in_a_file, with_resolution=True)
    )


def bounds_of(costmap: CostmapParams) -> Optional[Bounds]:
    """The area that a costmap covers; None if it follows the robot or takes its map's size."""
    has_map = any(isinstance(layer, StaticLayerParams) for _, layer in costmap.layers)
    if costmap.rolling_window or has_map:
        return None
    x, y = costmap.origin_x_m, costmap.origin_y_m
    return x, y, x + costmap.width_m, y + costmap.height_m
