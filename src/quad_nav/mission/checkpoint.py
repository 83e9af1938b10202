"""Checkpoints of a mission: records of a journal, and the state that a sequencer resumes from.

Times in a journal are seconds since the start of the mission, so that they outlive the clock.
``start_s`` is the time of the present clock at the start of the mission.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from functools import lru_cache
from typing import (
    Any,
    Callable,
    Dict,
    List,
    Mapping,
    Optional,
    Sequence,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from quad_nav.errors import InputError
from quad_nav.files.values import is_number, is_whole
from quad_nav.mission.flight_log import FlightLog, Leg, RobotLogState
from quad_nav.mission.progress import START, ActiveGoal, Dwell, SequenceProgress
from quad_nav.mission.sequencer import Sequencer
from quad_nav.sim.contacts import Contact

T = TypeVar("T")
_LARGEST = 10**9  # of a counter
# Records have one each of the legs; older journals lack the others, which then have their defaults.
_MAY_LACK = {"legs", "wait_s", "tolerance_m", "yaw_tolerance_rad", "yaw_error_rad"}
_ACCEPTS: Dict[Any, Callable[[Any], bool]] = {
    float: is_number,
    int: lambda value: is_whole(value) and abs(value) <= _LARGEST,
    bool: lambda value: isinstance(value, bool),
    str: lambda value: isinstance(value, str),
}


@dataclass(frozen=True)
class RobotCheckpoint:
    """Progress, log and smallest distances of one robot; distances are None if unknown."""

    progress: SequenceProgress = START
    log: RobotLogState = field(default_factory=RobotLogState)
    clearance_m: Optional[float] = None
    separation_m: Optional[float] = None


@dataclass(frozen=True)
class MissionCheckpoint:
    """State of a mission.

    Attributes:
        clock_s: Time of the clock at the start of the mission.
        epoch_s: Unix time at the start of the mission.
        mission_s: Time of the clock that has passed since.
        wall_s: Wall time that has passed since.
        robots: Checkpoints by the robots' names.
        contacts: All contacts so far.
    """

    clock_s: float
    epoch_s: float
    mission_s: float = 0.0
    wall_s: float = 0.0
    robots: Mapping[str, RobotCheckpoint] = field(default_factory=dict)
    contacts: Sequence[Contact] = ()


def head_record(names: Sequence[str], clock_s: float, epoch_s: float) -> Dict[str, Any]:
    """Return the first record of a journal, and of each part that a resumed mission adds."""
    return {"robots": list(names), "clock_s": clock_s, "epoch_s": epoch_s}


def robot_record(
    name: str, sequencer: Sequencer, log: FlightLog, leg: Optional[Leg], start_s: float
) -> Dict[str, Any]:
    """Return the record of a robot's state; ``leg`` is the leg that has just ended, if any."""
    progress = sequencer.progress.shifted(-start_s)
    active, dwell = progress.active_goal, progress.dwell
    state = dataclasses.asdict(dataclasses.replace(log.robots[name].state, legs=()))
    del state["legs"]  # each has a record of its own
    clearance_m, separation_m = log.distances.recent_minima_m(name)
    return {
        "robot": name,
        "index": progress.index,
        "lap": progress.lap,
        "active_goal": None if active is None else dataclasses.asdict(active),
        "dwell": None if dwell is None else dataclasses.asdict(dwell),
        "held_s": progress.held_s,
        "log": state,
        "leg": None if leg is None else dataclasses.asdict(leg),
        "clearance_m": clearance_m,
        "separation_m": separation_m,
    }


def contact_record(contact: Contact, start_s: float) -> Dict[str, Any]:
    """Return the record of a contact."""
    return {
        "contact": dataclasses.asdict(dataclasses.replace(contact, time_s=contact.time_s - start_s))
    }


def read_checkpoint(
    records: Sequence[Mapping[str, Any]], names: Sequence[str], source: str
) -> Optional[MissionCheckpoint]:
    """Return the state of a mission at the end of its journal, None if no robot has started.

    Args:
        records: The records of the journal.
        names: Names of the robots of the mission.
        source: Name of the journal, for messages.

    Raises:
        InputError: The journal is of other robots or of another version.
    """
    if not any("robot" in record for record in records):
        return None
    if records[0].get("robots") != list(names):
        raise InputError(
            [
                f"{source}: is the journal of {records[0].get('robots')}; expected one "
                f"of {list(names)}. Remove it to start with the first goals"
            ]
        )
    try:
        return _read_mission(records, names)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            [
                f"{source}: cannot be read: {error!r}; expected a journal of this "
                "version. Remove it to start with the first goals"
            ]
        ) from error


def _read_mission(records: Sequence[Mapping[str, Any]], names: Sequence[str]) -> MissionCheckpoint:
    robots = {name: RobotCheckpoint() for name in names}
    contacts: List[Contact] = []
    head: Mapping[str, Any] = {}
    for record in records:
        if "contact" in record:
            contacts.append(_instance(record["contact"], Contact))
        elif "robot" in record:
            name = record["robot"]
            robots[name] = _read_robot(robots[name], record)
        else:
            head = record
    times_s = [_value(record.get("mission_s", 0.0), float) for record in records]
    return MissionCheckpoint(
        _value(head["clock_s"], float),
        _value(head["epoch_s"], float),
        max(times_s),  # the threads of the robots do not add their records in order
        _value(records[-1].get("wall_s", 0.0), float),
        robots,
        tuple(contacts),
    )


def _read_robot(before: RobotCheckpoint, record: Mapping[str, Any]) -> RobotCheckpoint:
    legs = before.log.legs
    if record["leg"] is not None:
        legs = (*legs, _instance(record["leg"], Leg))
    progress = SequenceProgress(
        _value(record["index"], int),
        _value(record["lap"], int),
        _value(record["active_goal"], Optional[ActiveGoal]),
        _value(record.get("dwell"), Optional[Dwell]),
        _value(record.get("held_s"), Optional[float]),
    )
    if progress.index < 0 or progress.lap < 1:
        raise ValueError(f"goal {progress.index} of lap {progress.lap}, expected 0 or more of 1")
    return RobotCheckpoint(
        progress,
        dataclasses.replace(_instance(record["log"], RobotLogState), legs=legs),
        _value(record["clearance_m"], Optional[float]),
        _value(record["separation_m"], Optional[float]),
    )


def _instance(values: Any, kind: Callable[..., T]) -> T:
    """Return a dataclass of a JSON object, with the types of its fields."""
    if not isinstance(values, dict):
        raise TypeError(f"{values!r:.40}, expected an object")
    hints = _hints(kind)
    missing = sorted(set(hints) - set(values) - _MAY_LACK)
    if missing:
        raise KeyError(missing[0])
    return kind(**{key: _value(value, hints[key]) for key, value in values.items()})


@lru_cache(maxsize=None)
def _hints(kind: Callable[..., Any]) -> Dict[str, Any]:
    return get_type_hints(kind)


def _value(value: Any, hint: Any) -> Any:
    """Return a JSON value of a type: a number, a text, a dataclass, or None if it is optional."""
    if get_origin(hint) is Union:
        return None if value is None else _value(value, get_args(hint)[0])
    if hint not in _ACCEPTS:
        return _instance(value, hint)
    if not _ACCEPTS[hint](value):
        raise TypeError(f"{value!r:.40}, expected a value of the type {hint.__name__}")
    return value
