"""When quadcopters came close to each other, and what they touched."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Dict, List, Optional, Tuple

import numpy as np

from quad_nav.recording.trace import FlightTrace
from quad_nav.report.measures import Tracks, pair_separations_m, runs

CLOSE_M = 0.5
"""Two hulls that are less than this apart have a close encounter."""
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
"""Names of encounters in pictures, the first ones' in order."""
SAME_ENCOUNTER_S = 3.0
"""What comes again within this time is the same encounter still."""


@dataclass(frozen=True)
class Encounter:
    """The closest moment of an encounter.

    ``robot`` and ``other`` are numbers of quadcopters; ``other`` is None for an obstacle or
    wall, which only what was touched counts as. ``gap_m`` is between hulls, NaN for an
    obstacle, and at most 0 when the two touched: that may have been between two poses.
    ``x_m``, ``y_m``: the middle between the two, or where it touched.
    """

    robot: int
    other: Optional[int]
    names: Tuple[str, str]
    time_s: float
    gap_m: float
    x_m: float
    y_m: float


def encounters(
    trace: FlightTrace, among: Tracks, below_m: float = CLOSE_M
) -> Tuple[Encounter, ...]:
    """Obstacles that were touched first, then quadcopters, closest first."""
    found = _obstacles_touched(trace)
    for a, b in itertools.combinations(range(len(trace.robots)), 2):
        found += _of_pair(trace, among, a, b, below_m)
    return tuple(sorted(found, key=lambda one: (one.other is not None, one.gap_m, one.time_s)))


def gap_text(gap_m: float) -> str:
    """A gap in words; less than a centimetre is none."""
    if abs(gap_m) < 0.005:
        return "touching"
    return f"gap {gap_m:.2f} m" if gap_m > 0 else f"overlap {-gap_m:.2f} m"


def _of_pair(trace: FlightTrace, among: Tracks, a: int, b: int, below_m: float) -> List[Encounter]:
    gap_m = pair_separations_m(among, a, b, trace.robot_radius_m)
    close = gap_m < below_m
    if not close.any():
        return []
    found: List[Encounter] = []
    for first, last in _joined(runs(close), among.times_s):
        nearest = first + int(np.nanargmin(gap_m[first : last + 1]))
        names = (trace.robots[a].name, trace.robots[b].name)
        nearest_m = float(gap_m[nearest])
        if _touched(trace, names, among.times_s[first], among.times_s[last]):
            nearest_m = min(nearest_m, 0.0)
        x_m, y_m = among.positions_m[[a, b], nearest].mean(axis=0)
        found.append(
            Encounter(a, b, names, float(among.times_s[nearest]), nearest_m, float(x_m), float(y_m))
        )
    return found


def _touched(trace: FlightTrace, names: Tuple[str, str], first_s: float, last_s: float) -> bool:
    return any(
        {contact.robot, contact.other} == set(names) and first_s <= contact.time_s <= last_s
        for contact in trace.contacts
    )


def _joined(spans: List[Tuple[int, int]], times_s: np.ndarray) -> List[Tuple[int, int]]:
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
            found.append(
                Encounter(
                    numbers[contact.robot],
                    None,
                    pair,
                    contact.time_s,
                    np.nan,
                    contact.x_m,
                    contact.y_m,
                )
            )
        last_s[pair] = contact.time_s
    return found
