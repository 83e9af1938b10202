"""Flights as a comparison needs them, and how their parameters and set-ups differ."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from quad_nav.config.differences import difference_list, number_text, with_common_costmaps
from quad_nav.recording.trace import FlightTrace, RobotTrace
from quad_nav.report.flight_metrics import FlightMetrics, flight_metrics
from quad_nav.report.plot import sample
from quad_nav.sim.contacts import Contact
from quad_nav.sim.scene import Scene

_LINES = 100  # robots of all flights for which paths are thinned out: many traces need much memory
_UNKNOWN = "unknown"


@dataclass(frozen=True)
class ComparedFlight:
    """Flight without most of its trace.

    Attributes:
        metrics: Its metrics.
        robots: Its robots with fewer samples, and without commands, cycles, plans and parameters.
        contacts: Its contacts.
        scene: Its scene, if known.
        setting: Texts about its set-up by their names.
        differences: Its parameters that differ from move_base's defaults, as ``difference_list``
            returns them; None if the recording has no parameters.
    """

    metrics: FlightMetrics
    robots: Tuple[RobotTrace, ...]
    contacts: Tuple[Contact, ...]
    scene: Optional[Scene]
    setting: Mapping[str, str]
    differences: Optional[List[Dict[str, Any]]]


@dataclass(frozen=True)
class Variant:
    """Flights with the same parameters and set-up, apart from the seed.

    Attributes:
        label: The configuration's name, with a letter if several variants have it.
        numbers: Numbers of the flights, from 1.
    """

    label: str
    numbers: Tuple[int, ...]


@dataclass(frozen=True)
class DifferenceRow:
    """Row of the table of differences: a value for each variant."""

    path: str
    values: Tuple[str, ...]
    default: str = ""
    unit: str = ""


def compared_flight(trace: FlightTrace) -> ComparedFlight:
    """Keep of a trace what a comparison needs."""
    trees = {robot.name: robot.parameters for robot in trace.robots}
    scene = trace.scene
    setting = {
        "scene": _UNKNOWN
        if scene is None
        else f"{scene.name}, {scene.size_x_m:g} m × {scene.size_y_m:g} m",
        "quadcopters": str(len(trace.robots)),
        "largest jitter": _UNKNOWN if trace.jitter_m is None else f"{trace.jitter_m:g} m",
        **{f"version of {name}": version for name, version in trace.versions.items()},
    }
    return ComparedFlight(
        flight_metrics(trace),
        tuple(map(_thinned, trace.robots)),
        trace.contacts,
        scene,
        setting,
        difference_list(trees) if any(trees.values()) else None,
    )


def _thinned(robot: RobotTrace) -> RobotTrace:
    shown, none = sample(len(robot.times_s), _LINES), np.empty(0)
    return RobotTrace(
        robot.name,
        robot.times_s[shown],
        robot.positions_m[shown],
        robot.quaternions[shown],
        robot.velocities[shown],
        none,
        np.empty((0, 3)),
        none,
        none,
        goals=robot.goals,
    )


def variants(flights: Sequence[ComparedFlight]) -> List[Variant]:
    """Group flights with equal parameters and set-ups, in order of appearance."""
    groups: Dict[str, List[int]] = {}
    for number, flight in enumerate(flights, start=1):
        known = [flight.metrics.config_name, flight.differences, dict(flight.setting)]
        groups.setdefault(json.dumps(known, default=str), []).append(number)
    names = [flights[numbers[0] - 1].metrics.config_name or _UNKNOWN for numbers in groups.values()]
    return [
        Variant(_label(names, place), tuple(numbers))
        for place, numbers in enumerate(groups.values())
    ]


def _label(names: Sequence[str], place: int) -> str:
    name = names[place]
    same = [k for k, other in enumerate(names) if other == name]
    return name if len(same) == 1 else f"{name} ({_letters(same.index(place))})"


def _letters(number: int) -> str:
    """Return A, B, ..., Z, AA, AB, ..."""
    text = ""
    number += 1
    while number:
        number, rest = divmod(number - 1, 26)
        text = chr(ord("A") + rest) + text
    return text


def labelled(
    flights: Sequence[ComparedFlight], groups: Sequence[Variant]
) -> Tuple[FlightMetrics, ...]:
    """Return the flights' metrics with their variants' labels as names of the configuration."""
    labels = {number: group.label for group in groups for number in group.numbers}
    return tuple(
        replace(flight.metrics, config_name=labels[number])
        for number, flight in enumerate(flights, start=1)
    )


def difference_rows(
    flights: Sequence[ComparedFlight], groups: Sequence[Variant]
) -> List[DifferenceRow]:
    """Return a row for each parameter and each part of the set-up that is not equal everywhere."""
    firsts = [flights[group.numbers[0] - 1] for group in groups]
    rows = [
        DifferenceRow(name, tuple(flight.setting.get(name, "–") for flight in firsts))
        for name in dict.fromkeys(name for flight in firsts for name in flight.setting)
    ]
    entries = {entry["parameter"]: entry for flight in firsts for entry in flight.differences or ()}
    rows += with_common_costmaps(
        [
            DifferenceRow(
                path,
                tuple(_cell(flight, path, number_text(entry["default"])) for flight in firsts),
                number_text(entry["default"]),
                entry["unit"],
            )
            for path, entry in entries.items()
        ]
    )
    return [row for row in rows if len(set(row.values)) > 1]


def _cell(flight: ComparedFlight, path: str, default: str) -> str:
    """Return a parameter's value, with the robots if it is not that of all."""
    if flight.differences is None:
        return _UNKNOWN
    found = [entry for entry in flight.differences if entry["parameter"] == path]
    texts = [
        number_text(entry["value"])
        + (f" ({', '.join(entry['robots'])})" if entry["robots"] is not None else "")
        for entry in found
    ]
    return "; ".join(texts) or default
