"""A mission's journal: a file that tells a new sequencer what the one before it has flown.

Lines are JSON objects, appended and forced to the disk before the quadcopters are told
of what is in them. So whoever is killed, nothing that was flown is flown again. The end
of a line that was never finished counts for nothing.
"""

from __future__ import annotations

import fcntl
import json
import os
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Tuple

from quad_nav.errors import InputError


class Journal:
    """The lines of one mission, and those that wait for room on the disk.

    A disk that is full stops nobody: ``keep`` and ``flush`` return a sentence when the file
    can't be written any more and another when it can again, and "" otherwise.
    """

    def __init__(self, path: Path):
        self.path = path
        self._file: Optional[int] = None
        self._size = 0  # bytes, of whole lines
        self._waiting: List[bytes] = []
        self._is_failing = False

    def begin(self, head: Mapping[str, Any]) -> str:
        """Forgets what the file had and begins anew."""
        self._size, self._waiting = 0, []
        return self.keep(head)

    def go_on(self) -> List[Dict[str, Any]]:
        """What the file has, [] when there is none; further lines come after it.

        Raises:
            InputError: it cannot be read, or is no journal.
        """
        try:
            content = self.path.read_bytes()
        except FileNotFoundError:
            return []
        except OSError as error:
            raise InputError(
                [
                    f"{self.path}: cannot be read: {error.strerror}; expected the "
                    "journal of a mission"
                ]
            ) from error
        records, self._size = _records(content, self.path)
        return records

    def keep(self, record: Mapping[str, Any]) -> str:
        """Takes a line and writes all that wait."""
        self._waiting.append(json.dumps(record, allow_nan=False).encode() + b"\n")
        return self.flush()

    def flush(self) -> str:
        """Writes the lines that wait."""
        if not self._waiting:
            return ""
        try:
            self._write(b"".join(self._waiting))
        except OSError as error:
            news = (
                ""
                if self._is_failing
                else (
                    f"{self.path}: cannot be written: {error.strerror or error}; the flight goes on, "
                    "and so does the journal as soon as it can"
                )
            )
            self._is_failing = True
            return news
        news = f"{self.path}: written again, nothing is missing" if self._is_failing else ""
        self._waiting, self._is_failing = [], False
        return news

    def close(self) -> None:
        """Lets others have the file."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _write(self, data: bytes) -> None:
        """All of it or, as far as a reader can see, nothing."""
        if self._file is None:
            self._file = self._open()
        try:
            os.ftruncate(self._file, self._size)  # of an attempt before, or a torn line
            done = 0
            while done < len(data):
                done += os.pwrite(self._file, data[done:], self._size + done)
            os.fsync(self._file)
        except OSError:
            os.ftruncate(self._file, self._size)
            raise
        self._size += len(data)

    def _open(self) -> int:
        """The file, locked: two missions in one journal would be none."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            os.close(file)
            raise OSError(error.errno, "another mission that flies now writes it") from error
        return file


def _records(content: bytes, path: Path) -> Tuple[List[Dict[str, Any]], int]:
    """The objects in a journal, and how many bytes they take."""
    *lines, _torn = content.split(b"\n")
    records = []
    for number, line in enumerate(lines, start=1):
        try:
            record = json.loads(line)
        except ValueError:
            record = None
        if not isinstance(record, dict):
            raise InputError(
                [
                    f"{path}:{number}: is no line of a journal; expected a JSON object. "
                    "Remove the file to begin with the first goals"
                ]
            )
        records.append(record)
    return records, sum(len(line) + 1 for line in lines)
