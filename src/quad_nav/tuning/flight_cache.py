"""Cache of flight results in an SQLite file, so that no flight is flown twice.

Each result is committed when the flight ends: it survives Ctrl-C, a crash and kill -9. Only the
process that distributes the flights writes.
"""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Dict, Optional, Tuple

from quad_nav.tuning.flight_result import FlightResult

Key = Tuple[str, str, int]
"""Parameters as JSON with sorted keys, the mission's or world's name, the seed."""

_TABLE = (
    "CREATE TABLE IF NOT EXISTS flights (parameters TEXT, mission TEXT, seed INTEGER, "
    "result TEXT NOT NULL, PRIMARY KEY (parameters, mission, seed))"
)


class FlightCache:
    """Results of flights by key; ``path`` None keeps them in memory only."""

    def __init__(self, path: Optional[Path] = None) -> None:
        self._path = path
        self._flights: Dict[Key, FlightResult] = {}
        if path is not None:
            with closing(sqlite3.connect(path)) as file, file:
                file.execute(_TABLE)
                rows = file.execute("SELECT parameters, mission, seed, result FROM flights")
                self._flights = {
                    (parameters, mission, seed): FlightResult.from_json(result)
                    for parameters, mission, seed, result in rows
                }
        self.known_at_start = len(self._flights)

    def __contains__(self, key: Key) -> bool:
        return key in self._flights

    def __getitem__(self, key: Key) -> FlightResult:
        return self._flights[key]

    def __len__(self) -> int:
        return len(self._flights)

    def add(self, key: Key, flight: FlightResult) -> None:
        """Add a result; it is on disk when the method returns."""
        if self._path is not None:
            with closing(sqlite3.connect(self._path, timeout=60.0)) as file, file:
                file.execute("INSERT INTO flights VALUES (?, ?, ?, ?)", (*key, flight.to_json()))
        self._flights[key] = flight


def key_text(parameters: Dict[str, object]) -> str:
    """Serialize the parameters of a ``Key``."""
    return json.dumps(parameters, sort_keys=True)
