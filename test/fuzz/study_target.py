"""Fuzz target ``study``: a made-up ``study.db``, or a valid one with changed values.

The input is a file of SQLite, or edits of ``corpus/study/usual.db``, each ended by a newline: one
byte each for table, column, row and type of the new value, then the value.
"""

from __future__ import annotations

import atexit
import shutil
import sqlite3
import tempfile
from contextlib import closing
from functools import lru_cache
from pathlib import Path
from typing import Dict, List, Tuple

from quad_tune.flight_cache import FlightCache
from quad_tune.proposals import should_prune
from quad_tune.score import mean_cost
from quad_tune.search import best_first
from quad_tune.space import Dimension, SearchSpace
from quad_tune.study import open_study

IDENTITY = {"course": "synthetic"}
SPACE = SearchSpace("synthetic", (Dimension("speed", 0.0, 1.0), Dimension("bad", 0.0, 10.0)))
USUAL = Path(__file__).parent / "corpus" / "study" / "usual.db"
MAGIC = b"SQLite format 3\0"
_MEMORY = Path("/dev/shm")


def study(data: bytes) -> None:
    """Open a study, and a cache of flights, and use what they hold."""
    path = _folder() / "study.db"
    for rest in path.parent.glob("study.db*"):
        rest.unlink()
    if data.startswith(MAGIC):
        path.write_bytes(data)
        tables = {"trials"}
    else:
        path.write_bytes(USUAL.read_bytes())
        tables = _edit(path, data)
    if tables == {"flights"}:  # Optuna reads none of it, and takes most of the time
        _use(FlightCache(path), [])
        return
    with open_study(path.parent, IDENTITY, SPACE) as opened:
        _use(opened.journal, opened.trials)


def _use(flights: FlightCache, trials) -> None:
    results = list(flights._flights.values())
    assert not results or mean_cost(results) >= 0.0
    best_first(trials)
    should_prune(trials, 2, 1.0)


def _edit(path: Path, data: bytes) -> set:
    """Apply the edits and return the names of the tables that they change."""
    touched = set()
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.execute("PRAGMA ignore_check_constraints = ON")
        for edit in data.split(b"\n"):
            if len(edit) < 4:
                continue
            names = list(_columns())
            table = names[edit[0] % len(names)]
            column = _columns()[table][edit[1] % len(_columns()[table])]
            touched.add(table)
            try:
                database.execute(
                    f'UPDATE "{table}" SET "{column}" = {_value(edit[3])} WHERE rowid = ?',
                    (edit[4:], edit[2] % 8),
                )
            except (sqlite3.Error, OverflowError):
                continue  # a value that the table itself refuses
    return touched


def _value(kind: int) -> str:
    """Return the SQL of a new value of a type, with the edit's bytes as ?1."""
    return (
        "cast(?1 AS text)",
        "?1",
        "coalesce(cast(cast(?1 AS text) AS integer), 0)",
        "cast(cast(?1 AS text) AS real)",
        "CASE WHEN ?1 IS NOT NULL THEN NULL END",
        "CASE WHEN ?1 IS NOT NULL THEN 9e999 END",
    )[kind % 6]


@lru_cache(maxsize=None)
def _columns() -> Dict[str, Tuple[str, ...]]:
    """Return the columns of every table, flights first."""
    with closing(sqlite3.connect(USUAL)) as database:
        found = database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
        names: List[str] = sorted((name for (name,) in found), key=lambda name: name != "flights")
        return {
            name: tuple(row[1] for row in database.execute(f'PRAGMA table_info("{name}")'))
            for name in names
        }


@lru_cache(maxsize=None)
def _folder() -> Path:
    """Return a folder in memory, which ends with the process."""
    folder = Path(
        tempfile.mkdtemp(prefix="quad-fuzz-", dir=str(_MEMORY) if _MEMORY.is_dir() else None)
    )
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
