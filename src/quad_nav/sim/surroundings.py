"""What a scene takes from a Gazebo world or a ``map_server`` map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Callable, Iterable, List, Optional, Sequence, Set, Tuple

from quad_nav.files.document import read_yaml
from quad_nav.geometry import Pose2D
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
    """Points that span the extent of an obstacle along x and y."""
    if isinstance(obstacle, Box):
        pose = Pose2D(obstacle.x_m, obstacle.y_m, obstacle.yaw_rad)
        x, y = obstacle.size_x_m / 2, obstacle.size_y_m / 2
        return [pose.transform(*corner) for corner in ((-x, -y), (-x, y), (x, -y), (x, y))]
    reach = obstacle.radius_m
    return [
        (obstacle.x_m - reach, obstacle.y_m - reach),
        (obstacle.x_m + reach, obstacle.y_m + reach),
    ]


def _extent(corners: Iterable[Tuple[float, float]]) -> Optional[Extent]:
    points = list(corners)
    if not points:
        return None
    xs, ys = [x for x, _ in points], [y for _, y in points]
    return (min(xs), min(ys), max(xs), max(ys))
