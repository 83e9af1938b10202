"""Read BARN's worlds as scenes.

The file is an ``.npz`` with these arrays:

- ``index``: numbers of the worlds, integer, shape (n,);
- ``occupied``: nonzero where a cylinder stands, shape (n, 64, 30);
- ``path_<number>``: reference path of a world in metres, shape (k, 2).

Cell [row, column] is centred at x = 0.15 column - 4.425, y = 0.15 row + 0.075.
"""

from __future__ import annotations

import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.barn.protocol import GOAL_M, START
from quad_nav.errors import InputError
from quad_nav.files.user_files import open_file
from quad_nav.sim.scene import Cylinder, Scene, Walls

ALTITUDE_M = 0.5
"""Half the cylinders' height: a tilted LIDAR sees neither the floor nor over close cylinders."""
CELL_M = 0.15
CYLINDER_RADIUS_M = 0.075
CYLINDER_HEIGHT_M = 1.0
FIELD = (64, 30)
"""Number of rows along y and of columns along x."""
MARGIN_M = 5.0
"""Free floor between the field, start and goal and the scene's walls."""
MAX_BYTES = 256 * 1024 * 1024
"""Of all arrays of a file, unpacked."""
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
    numbers = _numbers(arrays, path)
    absent = [str(number) for number in only if number not in numbers]
    if absent:
        raise InputError(
            [
                f"{path}: no world {', '.join(absent)}; expected numbers of its "
                f"{len(numbers)} worlds, such as {numbers[0]}"
            ]
        )
    problems: List[str] = []
    worlds = [
        BarnWorld(number, np.argwhere(occupied), _length_m(arrays, number, path, problems))
        for number, occupied in zip(numbers, arrays["occupied"])
        if not only or number in only
    ]
    if problems:
        raise InputError(problems)
    return tuple(worlds)


def read_arrays(path: Path, expected: str) -> Dict[str, NDArray[Any]]:
    """Read the arrays of an ``.npz`` file that somebody else made.

    Raises:
        InputError: The file cannot be read, with the ``expected`` arrays.
    """
    try:
        with open_file(path) as opened, np.load(opened, allow_pickle=False) as file:
            size = sum(member.file_size for member in file.zip.infolist())
            if size > MAX_BYTES:
                raise ValueError(f"{size} bytes, expected at most {MAX_BYTES} are read")
            return {name: file[name] for name in file.files}
    except (
        OSError,
        EOFError,
        ValueError,
        AttributeError,
        TypeError,
        NotImplementedError,
        MemoryError,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise InputError(
            [f"{path}: cannot read: {error}; expected an .npz with {expected}"]
        ) from error


def _numbers(arrays: Dict[str, NDArray[Any]], path: Path) -> List[int]:
    """Return the worlds' numbers after a check of both arrays that hold all worlds."""
    problems = [f"{path}: no array {name}" for name in ("index", "occupied") if name not in arrays]
    if problems:
        raise InputError(problems)
    index, occupied = arrays["index"], arrays["occupied"]
    if index.ndim != 1 or index.dtype.kind not in "iu" or len(index) == 0:
        problems.append(f"{path}: index: {index.dtype} {index.shape}, expected a row of integers")
    elif len(set(index.tolist())) < len(index):
        problems.append(f"{path}: index: duplicate numbers, expected each once")
    expected = (*index.shape[:1], *FIELD)
    if occupied.shape != expected:
        problems.append(f"{path}: occupied: {occupied.shape}, expected {expected}")
    if problems:
        raise InputError(problems)
    return list(map(int, index))


def _length_m(
    arrays: Dict[str, NDArray[Any]], number: int, path: Path, problems: List[str]
) -> float:
    points = arrays.get(f"path_{number}", np.zeros(0))
    if (
        points.ndim != 2
        or points.shape[1] != 2
        or points.dtype.kind not in "fiu"
        or not np.all(np.isfinite(points))
    ):
        problems.append(
            f"{path}: path_{number}: {points.dtype} {points.shape}, expected points "
            "(n, 2) in metres"
        )
        return 0.0
    whole = np.vstack([(START.x_m, START.y_m), points.astype(float), GOAL_M])
    return float(np.sum(np.hypot(*np.diff(whole, axis=0).T)))
