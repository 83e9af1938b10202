"""Find close encounters between robots, and contacts with obstacles."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Dict, List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.mission.distances import nearest_separations_m, separations_m
from quad_nav.recording.trace import FlightTrace
from quad_nav.report.measures import Tracks, clearances_m, runs

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
        other: Number of the other robot; None for an obstacle or wall.
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

    @property
    def is_contact(self) -> bool:
        """Whether it is the contact with an obstacle."""
        return self.other is None and self.separation_m == 0.0

    @property
    def is_close(self) -> bool:
        """Whether it is more than the closest moment of a flight without encounters."""
        return self.is_contact or (self.other is not None and self.separation_m < CLOSE_M)


def closest_moment(trace: FlightTrace, tracks: Tracks) -> Tuple[Encounter, ...]:
    """Return when two robots, or a lone one and an obstacle, were closest; empty if unknown."""
    is_alone = len(trace.robots) < 2
    gaps_m = (
        clearances_m(tracks, trace)
        if is_alone
        else nearest_separations_m(tracks.positions_m, trace.robot_radius_m)
    )
    if not np.isfinite(gaps_m).any():
        return ()
    robot, now = map(int, np.unravel_index(np.nanargmin(gaps_m), gaps_m.shape))
    gap_m, time_s = float(gaps_m[robot, now]), float(tracks.times_s[now])
    here = tracks.positions_m[:, now]
    name = trace.robots[robot].name
    if is_alone:
        names = (name, "the nearest obstacle or wall")
        return (Encounter(robot, None, names, time_s, gap_m, *here[robot].tolist()),)
    distances_m = np.hypot(*(here - here[robot]).T)
    distances_m[robot] = np.nan
    other = int(np.nanargmin(distances_m))
    names = (name, trace.robots[other].name)
    middle = here[[robot, other]].mean(axis=0).tolist()
    return (Encounter(robot, other, names, time_s, gap_m, *middle),)


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
