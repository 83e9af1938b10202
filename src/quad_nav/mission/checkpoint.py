"""Checkpoints of a mission: records of a journal, and the state that a sequencer resumes from.

Times in a journal are seconds since the start of the mission, so that they outlive the clock.
``start_s`` is the time of the present clock at the start of the mission.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, TypeVar

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.mission.flight_log import FlightLog, Leg, RobotLogState
from quad_nav.mission.goal_file import Goal
from quad_nav.mission.sequencer import START, ActiveGoal, SequenceProgress, Sequencer
from quad_nav.sim.contacts import Contact

T = TypeVar("T")


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
    active = sequencer.active_goal
    state = dataclasses.asdict(dataclasses.replace(log.robots[name].state, legs=()))
    del state["legs"]  # each has a record of its own
    clearance_m, separation_m = log.distances.recent_minima_m(name)
    return {
        "robot": name,
        "index": sequencer.index,
        "lap": sequencer.lap,
        "active_goal": None if active is None else dataclasses.asdict(_shifted(active, -start_s)),
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
    except (KeyError, TypeError, ValueError) as error:
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
            contacts.append(Contact(**record["contact"]))
        elif "robot" in record:
            name = record["robot"]
            robots[name] = _read_robot(robots[name], record)
        else:
            head = record
    last = records[-1]
    return MissionCheckpoint(
        float(head["clock_s"]),
        float(head["epoch_s"]),
        float(last.get("mission_s", 0.0)),
        float(last.get("wall_s", 0.0)),
        robots,
        tuple(contacts),
    )


def _read_robot(before: RobotCheckpoint, record: Mapping[str, Any]) -> RobotCheckpoint:
    legs = before.log.legs
    if record["leg"] is not None:
        legs = (*legs, Leg(**{**record["leg"], "goal": Goal(**record["leg"]["goal"])}))
    state = dict(record["log"])
    for key in ("leg_start", "pose"):
        state[key] = _instance(state[key], Pose2D)
    active = record["active_goal"]
    if active is not None:
        goal, pose = Goal(**active["goal"]), Pose2D(**active["pose"])
        active = ActiveGoal(**{**active, "goal": goal, "pose": pose})
    return RobotCheckpoint(
        SequenceProgress(int(record["index"]), int(record["lap"]), active),
        RobotLogState(legs=legs, **state),
        record["clearance_m"],
        record["separation_m"],
    )


def shift_to_clock(progress: SequenceProgress, start_s: float) -> SequenceProgress:
    """Shift times since the start of the mission to a clock that was ``start_s`` then."""
    if progress.active_goal is None:
        return progress
    return dataclasses.replace(progress, active_goal=_shifted(progress.active_goal, start_s))


def _shifted(active: ActiveGoal, by_s: float) -> ActiveGoal:
    return dataclasses.replace(
        active, first_sent_s=active.first_sent_s + by_s, sent_s=active.sent_s + by_s
    )


def _instance(values: Optional[Mapping[str, Any]], kind: Callable[..., T]) -> Optional[T]:
    return None if values is None else kind(**values)
