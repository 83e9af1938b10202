"""Cache of flight results in an SQLite file, so that no flight is flown twice.

Each result is committed when the flight ends: it survives Ctrl-C, a crash and kill -9. Only the
process that distributes the flights writes. ``study_database`` checks the file.
"""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Dict, Optional

from quad_tune.flight_result import FlightResult
from quad_tune.study_database import INSERT, Key, NotStored, advice, read_flights, reason

_TIMEOUT_S = 60.0


class FlightCache:
    """Results of flights by key; ``path`` None keeps them in memory only.

    Raises:
        InputError: The file is damaged, cannot be written, or is used by another program.
    """

    def __init__(self, path: Optional[Path] = None) -> None:
        self._path = path
        self._flights: Dict[Key, FlightResult] = {} if path is None else read_flights(path)
        self.known_at_start = len(self._flights)
        self.is_broken = False
        """True after a result could not be stored."""

    def __contains__(self, key: Key) -> bool:
        return key in self._flights

    def __getitem__(self, key: Key) -> FlightResult:
        return self._flights[key]

    def __len__(self) -> int:
        return len(self._flights)

    def add(self, key: Key, flight: FlightResult) -> None:
        """Add a result; it is on disk when the method returns.

        Raises:
            NotStored: It is in memory only, because the file cannot be written.
        """
        self._flights[key] = flight
        if self._path is None:
            return
        try:
            with closing(sqlite3.connect(self._path, timeout=_TIMEOUT_S)) as file, file:
                file.execute(INSERT, (*key, flight.to_json()))
        except sqlite3.Error as error:
            self.is_broken = True
            raise NotStored(
                f"{self._path}: cannot store a flight: {reason(error)}; {advice(error)}"
            ) from error

    def keep_in_memory(self) -> None:
        """Store no further result on disk."""
        self._path = None


def key_text(parameters: Dict[str, object]) -> str:
    """Serialize the parameters of a ``Key``."""
    return json.dumps(parameters, sort_keys=True)
