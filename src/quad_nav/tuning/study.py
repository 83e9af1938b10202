"""Folder of a study: Optuna's study and the flight cache in one SQLite file.

A trial is written after its generation, in one transaction. An unfinished generation exists only
as cached flights, so a study needs no repair after kill -9.
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
    """Trials and cached flights of a study; created by ``open_study``."""

    def __init__(self, study: optuna.Study, journal: FlightCache) -> None:
        self._study = study
        self.journal = journal

    @property
    def trials(self) -> List[FrozenTrial]:
        """Finished trials in order."""
        return self._study.get_trials(deepcopy=False)

    def add(self, trial: FrozenTrial) -> None:
        """Store a finished trial."""
        self._study.add_trial(trial)


@contextmanager
def open_study(folder: Path, identity: Mapping[str, Any]) -> Iterator[TuneStudy]:
    """Open the study in a folder, or create one.

    Raises:
        InputError: Another process works on the study, the study has another identity, or the
            folder cannot be used.
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
    """Lock the study; the lock ends with the process."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise InputError(
            [
                f"{folder}: another quad tune works on this study; expected "
                "another folder with --output"
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
        raise InputError([f"{path}: cannot read as a study: {error}"]) from error
    # The identity as it comes back from JSON: tuples are lists there.
    wanted: Dict[str, Any] = json.loads(identity_text(identity))
    found = study.user_attrs.get(_IDENTITY)
    if found is None:
        study.set_user_attr(_IDENTITY, wanted)
    elif found != wanted:
        raise InputError(
            [
                f"{folder}: the folder holds another study: {line}; expected the same "
                "options, or another folder with --output"
                for line in json_differences(found, wanted)
            ]
        )
    return TuneStudy(study, journal)


def json_differences(there: Any, here: Any, place: str = "") -> Sequence[str]:
    """Describe where two JSON values differ, for example "seed was 0 and is 1"."""
    if isinstance(there, dict) and isinstance(here, dict):
        return [
            line
            for key in sorted({*there, *here})
            for line in json_differences(
                there.get(key), here.get(key), f"{place}/{key}".lstrip("/")
            )
        ]
    if isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        return [
            line
            for k, (one, other) in enumerate(zip(there, here))
            for line in json_differences(one, other, f"{place}[{k}]")
        ]
    return [] if there == here else [f"{place} was {_shown(there)} and is {_shown(here)}"]


def _shown(value: Any) -> str:
    return "absent" if value is None else json.dumps(value)
