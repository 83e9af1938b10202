"""Picture of the separations and clearances over time."""

from __future__ import annotations

import warnings
from typing import List, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from quad_nav.recording.trace import FlightTrace
from quad_nav.report.encounters import CLOSE_M, LETTERS, Encounter
from quad_nav.report.measures import Tracks, clearances_m, separations_m
from quad_nav.report.style import ALARM, QUIET, colour, new_figure, robot_legend, time_axis

SHOWN_M = 3.0
"""Larger distances are cut off."""
_FEW = 4  # more lines cannot be followed one by one


def distance_picture(
    trace: FlightTrace, tracks: Tracks, marked: Sequence[Encounter] = ()
) -> Figure:
    """Draw a panel for each measured distance; ``marked`` encounters keep their letters."""
    panels = shown_gaps(trace, tracks)
    figure = new_figure(0.6 + 2.1 * max(len(panels), 1))
    column = figure.subplots(max(len(panels), 1), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (title, gaps_m) in zip(column, panels):
        _draw_gaps(axes, title, tracks.times_s, gaps_m)
        for contact in trace.contacts:
            axes.axvline(contact.time_s, color=ALARM, lw=0.9, ls="--")
    if len(trace.robots) > 1:
        _draw_letters(column[0], marked)
    time_axis(column[-1])
    robot_legend(figure, [robot.name for robot in trace.robots])
    return figure


def shown_gaps(trace: FlightTrace, tracks: Tracks) -> List[Tuple[str, NDArray[np.float64]]]:
    """Return title and distances, shape (n, t), of each panel of distances.

    The distance of a robot that touches something is 0 then.
    """
    panels = []
    if len(trace.robots) > 1:
        separations = separations_m(tracks, trace.robot_radius_m)
        panels.append(
            ("Separation from the nearest robot", _touching(trace, tracks, separations, True))
        )
    if trace.scene is not None:
        clearances = clearances_m(tracks, trace)
        panels.append(
            (
                "Clearance to the nearest obstacle or wall",
                _touching(trace, tracks, clearances, False),
            )
        )
    return panels


def _touching(
    trace: FlightTrace, tracks: Tracks, gaps_m: NDArray[np.float64], robots: bool
) -> NDArray[np.float64]:
    """Set the distances to 0 at contacts, and negative ones of robots with a contact.

    Args:
        trace: Trace of the flight.
        tracks: Its tracks.
        gaps_m: Distances, shape (n, t).
        robots: Whether the distances, and the contacts, are those between robots.
    """
    numbers = {robot.name: k for k, robot in enumerate(trace.robots)}
    gaps_m = gaps_m.copy()
    for contact in trace.contacts:
        involved = [numbers[name] for name in (contact.robot, contact.other) if name in numbers]
        if (len(involved) == 2) is robots and len(tracks.times_s):
            gaps_m[involved] = np.maximum(gaps_m[involved], 0.0)
            gaps_m[involved, tracks.index_at(contact.time_s)] = 0.0
    return gaps_m


def smallest_of_all(gaps_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the smallest of the robots' distances, shape (n, t), at each time, shape (t,)."""
    if not gaps_m.size:
        return np.empty(0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # times without any sample
        return np.asarray(np.nanmin(gaps_m, axis=0))


def _draw_gaps(
    axes: Axes, title: str, times_s: NDArray[np.float64], gaps_m: NDArray[np.float64]
) -> None:
    many = len(gaps_m) > _FEW
    same = len(gaps_m) == 2 and np.array_equal(gaps_m[0], gaps_m[1], equal_nan=True)
    for k, gap_m in enumerate(gaps_m):
        axes.plot(
            times_s,
            gap_m,
            color="black" if same else colour(k),
            lw=0.8 if many else 1.4,
            alpha=0.55 if many else 1.0,
        )
    least_m = smallest_of_all(gaps_m)
    if many:
        axes.plot(times_s, least_m, color="black", lw=1.3)
    touching = np.where(least_m <= 0.0, 0.0, np.nan)
    axes.plot(times_s[: len(touching)], touching, color=ALARM, lw=4, solid_capstyle="butt")
    axes.axhspan(-1.0, 0.0, color=ALARM, alpha=0.10, lw=0)
    bottom = min(-0.1, float(np.nanmin(least_m)) - 0.05) if np.isfinite(least_m).any() else -0.1
    axes.set(
        title=title + (", smallest of all in black" if many else ""),
        ylabel="distance (m)",
        ylim=(bottom, SHOWN_M),
    )


def _draw_letters(axes: Axes, marked: Sequence[Encounter]) -> None:
    for letter, encounter in zip(LETTERS, marked):
        if encounter.other is not None:
            axes.plot(
                encounter.time_s,
                encounter.separation_m,
                "o",
                ms=5,
                color="none",
                mec="black",
                zorder=8,
            )
            axes.annotate(
                letter,
                (encounter.time_s, encounter.separation_m),
                (5, 8),
                textcoords="offset points",
                fontsize=9,
                fontweight="bold",
            )
    axes.axhline(CLOSE_M, color=QUIET, lw=0.8, ls=":")
