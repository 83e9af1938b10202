"""SQLite files of studies and flight caches: checked as a whole before anything flies.

The file may be damaged, of another program, locked or read-only, and the disk may be full. A file
that passes these checks holds whole rows, and takes one more.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Dict, List, Tuple

from quad_nav.errors import InputError, QuadError
from quad_nav.files.user_files import open_file
from quad_tune.flight_result import FlightResult

Key = Tuple[str, str, int]
"""Parameters as JSON with sorted keys, the mission's or world's name, the seed."""

MAX_BYTES = 1_000_000_000
LOCK_TIMEOUT_S = 5.0
"""Longest wait for another process that writes the file."""
_SMALLEST_PAGE = 512
_TABLE = (
    "CREATE TABLE IF NOT EXISTS flights (parameters TEXT, mission TEXT, seed INTEGER, "
    "result TEXT NOT NULL, PRIMARY KEY (parameters, mission, seed))"
)
INSERT = "INSERT INTO flights (parameters, mission, seed, result) VALUES (?, ?, ?, ?)"
_SELECT = "SELECT rowid, parameters, mission, seed, result FROM flights"
_ADVICE = {
    "locked": "expected that no other program uses the file; end it, or use another file",
    "full": "expected free disk space for the file; free some, then run the same command again",
    "disk i/o": "expected a disk that can be written; check it, then run the same command again",
    "readonly": "expected a file and a folder that can be written",
    "unable to open": "expected a file and a folder that can be written",
}
_RESTORE = "expected a file of quad tune or quad sweep; restore a copy, or use another file"


class NotStored(QuadError):
    """A result cannot be written to its file; what was stored before stays there."""


def advice(error: BaseException) -> str:
    """Return what was expected and what to do about an error of SQLite."""
    text = str(error).lower()
    return next((words for part, words in _ADVICE.items() if part in text), _RESTORE)


def reason(error: BaseException) -> str:
    """Return the first line of an error: SQLAlchemy appends statements and links."""
    lines = str(error.__cause__ if error.__cause__ is not None else error).strip().splitlines()
    return lines[0] if lines else type(error).__name__


def read_flights(path: Path) -> Dict[Key, FlightResult]:
    """Check a file, create it or its table of flights if missing, and read all flights.

    Raises:
        InputError: The file is damaged, cannot be written, or is used by another program.
    """
    _check_file(path)
    try:
        with closing(sqlite3.connect(path, timeout=LOCK_TIMEOUT_S)) as database:
            problems = database_faults(database)
            if problems:
                raise InputError([f"{path}: {line}; {_RESTORE}" for line in problems])
            _check_writable(database)
            flights, problems = flights_of(database)
    # sqlite3 raises UnicodeDecodeError for text that is not UTF-8.
    except (sqlite3.Error, OverflowError, MemoryError, UnicodeDecodeError) as error:
        raise InputError([f"{path}: {reason(error)}; {advice(error)}"]) from error
    if problems:
        raise InputError(
            [
                f"{path}: {line}; delete the row to fly this flight again, or use another file"
                for line in problems
            ]
        )
    return flights


def _check_file(path: Path) -> None:
    if not path.exists():
        return
    with open_file(path, MAX_BYTES) as file:
        start = file.read(_SMALLEST_PAGE)
    if 0 < len(start) < _SMALLEST_PAGE:  # SQLite would overwrite it
        raise InputError([f"{path}: has {len(start)} bytes and is not a database; {_RESTORE}"])


def database_faults(database: sqlite3.Connection) -> List[str]:
    """Return the faults of pages, schema and references.

    Raises:
        sqlite3.Error: The file is no database, or cannot be read.
    """
    ((found,),) = database.execute("PRAGMA integrity_check(1)")
    if found != "ok":
        return [f"is damaged: {found}"]
    found = database.execute("SELECT name FROM sqlite_master WHERE type IN ('view', 'trigger')")
    other = [name for (name,) in found]
    if other:  # they could read without an end, or change what is written
        return [f"has {name}, which no study has" for name in other]
    orphans = {(table, parent) for table, _, parent, _ in database.execute(_ORPHANS)}
    return [f"rows of {table} have lost their {parent}" for table, parent in sorted(orphans)]


_ORPHANS = "PRAGMA foreign_key_check"


def flights_of(database: sqlite3.Connection) -> Tuple[Dict[Key, FlightResult], List[str]]:
    """Read the table of flights.

    Returns:
        Flights by key, and a message for each row that is not a flight.
    """
    flights: Dict[Key, FlightResult] = {}
    faults: List[str] = []
    for row, parameters, mission, seed, result in database.execute(_SELECT):
        try:
            if not isinstance(seed, int):  # SQLite keeps a text in a column of numbers
                raise ValueError(f"seed is {type(seed).__name__}, expected a whole number")
            flights[parameters, mission, seed] = FlightResult.from_json(result)
        except ValueError as error:
            faults.append(f"row {row} of flights: {error}")
    return flights, faults


def _check_writable(database: sqlite3.Connection) -> None:
    """Create the table of flights, insert a row and take it back.

    Changing the version of the content writes to the disk, which shows that there is space.

    Raises:
        sqlite3.Error: Another process has locked the file, it cannot be written, or a row does
            not fit into the table.
    """
    (version,) = database.execute("PRAGMA user_version").fetchone()
    with database:
        database.execute(_TABLE)
    database.execute("BEGIN IMMEDIATE")
    database.execute(INSERT, ("", "", -1, ""))
    database.rollback()
    database.execute(f"PRAGMA user_version = {1 + version % 2}")
