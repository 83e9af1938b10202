"""What a scene takes from a Gazebo world or a ``map_server`` map."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Callable, Iterable, List, Optional, Sequence, Set, Tuple

from quad_nav.files.document import read_yaml
from quad_nav.sim.map_file import load_map
from quad_nav.sim.scene import Box, Obstacle
from quad_nav.sim.world_file import load_world

Extent = Tuple[float, float, float, float]
"""Least x and y, greatest x and y, metres in ``map``."""


@dataclass(frozen=True)
class Surroundings:
    """Obstacles, how far they or the map reach, and where quadcopters may start."""

    obstacles: Tuple[Obstacle, ...]
    extent: Optional[Extent]
    may_start: Callable[[float, float], bool]
    remarks: Tuple[str, ...]


def from_world(path: Path, model_path: Sequence[Path]) -> Surroundings:
    """A Gazebo world; as far as its solids reach. Raises ``InputError``."""
    world = load_world(path, model_path)
    obstacles = _with_names_of_their_own(world.obstacles)
    corners = [corner for obstacle in obstacles for corner in _corners(obstacle)]
    return Surroundings(tuple(obstacles), _extent(corners), lambda x_m, y_m: True, world.remarks)


def from_map(path: Path, height_m: float, unknown_is_occupied: bool) -> Surroundings:
    """A map; as far as its image reaches. Raises ``InputError``.

    Occupied cells are ``height_m`` high. Quadcopters start where the map is known to be free.
    """
    occupancy = load_map(read_yaml(path), path)
    boxes = occupancy.boxes(height_m, unknown_is_occupied)
    return Surroundings(
        tuple(boxes), _extent(occupancy.corners()), occupancy.is_free, occupancy.remarks
    )


def _with_names_of_their_own(obstacles: Sequence[Obstacle]) -> List[Obstacle]:
    """Gazebo tells equal names apart by their order; we number them from the second on."""
    taken: Set[str] = set()
    named = []
    for obstacle in obstacles:
        name, number = obstacle.name, 1
        while name in taken:
            number += 1
            name = f"{obstacle.name}_{number}"
        taken.add(name)
        named.append(obstacle if name == obstacle.name else replace(obstacle, name=name))
    return named


def _corners(obstacle: Obstacle) -> List[Tuple[float, float]]:
    """Corners of the upright rectangle along x and y that holds an obstacle."""
    if isinstance(obstacle, Box):
        cos, sin = abs(math.cos(obstacle.yaw_rad)), abs(math.sin(obstacle.yaw_rad))
        reach_x = (cos * obstacle.size_x_m + sin * obstacle.size_y_m) / 2
        reach_y = (sin * obstacle.size_x_m + cos * obstacle.size_y_m) / 2
    else:
        reach_x = reach_y = obstacle.radius_m
    return [
        (obstacle.x_m - reach_x, obstacle.y_m - reach_y),
        (obstacle.x_m + reach_x, obstacle.y_m + reach_y),
    ]


def _extent(corners: Iterable[Tuple[float, float]]) -> Optional[Extent]:
    points = list(corners)
    if not points:
        return None
    xs, ys = [x for x, _ in points], [y for _, y in points]
    return (min(xs), min(ys), max(xs), max(ys))
