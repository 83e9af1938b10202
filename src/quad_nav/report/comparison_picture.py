"""Several flights side by side: one panel for each figure, one column for each configuration."""

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
    ("Mission time, s", lambda one: one.mission_s),
    ("Path / straight", lambda one: one.path_ratio),
    ("Recoveries", lambda one: one.recoveries),
    ("Least gap to obstacle, m", lambda one: one.least_clearance_m),
    ("Least gap to robot, m", lambda one: one.least_separation_m),
    ("Contacts", lambda one: one.contacts),
)
_BOX_FROM = 5  # flights; of fewer a box says less than the dots
_COUNTS = ("Recoveries", "Contacts")


def grouped(flights: Sequence[FlightMetrics]) -> Dict[str, List[FlightMetrics]]:
    """Flights by the name of their configuration, in the order in which these come first."""
    groups: Dict[str, List[FlightMetrics]] = {}
    for one in flights:
        groups.setdefault(one.config_name or "unknown", []).append(one)
    return groups


def comparison_picture(flights: Sequence[FlightMetrics]) -> Figure:
    """Each flight is a dot, those that failed a red cross."""
    groups = grouped(flights)
    figure = new_figure(5.2)
    for axes, (title, value) in zip(figure.subplots(2, 3).flat, PANELS):
        axes.set_title(title)
        axes.grid(axis="x", visible=False)
        for k, group in enumerate(groups.values()):
            _draw_group(axes, k, [(one, value(one)) for one in group])
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
    known = [(one, value) for one, value in values if value is not None]
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
    # Side by side in the order of the flights, so that equal ones do not hide each other.
    places = column + (np.linspace(-0.2, 0.2, len(known)) if len(known) > 1 else np.zeros(1))
    for place, (one, value) in zip(places, known):
        axes.plot(
            place,
            value,
            "o" if one.success else "X",
            ms=5.5 if one.success else 7.5,
            color=colour(0) if one.success else ALARM,
            mec="white",
            mew=0.6,
            alpha=0.9,
            zorder=5,
        )
