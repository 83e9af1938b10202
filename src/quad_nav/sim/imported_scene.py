"""Scenes imported from a world or a ``map_server`` map, and start poses for them."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, List, Optional, Sequence, Set, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.document import read_yaml
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec
from quad_nav.sim.map_file import load_map
from quad_nav.sim.obstacles import Obstacle
from quad_nav.sim.scene import BODY_RADIUS_M, Floats, MovingObstacle, Scene
from quad_nav.sim.stage_file import is_stage
from quad_nav.sim.stage_world import load_stage_world
from quad_nav.sim.world_file import load_world

Extent = Tuple[float, float, float, float]
"""Smallest x and y, largest x and y in m, in ``map``."""
Place = Optional[Tuple[float, float]]
MayStart = Callable[[Floats, Floats], NDArray[np.bool_]]

MAX_CHOSEN_STARTS = 8
START_DISTANCE_M = 2 * BODY_RADIUS_M
"""Least distance of a chosen start from obstacles and walls."""
START_SPACING_M = 2.0
"""Least distance of two chosen starts."""
NARROW_DISTANCE_M = BODY_RADIUS_M + 0.1
"""That of a start where no place is wider."""
_HULL_M = BODY_RADIUS_M + 0.05
"""Half of the narrowest passage between two parts: the robot_radius of ``config/default``."""
_CELL_M, MAX_START_CELLS = 0.1, 500_000
"""Side of a cell in which passages are searched, larger in arenas of more cells than this."""
_MAX_LATTICE_POINTS = 20_000


@dataclass(frozen=True)
class ImportedScene:
    """Content of a world or map.

    Attributes:
        obstacles: The obstacles, with unique names.
        extent: Bounding box of the obstacles, or of the map; None if there is nothing.
        may_start: Returns whether a robot may start at positions in ``map``, bool[n] of x and y,
            float64[n] each.
        remarks: Notes for the user on content that was left out.
        moving: The obstacles that move, with unique names, too.
    """

    obstacles: Tuple[Obstacle, ...]
    extent: Optional[Extent]
    may_start: MayStart
    remarks: Tuple[str, ...]
    moving: Tuple[MovingObstacle, ...] = ()


def _anywhere(x_m: Floats, y_m: Floats) -> NDArray[np.bool_]:
    return np.ones(len(x_m), np.bool_)


NOTHING = ImportedScene((), None, _anywhere, ())


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
        tuple(obstacles), _extent(outlines), _anywhere, world.remarks, tuple(moving)
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


def with_free_starts(scene: Scene, may_start: MayStart, goals: Sequence[Place] = ()) -> Scene:
    """Return the scene with up to ``MAX_CHOSEN_STARTS`` start poses, none if no point is free.

    A start may be used by ``may_start``, is ``START_DISTANCE_M`` from everything and
    ``START_SPACING_M`` from the other starts, and faces along x. Where there is no such place, one
    between narrow walls will do. The choice is deterministic.

    Args:
        scene: The scene.
        may_start: See ``ImportedScene``.
        goals: First goal of robot 0, 1, ..., from whose part of the arena it has to start; for
            None, and for further robots, the part with most places to start from.
    """
    starts: Tuple[Pose2D, ...] = ()
    for distance_m in (START_DISTANCE_M, NARROW_DISTANCE_M):
        starts = starts or tuple(_Ground(scene, may_start, distance_m).starts(goals))
    return replace(scene, starts=starts)


class _Ground:
    """Places of an arena where a robot can start, and the parts that it can reach from there."""

    def __init__(self, scene: Scene, may_start: MayStart, distance_m: float) -> None:
        from quad_nav.sim.scene_cells import parts_of, touched_cells  # here: it loads numba

        self._scene, self._distance_m = scene, distance_m
        cell_m = max(_CELL_M, math.sqrt(scene.size_x_m * scene.size_y_m / MAX_START_CELLS))
        columns, rows = (math.ceil(one / cell_m) for one in (scene.size_x_m, scene.size_y_m))
        self._spec = GridSpec(columns, rows, cell_m, scene.origin_x_m, scene.origin_y_m)
        self._parts = parts_of(~touched_cells(scene, self._spec, _HULL_M))
        roomy = ~touched_cells(scene, self._spec, max(distance_m - cell_m, 0.0))
        roomy &= self._parts > 0
        at_rows, at_columns = np.nonzero(roomy)
        x_m = scene.origin_x_m + (at_columns + 0.5) * cell_m
        y_m = scene.origin_y_m + (at_rows + 0.5) * cell_m
        off_m = np.hypot(x_m - scene.centre[0], y_m - scene.centre[1])
        fine = np.column_stack([x_m, y_m])[np.argsort(off_m, kind="stable")]
        places = np.concatenate([np.reshape(_lattice(scene), (-1, 2)), fine])
        cells = ((places - (scene.origin_x_m, scene.origin_y_m)) / cell_m).astype(int)
        at = cells[:, 1].clip(0, rows - 1), cells[:, 0].clip(0, columns - 1)
        fits = roomy[at] & may_start(places[:, 0], places[:, 1])
        self._places, self._place_parts = places[fits], self._parts[at][fits]

    def _part(self, x_m: float, y_m: float) -> int:
        """Return the part of the arena at a point, 0 for none."""
        cell = self._spec.cell_of(x_m, y_m)
        return 0 if cell is None else int(self._parts[cell[1], cell[0]])

    def starts(self, goals: Sequence[Place]) -> List[Pose2D]:
        """Choose starts, those near the arena's centre first, see ``with_free_starts``."""
        starts: List[Pose2D] = []
        if not len(self._places):
            return starts
        largest = int(np.bincount(self._place_parts).argmax())
        left = np.ones(len(self._places), bool)
        for number in range(MAX_CHOSEN_STARTS):
            goal = goals[number] if number < len(goals) else None
            part = (self._part(*goal) if goal else 0) or largest
            start = self._start(left, part) or self._start(left, largest)
            if start is None:
                break
            starts.append(start)
            offsets_m = self._places - (start.x_m, start.y_m)
            left &= np.hypot(*offsets_m.T) >= START_SPACING_M
        return starts

    def _start(self, left: NDArray[np.bool_], part: int) -> Optional[Pose2D]:
        """Return the first place that is left in a part; those that are too narrow are left out."""
        altitude_m = self._scene.altitude_m
        for index in np.flatnonzero(left & (self._place_parts == part)):
            x_m, y_m = self._places[index].tolist()
            if self._scene.surface_distance_m(x_m, y_m, altitude_m) >= self._distance_m:
                return Pose2D(x_m, y_m)
            left[index] = False
        return None


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
