"""BARN's worlds, read from a file, as scenes.

The file is an ``.npz``: ``index`` int[n], the worlds' numbers; ``occupied`` [n, 64, 30], not 0
where a cylinder stands; ``path_<number>`` float[k, 2] for each, a reference path in metres.
Cell [row, column] is centred at x = 0.15 column - 4.425, y = 0.15 row + 0.075.
"""

from __future__ import annotations

import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Sequence, Tuple

import numpy as np

from quad_nav.barn.protocol import GOAL_M, START
from quad_nav.errors import InputError
from quad_nav.files.user_files import open_file
from quad_nav.sim.scene import Cylinder, Scene, Walls

ALTITUDE_M = 0.5
"""Half the cylinders' height: a tilted LIDAR sees neither the floor nor past their tops nearby."""
CELL_M = 0.15
CYLINDER_RADIUS_M = 0.075
CYLINDER_HEIGHT_M = 1.0
FIELD = (64, 30)
"""Rows along y, columns along x."""
MARGIN_M = 5.0
"""Free floor around field, start and goal, before the walls that every scene has."""
MAX_BYTES = 256 * 1024 * 1024
"""Of all arrays of a file, unpacked."""
_LOW_X_M = -4.5


@dataclass(frozen=True)
class BarnWorld:
    """``cells`` int[n, 2]: rows and columns that hold cylinders.

    ``path_length_m`` is that of the reference path, with the ways from the start to it and
    from it to the goal, as the challenge counts it.
    """

    number: int
    cells: np.ndarray
    path_length_m: float

    def scene(self) -> Scene:
        """The cylinders, on a floor that is open where the world is."""
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
    """The worlds in a file, or those with the numbers ``only``, in the file's order.

    Raises:
        InputError: the file, or what is in it, is not as this module's text says.
    """
    arrays = _read(path)
    numbers = _numbers(arrays, path)
    absent = [str(number) for number in only if number not in numbers]
    if absent:
        raise InputError(
            [
                f"{path}: has no world {', '.join(absent)}; expected numbers of its "
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


def _read(path: Path) -> Dict[str, np.ndarray]:
    try:
        with open_file(path) as opened, np.load(opened, allow_pickle=False) as file:
            size = sum(member.file_size for member in file.zip.infolist())
            if size > MAX_BYTES:
                raise ValueError(f"it holds {size} bytes, at most {MAX_BYTES} are read")
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
            [
                f"{path}: cannot be read: {error}; expected an .npz with index, "
                "occupied and path_<index>"
            ]
        ) from error


def _numbers(arrays: Dict[str, np.ndarray], path: Path) -> List[int]:
    """The worlds' numbers, after a look at both arrays that hold all worlds."""
    problems = [
        f"{path}: has no array {name}" for name in ("index", "occupied") if name not in arrays
    ]
    if problems:
        raise InputError(problems)
    index, occupied = arrays["index"], arrays["occupied"]
    if index.ndim != 1 or index.dtype.kind not in "iu" or len(index) == 0:
        problems.append(f"{path}: index: {index.dtype} {index.shape}, expected a row of integers")
    elif len(set(index.tolist())) < len(index):
        problems.append(f"{path}: index: has numbers twice, expected each once")
    expected = (*index.shape[:1], *FIELD)
    if occupied.shape != expected:
        problems.append(f"{path}: occupied: {occupied.shape}, expected {expected}")
    if problems:
        raise InputError(problems)
    return list(map(int, index))


def _length_m(arrays: Dict[str, np.ndarray], number: int, path: Path, problems: List[str]) -> float:
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
