"""Pictures of the outcome of a search: time against gap, and held-out flights."""

from __future__ import annotations

from typing import Any, List, Optional, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from quad_nav.report.style import ALARM, QUIET, colour, new_figure, robot_legend
from quad_tune.flight_result import FlightResult
from quad_tune.statistics import FlightStatistics

Place = Tuple[float, float]
"""Mean time in seconds, smallest gap in metres."""


def place(statistics: FlightStatistics) -> Optional[Place]:
    """Return (mean time, min gap); None if no mission was completed or nothing was near."""
    if statistics.mean_time_s is None or statistics.least_gap_m is None:
        return None
    return statistics.mean_time_s, statistics.least_gap_m


def front(places: Sequence[Place]) -> List[Place]:
    """Return the places that no other place beats in both time and gap, by time."""
    kept: List[Place] = []
    for time_s, gap_m in sorted(places, key=lambda point: (point[0], -point[1])):
        if not kept or gap_m > kept[-1][1]:
            kept.append((time_s, gap_m))
    return kept


def pareto_picture(
    candidates: Sequence[FlightStatistics], base: FlightStatistics, tuned: FlightStatistics
) -> Figure:
    """Draw the candidates that reached every goal without contact."""
    figure = new_figure(3.8)
    axes = figure.subplots()
    clean = [
        found
        for found in (
            place(statistics)
            for statistics in candidates
            if statistics.succeeded == statistics.flights
        )
        if found is not None
    ]
    if clean:
        times_s, gaps_m = zip(*clean)
        axes.scatter(times_s, gaps_m, s=22, color=colour(0), zorder=3)
        times_s, gaps_m = zip(*front(clean))
        axes.step(times_s, gaps_m, where="post", color=QUIET, lw=1.2, zorder=2)
        axes.scatter(times_s, gaps_m, s=60, facecolor="none", edgecolor=QUIET, zorder=4)
    for statistics, marker, ink in ((base, "s", "black"), (tuned, "*", ALARM)):
        found = place(statistics)
        if found is not None:
            axes.plot(
                *found, marker, color=ink, ms=8 if marker == "s" else 14, mec="white", zorder=6
            )
    axes.set(xlabel="mean mission time (s)", ylabel="min gap (m)")
    robot_legend(
        figure,
        (),
        [
            _symbol("o", "candidate", colour(0)),
            _symbol("o", "front", "white", QUIET),
            _symbol("s", "base", "black"),
            _symbol("*", "tuned", ALARM, size=13),
        ],
    )
    return figure


def held_out_picture(base: Sequence[FlightResult], tuned: Sequence[FlightResult]) -> Figure:
    """Draw each flight of the base beside the tuned one of the same mission and seed."""
    figure = new_figure(3.4)
    left, right = figure.subplots(1, 2)
    _draw_pairs(
        left,
        [(before.time_s, after.time_s) for before, after in zip(base, tuned)],
        "Mission time (s)",
        base,
        tuned,
    )
    gaps = [(before.gap_m, after.gap_m) for before, after in zip(base, tuned)]
    _draw_pairs(
        right,
        [(np.nan if a is None else a, np.nan if b is None else b) for a, b in gaps],
        "Min gap (m)",
        base,
        tuned,
    )
    robot_legend(
        figure,
        (),
        [
            _symbol("o", "successful flight", colour(0)),
            _symbol("X", "failed flight", ALARM, size=8),
        ],
    )
    return figure


def _draw_pairs(
    axes: Axes,
    pairs: Sequence[Tuple[float, float]],
    title: str,
    base: Sequence[FlightResult],
    tuned: Sequence[FlightResult],
) -> None:
    axes.set_title(title)
    for flights, column in ((base, 0), (tuned, 1)):
        shift = np.linspace(-0.16, 0.16, len(pairs)) if len(pairs) > 1 else np.zeros(1)
        for k, flight in enumerate(flights):
            axes.plot(
                column + shift[k],
                pairs[k][column],
                "o" if flight.succeeded else "X",
                color=colour(0) if flight.succeeded else ALARM,
                mec="white",
                mew=0.5,
                ms=5 if flight.succeeded else 8,
                zorder=4,
            )
        values = np.array([pair[column] for pair in pairs])
        if np.isfinite(values).any():
            axes.hlines(
                np.nanmean(values), column - 0.28, column + 0.28, color="black", lw=1.6, zorder=5
            )
    for k, pair in enumerate(pairs):
        shift_k = -0.16 + 0.32 * k / max(len(pairs) - 1, 1)
        axes.plot([shift_k, 1 + shift_k], pair, color=QUIET, lw=0.5, alpha=0.5, zorder=2)
    axes.set(xticks=(0, 1), xlim=(-0.5, 1.5))
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]) if _has_negative(pairs) else 0.0)
    axes.set_xticklabels(["base", "tuned"])
    axes.grid(axis="x", visible=False)


def _has_negative(pairs: Sequence[Tuple[float, float]]) -> bool:
    return any(value < 0.0 for pair in pairs for value in pair)


def _symbol(marker: str, label: str, face: Any, edge: Any = "white", size: float = 6) -> Line2D:
    return Line2D([], [], ls="", marker=marker, label=label, color=face, mec=edge, ms=size)
