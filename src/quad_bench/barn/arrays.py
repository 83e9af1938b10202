"""Check the arrays of an ``.npz`` file that somebody else made."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError
from quad_nav.files.user_files import open_file

MAX_BYTES = 256 * 1024 * 1024
"""Of all arrays of a file, unpacked."""

Arrays = Dict[str, NDArray[Any]]


def read_arrays(path: Path, expected: str) -> Arrays:
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


def world_numbers(arrays: Arrays, path: Path, only: Sequence[int]) -> List[int]:
    """Return the numbers of all worlds, the array ``index``.

    Args:
        arrays: The file's arrays.
        path: The file, for messages.
        only: Numbers that have to be among them.

    Raises:
        InputError: ``index`` is no row of distinct integers, or has not all of ``only``.
    """
    index = arrays.get("index")
    if index is None:
        raise InputError([f"{path}: no array index"])
    if index.ndim != 1 or index.dtype.kind not in "iu" or len(index) == 0:
        raise InputError(
            [f"{path}: index: {index.dtype} {index.shape}, expected a row of integers"]
        )
    numbers = [int(number) for number in index]
    if len(set(numbers)) < len(numbers):
        raise InputError([f"{path}: index: duplicate numbers, expected each once"])
    absent = [str(number) for number in only if number not in numbers]
    if absent:
        raise InputError(
            [
                f"{path}: no world {', '.join(absent)}; expected numbers of its "
                f"{len(numbers)} worlds, such as {numbers[0]}"
            ]
        )
    return numbers


def numbers_array(
    arrays: Arrays,
    name: str,
    path: Path,
    problems: List[str],
    shape: Tuple[Optional[int], ...],
) -> NDArray[np.float64]:
    """Return an array of numbers as float64, or an empty one after a fault.

    Args:
        arrays: The file's arrays.
        name: The array's name.
        path: The file, for messages.
        problems: Gets a message if the array is missing, has another shape or no numbers.
        shape: Its shape; None is any length.
    """
    array = arrays.get(name, np.zeros(0))
    fits = array.ndim == len(shape) and all(
        wanted is None or length == wanted for length, wanted in zip(array.shape, shape)
    )
    if not fits or array.dtype.kind not in "fiub":
        expected = ", ".join("any" if one is None else str(one) for one in shape)
        problems.append(
            f"{path}: {name}: {array.dtype} {array.shape}, expected numbers ({expected})"
        )
        return np.zeros(tuple(one or 0 for one in shape))
    return array.astype(float)
