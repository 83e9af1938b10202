"""Picture that compares flights: a panel for each metric."""

from __future__ import annotations

from typing import Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from quad_nav.report.flight_metrics import FlightMetrics
from quad_nav.report.style import ALARM, colour, new_figure, robot_legend

Panel = Tuple[str, Callable[[FlightMetrics], Optional[float]]]
PANELS: Tuple[Panel, ...] = (
    ("Mission time (s)", lambda flight: flight.mission_s),
    ("Detour", lambda flight: flight.detour),
    ("Recoveries", lambda flight: flight.recoveries),
    ("Min clearance (m)", lambda flight: flight.min_clearance_m),
    ("Min separation (m)", lambda flight: flight.min_separation_m),
    ("Contacts", lambda flight: flight.contacts),
)
_BOX_FROM = 5  # flights; for fewer, the dots alone are clearer
_COUNTS = ("Recoveries", "Contacts")


def grouped(flights: Sequence[FlightMetrics]) -> Dict[str, List[FlightMetrics]]:
    """Group flights by the name of their configuration, in order of appearance."""
    groups: Dict[str, List[FlightMetrics]] = {}
    for flight in flights:
        groups.setdefault(flight.config_name or "unknown", []).append(flight)
    return groups


def metrics_picture(flights: Sequence[FlightMetrics]) -> Figure:
    """Draw each flight as a dot, and failed flights as red crosses."""
    groups = grouped(flights)
    figure = new_figure(5.2)
    for axes, (title, value) in zip(figure.subplots(2, 3).flat, PANELS):
        axes.set_title(title)
        axes.grid(axis="x", visible=False)
        for k, group in enumerate(groups.values()):
            _draw_group(axes, k, [(flight, value(flight)) for flight in group])
        axes.set(xticks=range(len(groups)), xlim=(-0.6, len(groups) - 0.4))
        axes.set_xticklabels(
            list(groups),
            rotation=0 if len(groups) < 4 else 25,
            ha="center" if len(groups) < 4 else "right",
        )
        if title in _COUNTS:
            axes.yaxis.get_major_locator().set_params(integer=True)
            axes.set_ylim(bottom=-0.3, top=max(axes.get_ylim()[1], 1.3))
    robot_legend(
        figure,
        (),
        [
            Line2D([], [], ls="", marker="o", color=colour(0), label="successful flight"),
            Line2D(
                [], [], ls="", marker="X", ms=8, color=ALARM, mec="white", label="failed flight"
            ),
        ],
    )
    return figure


def _draw_group(
    axes: Axes, column: int, values: Sequence[Tuple[FlightMetrics, Optional[float]]]
) -> None:
    known = [(flight, value) for flight, value in values if value is not None]
    if len(known) >= _BOX_FROM:
        axes.boxplot(
            [value for _, value in known],
            positions=[column],
            widths=0.6,
            showfliers=False,
            boxprops={"color": "#9aa4ae"},
            manage_ticks=False,
            whiskerprops={"color": "#9aa4ae"},
            capprops={"color": "#9aa4ae"},
            medianprops={"color": "black", "lw": 1.4},
        )
    # Side by side in the order of the flights: equal values do not hide each other.
    places = column + (np.linspace(-0.2, 0.2, len(known)) if len(known) > 1 else np.zeros(1))
    for place, (flight, value) in zip(places, known):
        axes.plot(
            place,
            value,
            "o" if flight.success else "X",
            ms=5.5 if flight.success else 7.5,
            color=colour(0) if flight.success else ALARM,
            mec="white",
            mew=0.6,
            alpha=0.9,
            zorder=5,
        )
