"""Folder of a study: Optuna's study and the flight cache in one SQLite file.

A trial is written after its generation, in one transaction. An unfinished generation exists only
as cached flights, so a study needs no repair after kill -9. A file that was damaged otherwise is
rejected before anything flies.
"""

from __future__ import annotations

import json
import os
import sqlite3
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Set

import optuna
import sqlalchemy.exc
from optuna.study import StudyDirection
from optuna.trial import FrozenTrial, TrialState

from quad_nav.errors import InputError
from quad_nav.files import system
from quad_nav.files.output import make_folder
from quad_nav.files.values import is_number, is_whole
from quad_tune.courses import identity_text
from quad_tune.flight_cache import FlightCache
from quad_tune.proposals import distributions
from quad_tune.robot_limits import is_limit
from quad_tune.space import SearchSpace
from quad_tune.statistics import STATISTICS, statistics_faults
from quad_tune.study_database import NotStored, advice, reason

FILE = "study.db"
_LOCK = ".lock"
_NAME = "quad tune"
_IDENTITY = "identity"
_SPACE = "space"
_LIMIT_HINT = " (a limit of the robot, searched only with --free-speed)"
_FINISHED = (TrialState.COMPLETE, TrialState.PRUNED)
_STORAGE_ERRORS = (
    sqlite3.Error,
    sqlalchemy.exc.SQLAlchemyError,
    optuna.exceptions.OptunaError,
    LookupError,
    ValueError,
)


class TuneStudy:
    """Trials and cached flights of a study; created by ``open_study``."""

    def __init__(
        self, study: optuna.Study, path: Path, journal: FlightCache, trials: List[FrozenTrial]
    ) -> None:
        self._study = study
        self._path = path
        self.journal = journal
        self.trials = trials
        """Finished trials in order."""

    def add(self, trial: FrozenTrial) -> None:
        """Store a finished trial.

        Raises:
            NotStored: It is in ``trials`` only, because the file cannot be written.
        """
        trial.number = len(self.trials)
        self.trials.append(trial)
        try:
            self._study.add_trial(trial)
        except _STORAGE_ERRORS as error:
            raise NotStored(
                f"{self._path}: cannot store a candidate: {reason(error)}; {advice(error)}"
            ) from error


@contextmanager
def open_study(
    folder: Path, identity: Mapping[str, Any], space: Optional[SearchSpace] = None
) -> Iterator[TuneStudy]:
    """Open the study in a folder, or create one.

    Args:
        folder: Folder of the study.
        identity: Everything that the study depends on.
        space: Searched parameters; None accepts trials of any parameters.

    Raises:
        InputError: Another process works on the study, the study has another identity, its file
            is damaged, or the folder cannot be used.
    """
    try:
        make_folder(folder)
        lock = os.open(folder / _LOCK, os.O_CREAT | os.O_RDWR, 0o644)
    except OSError as error:
        raise InputError([f"{folder}: {error.strerror}; expected a folder to write to"]) from error
    try:
        _take(lock, folder)
        study = _read(folder, identity, space)
        yield study
    finally:
        os.close(lock)


def _take(lock: int, folder: Path) -> None:
    """Lock the study; the lock ends with the process."""
    try:
        system.lock(lock)
    except BlockingIOError as error:
        raise InputError(
            [
                f"{folder}: another quad tune works on this study; expected "
                "another folder with --output"
            ]
        ) from error


def _read(folder: Path, identity: Mapping[str, Any], space: Optional[SearchSpace]) -> TuneStudy:
    path = folder / FILE
    journal = FlightCache(path)  # checks the file before Optuna opens it
    # The identity as it comes back from JSON: tuples are lists there.
    wanted: Dict[str, Any] = json.loads(identity_text(identity))
    try:
        study = optuna.create_study(
            storage=f"sqlite:///{path}", study_name=_NAME, load_if_exists=True
        )
        trials = list(study.get_trials())
        directions, found = study.directions, study.user_attrs.get(_IDENTITY)
        if found is None and not trials and not len(journal):
            study.set_user_attr(_IDENTITY, wanted)
            found = wanted
    except Exception as error:  # Optuna raises errors of any type for rows that it did not write
        raise InputError(
            [f"{path}: cannot read as a study: {reason(error)}; {advice(error)}"]
        ) from error
    if found is not None and found != wanted:
        raise InputError(
            [
                f"{folder}: the folder holds another study: {line}; expected the same "
                "options, or another folder with --output"
                for line in json_differences(found, wanted) or ["its options differ"]
            ]
        )
    faults = ["has flights, but not the options of the study"] if found is None else []
    if directions != [StudyDirection.MINIMIZE]:
        faults.append("is a study of another goal than the lowest cost")
    faults += [
        line for number, trial in enumerate(trials) for line in _faults(number, trial, space)
    ]
    if faults:
        raise InputError([f"{path}: {line}; {advice(ValueError())}" for line in faults])
    return TuneStudy(study, path, journal, trials)


def _faults(number: int, trial: FrozenTrial, space: Optional[SearchSpace]) -> List[str]:
    """Return the faults of a trial that Optuna can read."""
    faults = []
    if trial.number != number:
        faults.append(f"has the number {trial.number}")
    if trial.state not in _FINISHED or trial.values is None or len(trial.values) != 1:
        faults.append(f"is {trial.state.name} with the costs {trial.values}; expected one cost")
    means = trial.intermediate_values
    if not means or not all(is_whole(count) and count > 0 for count in means):
        faults.append(f"has costs after {list(means)} flights")
    if not all(map(is_number, [*(trial.values or ()), *means.values()])):
        faults.append("has a cost that is not a finite number")
    if space is not None and trial.distributions != distributions(space):
        faults.append("has other parameters than the study")
    try:
        optuna.create_trial(value=0.0, params=trial.params, distributions=trial.distributions)
    except (ValueError, TypeError, OverflowError) as error:
        faults.append(f"has a parameter outside of its range: {error}")
    faults += statistics_faults(trial.user_attrs.get(STATISTICS))
    return [f"candidate {number}: {line}" for line in faults]


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
    if place == _SPACE and isinstance(there, list) and isinstance(here, list):
        searched, now = _paths_of(there), _paths_of(here)
        if searched != now:
            return [
                f"{path} was {'searched and is not' if path in searched else 'not searched and is'}"
                f"{_LIMIT_HINT if is_limit(path) else ''}"
                for path in sorted(searched ^ now)
            ]
    if isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        return [
            line
            for k, (one, other) in enumerate(zip(there, here))
            for line in json_differences(one, other, f"{place}[{k}]")
        ]
    return [] if there == here else [f"{place} was {_shown(there)} and is {_shown(here)}"]


def _paths_of(space: Sequence[Any]) -> Set[str]:
    """Return the paths of a serialized space."""
    return {entry["path"] for entry in space if isinstance(entry, dict) and "path" in entry}


def _shown(value: Any) -> str:
    return "absent" if value is None else json.dumps(value)
