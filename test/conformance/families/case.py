"""Reading recorded cases: an ``index.json`` and one ``.npz`` for each case it names."""

from __future__ import annotations

import json
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Mapping, Set

import numpy as np

# What numpy, zipfile and json raise over files that are damaged.
_UNREADABLE = (
    OSError,
    EOFError,
    ValueError,
    KeyError,
    RuntimeError,
    MemoryError,
    zipfile.BadZipFile,
    zlib.error,
)


class InvalidValue(Exception):
    """Recordings that are not in the format: says what is missing, and where."""


class Recorded(Dict[str, Any]):
    """A dictionary that complains about the recording when a key is not there."""

    def __missing__(self, key: str) -> Any:
        raise InvalidValue(f"there is no {key!r}")


class Arrays(Recorded):
    """Recorded arrays that remember which of them were looked at."""

    def __init__(self, arrays: Mapping[str, Any]) -> None:
        super().__init__(arrays)
        self._read: Set[str] = set()

    def __getitem__(self, key: str) -> Any:
        self._read.add(key)
        return super().__getitem__(key)

    @property
    def unread(self) -> List[str]:
        """Names of the arrays that nothing has looked at."""
        return sorted(set(self) - self._read)


@dataclass(frozen=True)
class Case:
    """``arrays`` by name, and ``meta``: the parameters and whatever is no array."""

    arrays: Arrays
    meta: Recorded


def recordings_in(folder: Path) -> List[Path]:
    """All files of recordings in a folder, sorted; none in what is no folder."""
    return sorted(folder.glob("*.npz"))


def named_in(folder: Path) -> List[Path]:
    """The files that a folder's index names, in its order, whether they are there or not.

    Raises:
        InvalidValue: no index, or one of another form.
    """
    path = folder / "index.json"
    try:
        names = [entry["case"] for entry in json.loads(path.read_text(encoding="utf-8"))]
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidValue(f"{path}: cannot be read: {error}") from error
    except (TypeError, KeyError) as error:
        raise InvalidValue(f"{path}: expected a list of {{case: , note: }}") from error
    if not names:
        raise InvalidValue(f"{path}: there is no case in it")
    return [folder / f"{name}.npz" for name in names]


def load_case(path: Path) -> Case:
    """Raises InvalidValue when the file is no recording."""
    try:
        with np.load(path) as file:
            arrays = Arrays(file)
        meta = json.loads(str(arrays.pop("meta")), object_hook=Recorded)
    except _UNREADABLE as error:
        raise InvalidValue(f"cannot be read: {error}") from error
    if not isinstance(meta, Recorded):
        raise InvalidValue("cannot be read: 'meta' is no JSON object")
    return Case(arrays, meta)
