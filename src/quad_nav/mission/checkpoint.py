"""How a mission stands: what a journal keeps of it, and what another sequencer makes of that.

Times in a journal are seconds since the mission began, so they outlast the clock that
they were read on; ``start_s`` is what the present clock said then.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, TypeVar

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.mission.flight_log import FlightLog, Flown, Leg
from quad_nav.mission.goal_sequence import Goal
from quad_nav.mission.sequencer import BEGINNING, Flight, Sequencer, Stage
from quad_nav.sim.contacts import Contact

T = TypeVar("T")


@dataclass(frozen=True)
class RobotCheckpoint:
    """Where in its goals a quadcopter is, and what it has flown.

    ``clearance_m`` and ``separation_m`` are the smallest gaps so far, None when not known.
    """

    stage: Stage = BEGINNING
    flown: Flown = field(default_factory=Flown)
    clearance_m: Optional[float] = None
    separation_m: Optional[float] = None


@dataclass(frozen=True)
class MissionCheckpoint:
    """All quadcopters', by name; ``epoch_s`` is Unix time and ``clock_s`` the clock's at the
    beginning, ``mission_s`` and ``wall_s`` what has passed since.
    """

    clock_s: float
    epoch_s: float
    mission_s: float = 0.0
    wall_s: float = 0.0
    robots: Mapping[str, RobotCheckpoint] = field(default_factory=dict)
    contacts: Sequence[Contact] = ()


def head(names: Sequence[str], clock_s: float, epoch_s: float) -> Dict[str, Any]:
    """The first line of a journal, and of its part from the next sequencer on."""
    return {"robots": list(names), "clock_s": clock_s, "epoch_s": epoch_s}


def robot_record(
    name: str, sequencer: Sequencer, log: FlightLog, leg: Optional[Leg], start_s: float
) -> Dict[str, Any]:
    """How a quadcopter stands now; ``leg`` is the one that has just ended, if one has."""
    flight = sequencer.flight
    figures = dataclasses.asdict(dataclasses.replace(log.robots[name].flown, legs=()))
    del figures["legs"]  # each has its line
    clearance_m, separation_m = log.distances.minima_of_blocks_m(name)
    return {
        "robot": name,
        "index": sequencer.index,
        "lap": sequencer.lap,
        "flight": None if flight is None else dataclasses.asdict(_moved(flight, -start_s)),
        "flown": figures,
        "leg": None if leg is None else dataclasses.asdict(leg),
        "clearance_m": clearance_m,
        "separation_m": separation_m,
    }


def contact_record(contact: Contact, start_s: float) -> Dict[str, Any]:
    return {
        "contact": dataclasses.asdict(dataclasses.replace(contact, time_s=contact.time_s - start_s))
    }


def standing(
    records: Sequence[Mapping[str, Any]], names: Sequence[str], where: str
) -> Optional[MissionCheckpoint]:
    """How the mission of a journal stands, None when nothing had begun.

    Raises:
        InputError: the journal, called ``where``, is of other quadcopters, or has something
            that no sequencer writes.
    """
    if not any("robot" in record for record in records):
        return None
    if records[0].get("robots") != list(names):
        raise InputError(
            [
                f"{where}: is the journal of {records[0].get('robots')}; expected one "
                f"of {list(names)}. Remove it to begin with the first goals"
            ]
        )
    try:
        return _standing(records, names)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            [
                f"{where}: cannot be understood: {error!r}; expected a journal of this "
                "version. Remove it to begin with the first goals"
            ]
        ) from error


def _standing(records: Sequence[Mapping[str, Any]], names: Sequence[str]) -> MissionCheckpoint:
    robots = {name: RobotCheckpoint() for name in names}
    contacts: List[Contact] = []
    latest: Mapping[str, Any] = {}
    for record in records:
        if "contact" in record:
            contacts.append(Contact(**record["contact"]))
        elif "robot" in record:
            name = record["robot"]
            robots[name] = _after(robots[name], record)
        else:
            latest = record
    last = records[-1]
    return MissionCheckpoint(
        float(latest["clock_s"]),
        float(latest["epoch_s"]),
        float(last.get("mission_s", 0.0)),
        float(last.get("wall_s", 0.0)),
        robots,
        tuple(contacts),
    )


def _after(before: RobotCheckpoint, record: Mapping[str, Any]) -> RobotCheckpoint:
    legs = before.flown.legs
    if record["leg"] is not None:
        legs = (*legs, Leg(**{**record["leg"], "goal": Goal(**record["leg"]["goal"])}))
    figures = dict(record["flown"])
    for key in ("leg_start", "pose"):
        figures[key] = _made(figures[key], Pose2D)
    flight = record["flight"]
    if flight is not None:
        flight = Flight(
            **{**flight, "goal": Goal(**flight["goal"]), "pose": Pose2D(**flight["pose"])}
        )
    return RobotCheckpoint(
        Stage(int(record["index"]), int(record["lap"]), flight),
        Flown(legs=legs, **figures),
        record["clearance_m"],
        record["separation_m"],
    )


def on_clock(stage: Stage, start_s: float) -> Stage:
    """A stage of a journal in the time of a clock that said ``start_s`` when it began."""
    if stage.flight is None:
        return stage
    return dataclasses.replace(stage, flight=_moved(stage.flight, start_s))


def _moved(flight: Flight, by_s: float) -> Flight:
    return dataclasses.replace(
        flight, first_sent_s=flight.first_sent_s + by_s, sent_s=flight.sent_s + by_s
    )


def _made(values: Optional[Mapping[str, Any]], kind: Callable[..., T]) -> Optional[T]:
    return None if values is None else kind(**values)
