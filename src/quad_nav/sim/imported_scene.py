"""Scenes imported from a world or a ``map_server`` map, and start poses for them."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, List, Optional, Sequence, Set, Tuple

import numpy as np

from quad_nav.files.document import read_yaml
from quad_nav.geometry import Pose2D
from quad_nav.sim.map_file import load_map
from quad_nav.sim.obstacles import Obstacle
from quad_nav.sim.scene import BODY_RADIUS_M, MovingObstacle, Scene
from quad_nav.sim.stage_file import is_stage
from quad_nav.sim.stage_world import load_stage_world
from quad_nav.sim.world_file import load_world

Extent = Tuple[float, float, float, float]
"""Smallest x and y, largest x and y in m, in ``map``."""

MAX_CHOSEN_STARTS = 8
MAX_CANDIDATES = 1000
"""Candidates whose surface distance is computed; with 200000 boxes that takes about 10 s."""
START_DISTANCE_M = 2 * BODY_RADIUS_M
"""Least distance of a chosen start from obstacles and walls."""
START_SPACING_M = 2.0
"""Least distance of two chosen starts."""
_MAX_LATTICE_POINTS = 20_000


@dataclass(frozen=True)
class ImportedScene:
    """Content of a world or map.

    Attributes:
        obstacles: The obstacles, with unique names.
        extent: Bounding box of the obstacles, or of the map; None if there is nothing.
        may_start: Returns whether a robot may start at a position (x, y) in ``map``.
        remarks: Notes for the user on content that was left out.
        moving: The obstacles that move, with unique names, too.
    """

    obstacles: Tuple[Obstacle, ...]
    extent: Optional[Extent]
    may_start: Callable[[float, float], bool]
    remarks: Tuple[str, ...]
    moving: Tuple[MovingObstacle, ...] = ()


NOTHING = ImportedScene((), None, lambda x_m, y_m: True, ())


def from_world(path: Path, height_m: float) -> ImportedScene:
    """Import a world of Gazebo or Stage; its extent is that of its obstacles, moving ones too.

    Obstacles of Stage have a height of ``height_m``.

    Raises:
        InputError: A file has faults; lists all of them.
    """
    world = load_stage_world(path, height_m) if is_stage(path) else load_world(path)
    named = _with_unique_names([*world.obstacles, *(one.shape for one in world.moving)])
    obstacles, shapes = named[: len(world.obstacles)], named[len(world.obstacles) :]
    moving = [replace(one, shape=shape) for one, shape in zip(world.moving, shapes)]
    everywhere = (one.shape.placed(pose) for one in moving for pose in one.motion.poses)
    outlines = [solid.outline_m() for solid in (*obstacles, *everywhere)]
    return ImportedScene(
        tuple(obstacles), _extent(outlines), lambda x_m, y_m: True, world.remarks, tuple(moving)
    )


def from_map(path: Path, height_m: float, unknown_is_occupied: bool) -> ImportedScene:
    """Import a map; its extent is that of its image. Robots start on free cells only.

    Raises:
        InputError: A file has faults; lists all of them.
    """
    occupancy = load_map(read_yaml(path), path)
    boxes = occupancy.boxes(height_m, unknown_is_occupied)
    return ImportedScene(
        tuple(boxes), _extent([occupancy.corners()]), occupancy.is_free, occupancy.remarks
    )


def _with_unique_names(obstacles: Sequence[Obstacle]) -> List[Obstacle]:
    """Number equal names from the second on: Gazebo allows them, a scene does not."""
    taken: Set[str] = set()
    named = []
    for obstacle in obstacles:
        name, number = obstacle.name, 1
        while name in taken:
            number += 1
            name = f"{obstacle.name}_{number}"
        taken.add(name)
        named.append(obstacle if name == obstacle.name else obstacle.changed(name=name))
    return named


def _extent(points: Sequence[Any]) -> Optional[Extent]:
    """Return the extent of points, each array_like[k, 2]; None without any."""
    if not points:
        return None
    together = np.concatenate(points)
    x_m, y_m = together.min(axis=0).tolist()
    return (x_m, y_m, *together.max(axis=0).tolist())


def with_free_starts(scene: Scene, may_start: Callable[[float, float], bool]) -> Scene:
    """Return the scene with up to ``MAX_CHOSEN_STARTS`` start poses, none if no point is free.

    Candidates are the points of a lattice from the arena's centre outwards. A start may be used
    by ``may_start``, is at least ``START_DISTANCE_M`` from everything and ``START_SPACING_M``
    from the other starts, and faces along x. The choice is deterministic.
    """
    starts: List[Pose2D] = []
    candidates = 0
    for x_m, y_m in _lattice(scene):
        place = Pose2D(x_m, y_m)
        if not may_start(x_m, y_m) or any(
            place.distance_to(start) < START_SPACING_M for start in starts
        ):
            continue
        candidates += 1
        if scene.surface_distance_m(x_m, y_m, scene.altitude_m) >= START_DISTANCE_M:
            starts.append(place)
        if len(starts) == MAX_CHOSEN_STARTS or candidates == MAX_CANDIDATES:
            break
    return replace(scene, starts=tuple(starts))


def _lattice(scene: Scene) -> List[Tuple[float, float]]:
    """Return a lattice over the arena, spaced 0.5 m or more, from the centre outwards."""
    step_m = max(0.5, math.sqrt(scene.size_x_m * scene.size_y_m / _MAX_LATTICE_POINTS))
    x_centre, y_centre = scene.centre
    reach_x = math.floor(scene.size_x_m / 2 / step_m)
    reach_y = math.floor(scene.size_y_m / 2 / step_m)
    cells = itertools.product(range(-reach_y, reach_y + 1), range(-reach_x, reach_x + 1))
    ordered = sorted(cells, key=lambda cell: (cell[0] ** 2 + cell[1] ** 2, cell))
    places = ((x_centre + column * step_m, y_centre + row * step_m) for row, column in ordered)
    return [place for place in places if scene.contains(*place)]
