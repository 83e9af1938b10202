"""Read DynaBARN's worlds as scenes with moving obstacles.

The file is an ``.npz`` with these arrays, in metres, seconds and radians, for each of n worlds with
m obstacles, which have at most T keyframes:

- ``index``: numbers of the worlds, integer, shape (n,);
- ``difficulty``: 0 easy, 1 medium, 2 hard, integer, shape (n,);
- ``radius_<number>``: radii of the cylinders, shape (m,);
- ``times_<number>``: times of the keyframes, shape (m, T), NaN after the last one;
- ``xy_<number>``: their positions, shape (m, T, 2), NaN after the last one;
- ``walls_<number>``: centre x and y, size x and y, yaw of the walls, shape (k, 5).

Source: A. Nair et al., "DynaBARN: Benchmarking Metric Ground Navigation in Dynamic Environments",
SSRR 2022.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import List, Sequence, Tuple

import numpy as np

from quad_bench.barn.arrays import Arrays, numbers_array, read_arrays, world_numbers
from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.sim.motion import Motion
from quad_nav.sim.obstacles import Box, Cylinder
from quad_nav.sim.scene import MovingObstacle, Scene, Walls

DIFFICULTIES = ("easy", "medium", "hard")
START = Pose2D(11.0, 0.0, 3.14)
"""Start pose in the worlds' frame, which is ``map`` here."""
ALTITUDE_M = 0.5
HEIGHT_M = 1.0
"""Of obstacles and walls, which stand on the floor: the LIDAR flies at about half of it."""
ORIGIN_M, SIZE_M = (-15.0, -15.0), (33.0, 30.0)
"""Arena: free floor around the field of 20 m by 20 m and the start, 4 m and more."""
MAX_OBSTACLES, MAX_KEYFRAMES = 200, 1000
_ARRAYS = "index, difficulty, and radius_, times_, xy_ and walls_<index>"


@dataclass(frozen=True)
class DynamicWorld:
    """World of the benchmark.

    Attributes:
        number: Number of the world.
        difficulty: 0 easy, 1 medium, 2 hard.
        radii_m: Radii of the obstacles.
        times_s: Times of the keyframes of each obstacle.
        points_m: Positions of the keyframes of each obstacle.
        walls: The walls.
    """

    number: int
    difficulty: int
    radii_m: Tuple[float, ...]
    times_s: Tuple[Tuple[float, ...], ...]
    points_m: Tuple[Tuple[Tuple[float, float], ...], ...]
    walls: Tuple[Box, ...]

    def scene(self, interpolation: str, phase_s: float) -> Scene:
        """Build the scene, in which all obstacles are ``phase_s`` ahead of the clock."""
        return Scene(
            f"DynaBARN world {self.number}",
            *SIZE_M,
            ALTITUDE_M,
            Walls(),
            self.walls,
            (START,),
            *ORIGIN_M,
            moving=tuple(
                MovingObstacle(
                    Cylinder(f"obstacle {k}", *points[0], radius_m, HEIGHT_M),
                    Motion(
                        times_s,
                        tuple((x_m, y_m, 0.0) for x_m, y_m in points),
                        interpolation=interpolation,
                    ),
                )
                for k, (radius_m, times_s, points) in enumerate(
                    zip(self.radii_m, self.times_s, self.points_m)
                )
            ),
            motion_phase_s=phase_s,
        )


def load_dynamic_worlds(path: Path, only: Sequence[int] = ()) -> Tuple[DynamicWorld, ...]:
    """Load all worlds of a file, or those in ``only``, in the file's order.

    Raises:
        InputError: Lists every fault of the file.
    """
    arrays = read_arrays(path, _ARRAYS)
    numbers = world_numbers(arrays, path, only)
    problems: List[str] = []
    difficulties = _difficulties(arrays, path, len(numbers), problems)
    worlds = [
        _world(arrays, number, difficulty, path, problems)
        for number, difficulty in zip(numbers, difficulties)
        if not only or number in only
    ]
    if problems:
        raise InputError(problems)
    return tuple(worlds)


def _difficulties(arrays: Arrays, path: Path, count: int, problems: List[str]) -> List[int]:
    """Return the difficulty of each world."""
    found = numbers_array(arrays, "difficulty", path, problems, (count,)).tolist()
    if not set(found) <= {0, 1, 2}:
        problems.append(f"{path}: difficulty: expected 0, 1 or 2 for each of {count} worlds")
    return [int(one) for one in found]


def _world(
    arrays: Arrays, number: int, difficulty: int, path: Path, problems: List[str]
) -> DynamicWorld:
    radii = numbers_array(arrays, f"radius_{number}", path, problems, (None,))
    times = numbers_array(arrays, f"times_{number}", path, problems, (len(radii), None))
    points = numbers_array(arrays, f"xy_{number}", path, problems, (*times.shape, 2))
    walls = numbers_array(arrays, f"walls_{number}", path, problems, (None, 5))
    counts = np.sum(np.isfinite(times), axis=1).tolist()
    sound = points.shape[:2] == times.shape and all(
        1 <= count <= MAX_KEYFRAMES
        and row[0] >= 0.0
        and np.all(np.diff(row[:count]) > 0.0)
        and np.all(np.isfinite(places[:count]))
        for row, places, count in zip(times, points, counts)
    )
    if not sound or not 0 < len(radii) <= MAX_OBSTACLES or not np.all(radii > 0.0):
        problems.append(
            f"{path}: world {number}: expected 1 to {MAX_OBSTACLES} obstacles with radii above 0, "
            f"and 1 to {MAX_KEYFRAMES} finite keyframes each, at increasing times from 0 on"
        )
        return DynamicWorld(number, difficulty, (), (), (), ())
    return DynamicWorld(
        number,
        difficulty,
        tuple(radii.tolist()),
        tuple(tuple(row[:count].tolist()) for row, count in zip(times, counts)),
        tuple(
            tuple((x_m, y_m) for x_m, y_m in places[:count].tolist())
            for places, count in zip(points, counts)
        ),
        tuple(
            Box(f"wall {k}", x_m, y_m, size_x_m, size_y_m, HEIGHT_M, yaw_rad)
            for k, (x_m, y_m, size_x_m, size_y_m, yaw_rad) in enumerate(walls.tolist())
        ),
    )
