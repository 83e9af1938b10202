"""The folder of a study: Optuna's study and the flights in one SQLite file, and what they are of.

A trial is written when its generation has been flown, finished, in one transaction. What is in
the air or half a generation is known from the flights alone, so that there is nothing to mend
after kill -9.
"""

from __future__ import annotations

import fcntl
import json
import os
import sqlite3
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, Sequence

import optuna
import sqlalchemy.exc
from optuna.trial import FrozenTrial

from quad_nav.errors import InputError
from quad_nav.tuning.courses import identity_text
from quad_nav.tuning.flight_cache import FlightCache

FILE = "study.db"
_LOCK = ".lock"
_NAME = "quad tune"
_IDENTITY = "identity"


class TuneStudy:
    """Trials and flights. Open it with ``open_study``."""

    def __init__(self, study: optuna.Study, journal: FlightCache) -> None:
        self._study = study
        self.journal = journal

    @property
    def trials(self) -> List[FrozenTrial]:
        """Finished trials in order."""
        return self._study.get_trials(deepcopy=False)

    def tell(self, trial: FrozenTrial) -> None:
        """Keeps a finished trial."""
        self._study.add_trial(trial)


@contextmanager
def open_study(folder: Path, identity: Mapping[str, Any]) -> Iterator[TuneStudy]:
    """The study in a folder, or a new one.

    Raises:
        InputError: somebody else is working on it, it is of something else than ``identity``,
            or the folder cannot be used.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = os.open(folder / _LOCK, os.O_CREAT | os.O_RDWR, 0o644)
    except OSError as error:
        raise InputError([f"{folder}: {error.strerror}; expected a folder to write to"]) from error
    try:
        _take(lock, folder)
        yield _read(folder, identity)
    finally:
        os.close(lock)


def _take(lock: int, folder: Path) -> None:
    """The lock ends with the process, however that ends."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise InputError(
            [
                f"{folder}: another quad tune works on this study; expected another "
                "folder with --output"
            ]
        ) from error


def _read(folder: Path, identity: Mapping[str, Any]) -> TuneStudy:
    path = folder / FILE
    try:
        study = optuna.create_study(
            storage=f"sqlite:///{path}", study_name=_NAME, load_if_exists=True
        )
        journal = FlightCache(path)
    except (sqlite3.Error, sqlalchemy.exc.SQLAlchemyError, RuntimeError) as error:
        raise InputError([f"{path}: cannot be read as a study: {error}"]) from error
    # The identity as it comes back from JSON: tuples are lists there.
    wanted: Dict[str, Any] = json.loads(identity_text(identity))
    found = study.user_attrs.get(_IDENTITY)
    if found is None:
        study.set_user_attr(_IDENTITY, wanted)
    elif found != wanted:
        raise InputError(
            [
                f"{folder}: the study there is another one: {line}; expected the same, "
                "or another folder with --output"
                for line in unlike(found, wanted)
            ]
        )
    return TuneStudy(study, journal)


def unlike(there: Any, here: Any, place: str = "") -> Sequence[str]:
    """Where two JSON values differ: "seed was 0 and is 1"."""
    if isinstance(there, dict) and isinstance(here, dict):
        return [
            line
            for key in sorted({*there, *here})
            for line in unlike(there.get(key), here.get(key), f"{place}/{key}".lstrip("/"))
        ]
    if isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        return [
            line
            for k, (one, other) in enumerate(zip(there, here))
            for line in unlike(one, other, f"{place}[{k}]")
        ]
    return [] if there == here else [f"{place} was {_told(there)} and is {_told(here)}"]


def _told(value: Any) -> str:
    return "absent" if value is None else json.dumps(value)
