"""Journal of a mission: the file that a restarted sequencer resumes from.

Each line is a JSON object. A line is forced to the disk before the robots receive what it says,
so that no goal is flown twice after a crash. An unfinished last line is ignored.
"""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from quad_nav.errors import InputError
from quad_nav.files.system import OPEN_FLAGS, lock
from quad_nav.files.user_files import read_bytes

MAX_BYTES = 512 * 1024 * 1024
"""Size of a journal that is read: a million goals."""
_MOST_DIGITS = 20  # of a whole number: thousands take long to parse


class Journal:
    """Records of one mission, and those that wait for space on the disk.

    A write error does not stop the flight: ``start``, ``append`` and ``flush`` return a message
    when writing fails for the first time and when it succeeds again, and "" otherwise.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: Optional[int] = None
        self._size = 0  # bytes of complete lines
        self._waiting: List[bytes] = []
        self._is_failing = False

    def start(self, head: Mapping[str, Any]) -> str:
        """Discard the content of the file and write the first record."""
        self.clear()
        return self.append(head)

    def clear(self) -> None:
        """Discard the content of the file with the next record."""
        self._size, self._waiting = 0, []

    def resume(self) -> List[Dict[str, Any]]:
        """Return the records of the file, [] if there is no file; append after them.

        Raises:
            InputError: The file cannot be read or is not a journal.
        """
        if not os.path.lexists(self.path):
            return []
        content = read_bytes(self.path, MAX_BYTES)
        records, self._size = _records(content, self.path)
        return records

    def append(self, record: Mapping[str, Any]) -> str:
        """Add a record and write all records that wait."""
        return self.append_lines([encode(record)])

    def append_lines(self, lines: Sequence[bytes]) -> str:
        """Add encoded records and write all records that wait, in one access to the disk."""
        self._waiting += lines
        return self.flush()

    def flush(self) -> str:
        """Write the records that wait."""
        if not self._waiting:
            return ""
        was_failing = self._is_failing
        try:
            self._write(b"".join(self._waiting))
        except OSError as error:
            self._is_failing = True
            return "" if was_failing else self._failure(error)
        self._waiting, self._is_failing = [], False
        return f"{self.path}: can be written again, nothing is missing" if was_failing else ""

    def close(self) -> None:
        """Close the file and release its lock."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _failure(self, error: OSError) -> str:
        return (
            f"{self.path}: cannot be written: {error.strerror or error}; the flight continues, "
            "and the journal is written as soon as possible"
        )

    def _write(self, data: bytes) -> None:
        """Write everything or, as far as a reader can see, nothing."""
        if self._file is None:
            self._file = self._open()
        try:
            os.ftruncate(self._file, self._size)  # removes an unfinished line
            done = 0
            while done < len(data):
                done += os.pwrite(self._file, data[done:], self._size + done)
            os.fsync(self._file)
        except OSError:
            os.ftruncate(self._file, self._size)
            raise
        self._size += len(data)

    def _open(self) -> int:
        """Open and lock the file: two missions must not share a journal."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(self.path, os.O_RDWR | os.O_CREAT | OPEN_FLAGS, 0o644)
        try:
            lock(file)
        except BlockingIOError as error:
            os.close(file)
            raise OSError(error.errno, "another running mission writes it") from error
        return file


def encode(record: Mapping[str, Any]) -> bytes:
    """Return a record as a line of the file.

    Raises:
        ValueError: A number is not finite.
    """
    return json.dumps(record, allow_nan=False).encode() + b"\n"


def _records(content: bytes, path: Path) -> Tuple[List[Dict[str, Any]], int]:
    """Return the records of a journal and the number of bytes that they take."""
    *lines, _unfinished = content.split(b"\n")
    records = []
    for number, line in enumerate(lines, start=1):
        try:
            record = json.loads(line, parse_float=_finite, parse_int=_whole, parse_constant=_finite)
        except (ValueError, RecursionError):
            record = None
        if not isinstance(record, dict):
            raise InputError(
                [
                    f"{path}:{number}: is not a record of a journal; expected a JSON object. "
                    "Remove the file to start with the first goals"
                ]
            )
        records.append(record)
    return records, sum(len(line) + 1 for line in lines)


def _finite(text: str) -> float:
    """Parse a number; JSON of Python's also has NaN, Infinity and 1e999."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text}, expected a finite number")
    return value


def _whole(text: str) -> int:
    if len(text) > _MOST_DIGITS:
        raise ValueError(f"a number of {len(text)} digits, expected {_MOST_DIGITS} at most")
    return int(text)
