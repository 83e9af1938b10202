"""Read BARN's worlds as scenes.

The file is an ``.npz`` with these arrays:

- ``index``: numbers of the worlds, integer, shape (n,);
- ``occupied``: nonzero where a cylinder stands, shape (n, 64, 30);
- ``path_<number>``: reference path of a world in metres, shape (k, 2).

Cell [row, column] is centred at x = 0.15 column - 4.425, y = 0.15 row + 0.075.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import List, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_bench.barn.arrays import Arrays, numbers_array, read_arrays, world_numbers
from quad_bench.barn.protocol import GOAL_M, START
from quad_nav.errors import InputError
from quad_nav.sim.obstacles import Cylinder
from quad_nav.sim.scene import Scene, Walls

ALTITUDE_M = 0.5
"""Half the cylinders' height: a tilted LIDAR sees neither the floor nor over close cylinders."""
CELL_M = 0.15
CYLINDER_RADIUS_M = 0.075
CYLINDER_HEIGHT_M = 1.0
FIELD = (64, 30)
"""Number of rows along y and of columns along x."""
MARGIN_M = 5.0
"""Free floor between the field, start and goal and the scene's walls."""
_LOW_X_M = -4.5


@dataclass(frozen=True)
class BarnWorld:
    """World of the benchmark.

    Attributes:
        number: Number of the world.
        cells: Rows and columns of the cells with cylinders, shape (n, 2).
        path_length_m: Length of the reference path with its connections to start and goal, as
            the challenge computes it.
    """

    number: int
    cells: NDArray[np.intp]
    path_length_m: float

    def scene(self) -> Scene:
        """Build the scene: the cylinders inside walls at a distance from the field."""
        cylinders = tuple(
            Cylinder(
                f"cylinder [{row}, {column}]",
                CELL_M * column + _LOW_X_M + CELL_M / 2,
                CELL_M * row + CELL_M / 2,
                CYLINDER_RADIUS_M,
                CYLINDER_HEIGHT_M,
            )
            for row, column in self.cells.tolist()
        )
        low_x, low_y = _LOW_X_M - MARGIN_M, -MARGIN_M
        return Scene(
            f"BARN world {self.number}",
            FIELD[1] * CELL_M + 2 * MARGIN_M,
            GOAL_M[1] + 2 * MARGIN_M,
            ALTITUDE_M,
            Walls(),
            cylinders,
            (START,),
            low_x,
            low_y,
        )


def load_worlds(path: Path, only: Sequence[int] = ()) -> Tuple[BarnWorld, ...]:
    """Load all worlds of a file, or those in ``only``, in the file's order.

    Raises:
        InputError: Lists every fault of the file.
    """
    arrays = read_arrays(path, "index, occupied and path_<index>")
    numbers = world_numbers(arrays, path, only)
    problems: List[str] = []
    shape = (len(numbers), *FIELD)
    occupied = numbers_array(arrays, "occupied", path, problems, shape)
    if problems:
        raise InputError(problems)
    worlds = [
        BarnWorld(number, np.argwhere(field), _length_m(arrays, number, path, problems))
        for number, field in zip(numbers, occupied)
        if not only or number in only
    ]
    if problems:
        raise InputError(problems)
    return tuple(worlds)


def _length_m(arrays: Arrays, number: int, path: Path, problems: List[str]) -> float:
    """Return the length of a world's reference path; 0 after a fault."""
    name = f"path_{number}"
    points = numbers_array(arrays, name, path, problems, (None, 2))
    if not np.all(np.isfinite(points)):
        problems.append(f"{path}: {name}: expected finite points in metres")
        return 0.0
    whole = np.vstack([(START.x_m, START.y_m), points, GOAL_M])
    return float(np.sum(np.hypot(*np.diff(whole, axis=0).T)))
