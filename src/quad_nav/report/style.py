"""Common sizes, fonts and colours of all pictures, and their files."""

from __future__ import annotations

import contextlib
import io
import math
from typing import Any, Dict, Iterator, Sequence, Tuple

import matplotlib
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from quad_nav.report.plot import DASHES
from quad_nav.sim.colours import robot_rgba

WIDTH_IN = 8.0
_DPI = 140
ALARM = "#c01020"  # contacts, failures, limits
QUIET = "#667080"  # labels and lines that only help
MAX_ROWS = 8
"""Pictures with a row for each quadcopter have no more rows than this."""
_MOST_IN_LEGEND = 24
_LINE_STYLES: Dict[str, Any] = {
    "solid": "-",
    "dash": (0, (5, 2)),
    "dot": (0, (1, 1.2)),
    "dashdot": (0, (5, 1.5, 1, 1.5)),
    "longdash": (0, (9, 2)),
    "longdashdot": (0, (9, 1.5, 1, 1.5)),
}

RC: Dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.edgecolor": "#a0a8b0",
    "axes.labelcolor": "#303840",
    "axes.grid": True,
    "grid.color": "#e4e8ec",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": "#505860",
    "ytick.color": "#505860",
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "hatch.linewidth": 0.6,
    "figure.facecolor": "white",
    "svg.hashsalt": "quad",  # the names of elements, which are random without
    "text.parse_math": False,  # names of quadcopters may hold any character
}


def new_figure(height_in: float) -> Figure:
    """Create a figure on Agg without pyplot's global state, with constrained layout."""
    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def png(figure: Figure) -> bytes:
    """Encode a figure as PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DPI, metadata={"Software": None})
    return buffer.getvalue()


def svg(figure: Figure) -> bytes:
    """Encode a figure as SVG; the same figure gives the same bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


@contextlib.contextmanager
def styled() -> Iterator[None]:
    """Create and draw figures inside.

    A file ``matplotlibrc`` in the current folder has no say: it may name a program as ffmpeg.
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(RC)
        yield


def label_log(axis: Axis) -> None:
    """Label a logarithmic axis, whose limits are set, with plain numbers.

    matplotlib's own labels there are math text, which is switched off.
    """
    low, high = axis.get_view_interval()
    decades = math.log10(high / low)
    steps = (1.0,) if decades > 4.0 else (1.0, 3.0) if decades > 1.2 else (1.0, 2.0, 3.0, 5.0, 7.0)
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def colour(robot: int) -> Tuple[float, float, float]:
    """Return a robot's colour as (red, green, blue) from 0 to 1."""
    return robot_rgba(robot)[:3]


def line_style(robot: int) -> Any:
    """Return a robot's line pattern, the one of interactive plots."""
    return _LINE_STYLES[DASHES[robot % len(DASHES)]]


def centred_text(
    axes: Axes, place: Tuple[float, float], text: str, size: float, ink: Any, **more: Any
) -> Text:
    """Write a short bold text in the middle of a symbol; ``more`` are options of matplotlib."""
    return axes.text(
        *place,
        text,
        fontsize=size,
        color=ink,
        fontweight="bold",
        ha="center",
        va="center_baseline",
        clip_on=True,
        **more,
    )


def robot_legend(
    figure: Figure,
    names: Sequence[str],
    more: Sequence[Any] = (),
    columns: int = 6,
    patterns: bool = False,
) -> None:
    """Add a legend of the robots below the axes.

    Args:
        figure: Figure to add it to.
        names: Names of the robots. More than 24 cannot be told apart and are left out.
        more: Further labelled artists.
        columns: Largest number of columns.
        patterns: Whether the lines in the picture have the robots' patterns.
    """
    handles = []
    if 1 < len(names) <= _MOST_IN_LEGEND:
        handles = [
            matplotlib.lines.Line2D(
                [], [], color=colour(k), lw=2, ls=line_style(k) if patterns else "-", label=name
            )
            for k, name in enumerate(names)
        ]
    handles += more
    if handles:
        figure.legend(
            handles=handles,
            loc="outside lower center",
            ncols=min(len(handles), columns),
            fontsize=8.5,
            columnspacing=1.4,
            handlelength=2.6 if patterns else 1.6,
        )


def time_axis(axes: Axes) -> None:
    """Set the margins and the label of a time axis."""
    axes.margins(x=0.01)
    axes.set_xlabel("time (s)")
