"""Find close encounters between robots, and contacts with obstacles."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Dict, List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.mission.distances import separations_m
from quad_nav.recording.trace import FlightTrace
from quad_nav.report.measures import Tracks, runs

CLOSE_M = 0.5
"""Separation below which two robots have a close encounter."""
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
"""Names of encounters in pictures, in order."""
SAME_ENCOUNTER_S = 3.0
"""Close distances within this time belong to one encounter."""


@dataclass(frozen=True)
class Encounter:
    """Closest moment of an encounter.

    Attributes:
        robot: Number of a robot.
        other: Number of the other robot; None for an obstacle or wall, which only count on contact.
        names: Names of both.
        time_s: Time of the closest moment.
        separation_m: Distance between the hulls. 0 for a contact.
        x_m: Middle between both robots, or point of contact, in ``map``.
        y_m: See ``x_m``.
    """

    robot: int
    other: Optional[int]
    names: Tuple[str, str]
    time_s: float
    separation_m: float
    x_m: float
    y_m: float


def encounters(
    trace: FlightTrace, tracks: Tracks, below_m: float = CLOSE_M
) -> Tuple[Encounter, ...]:
    """Find the encounters of a flight: contacts with obstacles first, then the closest."""
    found = _obstacles_touched(trace)
    for a, b in itertools.combinations(range(len(trace.robots)), 2):
        found += _of_pair(trace, tracks, a, b, below_m)
    found.sort(key=lambda one: (one.other is not None, one.separation_m, one.time_s))
    return tuple(found)


def separation_text(separation_m: float) -> str:
    """A gap in words; less than a centimetre is none."""
    if abs(separation_m) < 0.005:
        return "touching"
    return f"gap {separation_m:.2f} m" if separation_m > 0 else f"overlap {-separation_m:.2f} m"


def _of_pair(trace: FlightTrace, tracks: Tracks, a: int, b: int, below_m: float) -> List[Encounter]:
    places = tracks.positions_m[a], tracks.positions_m[b]
    separation_m = separations_m(*places, trace.robot_radius_m)
    close = separation_m < below_m
    if not close.any():
        return []
    found: List[Encounter] = []
    for first, last in _joined(runs(close), tracks.times_s):
        nearest = first + int(np.nanargmin(separation_m[first : last + 1]))
        names = (trace.robots[a].name, trace.robots[b].name)
        nearest_m = float(separation_m[nearest])
        if _touched(trace, names, tracks.times_s[first], tracks.times_s[last]):
            nearest_m = 0.0
        x_m, y_m = tracks.positions_m[[a, b], nearest].mean(axis=0)
        time_s = float(tracks.times_s[nearest])
        found.append(Encounter(a, b, names, time_s, nearest_m, float(x_m), float(y_m)))
    return found


def _touched(trace: FlightTrace, names: Tuple[str, str], first_s: float, last_s: float) -> bool:
    return any(
        {contact.robot, contact.other} == set(names) and first_s <= contact.time_s <= last_s
        for contact in trace.contacts
    )


def _joined(spans: List[Tuple[int, int]], times_s: NDArray[np.float64]) -> List[Tuple[int, int]]:
    """Join periods of close distance that are less than ``SAME_ENCOUNTER_S`` apart."""
    joined = spans[:1]
    for first, last in spans[1:]:
        if times_s[first] - times_s[joined[-1][1]] < SAME_ENCOUNTER_S:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    return joined


def _obstacles_touched(trace: FlightTrace) -> List[Encounter]:
    numbers = {robot.name: k for k, robot in enumerate(trace.robots)}
    last_s: Dict[Tuple[str, str], float] = {}
    found = []
    for contact in trace.contacts:
        if contact.robot not in numbers or contact.other in numbers:
            continue
        pair = (contact.robot, contact.other)
        if contact.time_s - last_s.get(pair, -np.inf) >= SAME_ENCOUNTER_S:
            robot, place = numbers[contact.robot], (contact.x_m, contact.y_m)
            found.append(Encounter(robot, None, pair, contact.time_s, 0.0, *place))
        last_s[pair] = contact.time_s
    return found
