"""Content of the charts of separations, clearances and speeds over time."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.mission.distances import nearest_separations_m
from quad_nav.recording.trace import FlightTrace
from quad_nav.report.encounters import CLOSE_M, Encounter
from quad_nav.report.marks import Marks, encounter_marks
from quad_nav.report.measures import Tracks, clearances_m, smallest, speed_mps

_SHOWN_M = 3.0  # larger distances are cut off, apart from the smallest one
_FEW = 4  # more lines cannot be followed one by one


@dataclass(frozen=True)
class Curve:
    """A value of a robot over time: arrays of shape (k,), NaN where it is unknown."""

    times_s: NDArray[np.float64]
    values: NDArray[np.float64]


@dataclass(frozen=True)
class Panel:
    """Values of all robots over time.

    Attributes:
        title: Heading.
        unit: Unit of the values.
        curves: The curve of each robot.
        least: The smallest value at each time, where that counts: for distances.
        close: The value below which there is an encounter, if there is one.
        marks: Encounters.
    """

    title: str
    unit: str
    curves: Sequence[Curve]
    least: Optional[Curve] = None
    close: Optional[float] = None
    marks: Tuple[Marks, ...] = ()

    @property
    def quantity(self) -> str:
        """What is shown, in one word."""
        return self.title.split()[0].lower()

    @property
    def is_crowded(self) -> bool:
        """Whether there are too many curves to follow one by one."""
        return len(self.curves) > _FEW

    @property
    def shown(self) -> List[float]:
        """Range of distances that is shown; the smallest one is inside."""
        least = 0.0 if self.least is None else smallest(self.least.values) or 0.0
        return [min(-0.1, least - 0.05), max(_SHOWN_M, 1.25 * least)]


def distance_panels(
    trace: FlightTrace, tracks: Tracks, marked: Sequence[Encounter] = ()
) -> List[Panel]:
    """Return a panel for each distance that can be told; those ``marked`` keep their letters.

    The distance of a robot that touches something is 0 then.
    """
    panels = []
    if len(trace.robots) > 1:
        gaps_m = nearest_separations_m(tracks.positions_m, trace.robot_radius_m)
        gaps_m = _touching(trace, tracks, gaps_m, True)
        pairs = [one.other is not None for one in marked]
        marks = encounter_marks(
            marked,
            [one.time_s if is_pair else np.nan for one, is_pair in zip(marked, pairs)],
            [one.separation_m for one in marked],
        )
        title = "Separation from the nearest robot"
        panels.append(_gap_panel(title, tracks, gaps_m, CLOSE_M, marks if any(pairs) else ()))
    if trace.scene is not None:
        gaps_m = _touching(trace, tracks, clearances_m(tracks, trace), False)
        panels.append(_gap_panel("Clearance to the nearest obstacle or wall", tracks, gaps_m))
    return panels


def speed_panel(trace: FlightTrace) -> Panel:
    """Return the panel of speeds."""
    return Panel("Speed", "m/s", [Curve(robot.times_s, speed_mps(robot)) for robot in trace.robots])


def _gap_panel(
    title: str,
    tracks: Tracks,
    gaps_m: NDArray[np.float64],
    close: Optional[float] = None,
    marks: Tuple[Marks, ...] = (),
) -> Panel:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # times without any sample
        least = np.asarray(np.nanmin(gaps_m, axis=0)) if gaps_m.size else np.empty(0)
    curves = [Curve(tracks.times_s, gap_m) for gap_m in gaps_m]
    return Panel(title, "m", curves, Curve(tracks.times_s[: len(least)], least), close, marks)


def _touching(
    trace: FlightTrace, tracks: Tracks, gaps_m: NDArray[np.float64], robots: bool
) -> NDArray[np.float64]:
    """Set distances, shape (n, t), to 0 at contacts, and negative ones of robots with a contact.

    ``robots`` tells whether they, and the contacts, are those between robots.
    """
    numbers = {robot.name: k for k, robot in enumerate(trace.robots)}
    gaps_m = gaps_m.copy()
    for contact in trace.contacts:
        involved = [numbers[name] for name in (contact.robot, contact.other) if name in numbers]
        if (len(involved) == 2) is robots and len(tracks.times_s):
            gaps_m[involved] = np.maximum(gaps_m[involved], 0.0)
            gaps_m[involved, tracks.index_at(contact.time_s)] = 0.0
    return gaps_m
