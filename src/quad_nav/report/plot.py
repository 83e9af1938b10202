"""Interactive plots: figures of plotly.js as JSON, and the script that draws them in a page.

A page has the script once, in its own text, and loads nothing. Figures are plain dictionaries:
plotly's Python classes would check every value again, which takes seconds with 50 robots; a test
checks the figures with them.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.sim.colours import robot_rgba

Json = Dict[str, Any]

INK, QUIET, GRID, ALARM = "#20262c", "#5a6570", "#e4e8ec", "#c01020"
PAPER, EDGE, SOLID, OUTLINE = "#ffffff", "#a0a8b0", "#b9bfc6", "#7c858e"
_DARK = {
    INK: "#e4e9ef",
    QUIET: "#a2adb8",
    GRID: "#2b323a",
    ALARM: "#ff6b6b",
    PAPER: "#171b21",
    EDGE: "#5f6a75",
    SOLID: "#48525c",
}
"""Colours of a page with plots -> those that a dark screen has instead."""
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
"""Line patterns; robots with similar colours have different ones."""
_LONGEST_TEXT = 80
_MOST_POINTS = 40_000  # of all lines of a panel: more make the page slow
_FULL_SIZE_UP_TO = 10  # robots; with more, symbols are smaller
_FEWEST, _MOST = 120, 1500  # points of one line
_LEGEND_ROW_PX, _NARROW_TOP_PX, _NARROW_LEFT_PX = 20, 40, 42


@dataclass(frozen=True)
class Plot:
    """Figure that the reader can zoom and hover.

    Attributes:
        name: Name of the element in the page; letters, digits and ``_``.
        alt: Description of the content.
        traces: Traces of plotly.js.
        layout: Layout of plotly.js; ``layout`` makes one in the style of the reports.
        frames: Frames of an animation.
        height_px: Height that does not depend on the width.
        aspect: Further height, as a part of the width; such a plot is not higher than the screen.
        narrow: Changes of the layout on a narrow screen, by their paths, as ``xaxis.domain``.
        narrow_px: Height there, the legend apart; that of a wide screen if it is 0.
        narrow_bottom_px: Height below the plot there, the legend apart; that of the layout if 0.
        narrow_aspect: Further height there, as a part of the plot's width.
    """

    name: str
    alt: str
    traces: Sequence[Json]
    layout: Json
    frames: Sequence[Json] = ()
    height_px: int = 420
    aspect: float = 0.0
    narrow: Mapping[str, Any] = field(default_factory=dict)
    narrow_px: int = 0
    narrow_bottom_px: int = 0
    narrow_aspect: float = 0.0

    @property
    def json(self) -> str:
        """The figure as JSON that can stand between script tags."""
        figure = {"data": list(self.traces), "layout": self.layout, "frames": list(self.frames)}
        return script_json({**figure, "narrow": {**self._below, **self.narrow}})

    @property
    def _below(self) -> Json:
        """Place the legend below the plot, in two columns; the margins are small."""
        bottom_px = (self.narrow_bottom_px or self.layout["margin"]["b"]) + self._legend_px
        legend = {
            **self.layout["legend"],
            **{"orientation": "h", "entrywidth": 0.48, "entrywidthmode": "fraction"},
            **{"x": 0, "xanchor": "left", "y": 0, "yanchor": "bottom", "yref": "container"},
        }
        margins = {"l": _NARROW_LEFT_PX, "r": 8, "t": _NARROW_TOP_PX, "b": bottom_px}
        margins = {f"margin.{side}": size for side, size in margins.items()}
        return {"legend": legend, **margins, "dragmode": False}

    @property
    def _legend_px(self) -> int:
        """Height of the legend in two columns."""
        shown = [one for one in self.traces if one.get("name") and one.get("showlegend", True)]
        has_legend = len(self.traces) > 1 and self.layout.get("showlegend", True)
        return _LEGEND_ROW_PX * -(-len(shown) // 2) + 12 if has_legend else 0

    @property
    def heights(self) -> str:
        """The heights on a wide and on a narrow screen, as CSS; the width is that of the text."""
        wide = f"calc(min(100vw - 2rem, 74rem) * {self.aspect:.3f} + {self.height_px}px)"
        if self.aspect:
            wide = f"min({wide}, 100vh - 1rem)"
        around_px = (self.narrow_px or self.height_px) + self._legend_px
        width = f"(100vw - 2rem - {_NARROW_LEFT_PX + 8}px)"
        narrow = f"calc({width} * {self.narrow_aspect:.3f} + {around_px}px)"
        return f"--wide: {wide}; --narrow: {narrow}"


def script_json(value: Any) -> str:
    """Encode a value as JSON without characters that can end or open an element.

    Raises:
        ValueError: A number is not finite.
    """
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return re.sub("[<>&]", lambda found: f"\\u{ord(found.group()):04x}", text)


def plot_text(text: str) -> str:
    """Escape a text of others: plotly reads tags, entities and ``%{...}`` in its texts."""
    cut = text if len(text) <= _LONGEST_TEXT else text[: _LONGEST_TEXT - 1] + "…"
    return re.sub("[<>&%$]", lambda found: f"&#{ord(found.group())};", cut.replace("\n", " "))


def numbers(values: Any, decimals: int = 3) -> List[Optional[float]]:
    """Convert an array, shape (k,), to rounded numbers, with None for those not finite."""
    array = np.round(np.asarray(values, dtype=float), decimals)
    return [value if abs(value) < np.inf else None for value in array.tolist()]


def rgb(robot: int, alpha: float = 1.0) -> str:
    """Return a robot's colour as a value of CSS."""
    red, green, blue = (round(255 * part) for part in robot_rgba(robot)[:3])
    return f"rgba({red},{green},{blue},{alpha:g})"


def dash(robot: int) -> str:
    """Return a robot's line pattern."""
    return DASHES[robot % len(DASHES)]


def sample(count: int, lines: int) -> NDArray[np.int64]:
    """Return the indices of the samples that a line shows, first and last included.

    Args:
        count: Number of samples of the line.
        lines: Number of lines in the panel; together they have about 40,000 points.
    """
    most = int(np.clip(_MOST_POINTS // max(lines, 1), _FEWEST, _MOST))
    if count <= most:
        return np.arange(count)
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))


def smallest_samples(values: NDArray[np.float64], lines: int) -> NDArray[np.int64]:
    """Return indices as ``sample`` does, but of the smallest value of each period.

    Args:
        values: Values of the line, shape (k,); NaN where unknown.
        lines: Number of lines in the panel.
    """
    edges = sample(len(values), lines)
    if len(edges) == len(values):
        return edges
    known = np.where(np.isfinite(values), values, np.inf)
    return np.unique(
        [first + int(np.argmin(known[first:end])) for first, end in zip(edges[:-1], edges[1:])]
        + [int(edges[-1])]
    )


def lines(x: Any, y: Any, decimals: Tuple[int, int] = (3, 3), **more: Any) -> Json:
    """Make a trace of lines; ``more`` are further keys of plotly.js."""
    xs, ys = (numbers(values, digits) for values, digits in zip((x, y), decimals))
    return {"type": "scatter", "mode": "lines", "x": xs, "y": ys, **more}


def axis(title: str = "", **more: Any) -> Json:
    """Make an axis in the style of the reports; ``more`` are further keys of plotly.js."""
    return {
        "title": {"text": title, "standoff": 6},
        "gridcolor": GRID,
        "linecolor": EDGE,
        "zeroline": False,
        "automargin": True,
        **more,
    }


def layout(**more: Any) -> Json:
    """Make a layout in the style of the reports; ``more`` are further keys of plotly.js."""
    return {
        "font": {
            "family": "system-ui, Segoe UI, DejaVu Sans, sans-serif",
            "size": 13,
            "color": INK,
        },
        "paper_bgcolor": PAPER,
        "plot_bgcolor": PAPER,
        "margin": {"l": 56, "r": 12, "t": 28, "b": 44},
        "hovermode": "closest",
        "hoverlabel": {"bgcolor": PAPER, "font": {"color": INK, "size": 13}, "align": "left"},
        "legend": {"groupclick": "togglegroup", "tracegroupgap": 0, "font": {"size": 12}},
        "barmode": "overlay",
        "bargap": 0,
        **more,
    }


@dataclass(frozen=True)
class Scripts:
    """Scripts of a page: plotly.js and the one that draws the figures; empty without figures."""

    texts: Tuple[str, ...] = ()
    hashes: Tuple[str, ...] = field(default=())

    @property
    def policy(self) -> str:
        """Content security policy: these scripts run, no other, and nothing is loaded."""
        allowed = " ".join(f"'sha256-{code}'" for code in self.hashes) or "'none'"
        return (
            f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
            "img-src data: blob:; base-uri 'none'; form-action 'none'"
        )


@lru_cache(maxsize=1)
def plot_scripts() -> Scripts:
    """Return the scripts that a page with plots needs, 4.8 MB with plotly 7."""
    # Imported here: pages without plots need no plotly.
    from plotly.offline import get_plotlyjs

    draw = _DRAW % (script_json(_CONFIG), script_json(_DARK))
    texts = (get_plotlyjs().replace("\r\n", "\n"), draw)
    return Scripts(texts, tuple(map(_hash, texts)))


def _hash(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode("utf-8")).digest()).decode("ascii")


_CONFIG: Mapping[str, Any] = {
    # plotly.js 4 has a button that uploads the plot, which is on by default.
    "showSendToCloud": False,
    "plotlyServerURL": "",
    "responsive": True,
    "displaylogo": False,
    "displayModeBar": True,
    "modeBarButtonsToRemove": ["sendChartToCloud", "select2d", "lasso2d", "autoScale2d"],
    "toImageButtonOptions": {"format": "svg"},
}
# The paper is white, and narrower than the screen; a plot is drawn again before it is printed.
_DRAW = """
(() => {
  const config = %s;
  const dark = %s;
  const isDark = matchMedia("(prefers-color-scheme: dark)");
  const isNarrow = matchMedia("(max-width: 40rem)");
  const plots = [...document.querySelectorAll(".plot")];
  function draw(element, onPaper) {
    let text = document.getElementById("figure-" + element.id).textContent;
    if (isDark.matches && !onPaper)
      text = text.replace(/#[0-9a-f]{6}/g, colour => dark[colour] || colour);
    const {narrow, ...figure} = JSON.parse(text);
    if (onPaper) Object.assign(figure.layout, {width: 680, autosize: false});
    const options = {...config, toImageButtonOptions: {format: "svg", filename: element.id}};
    element.textContent = "";
    Plotly.newPlot(element, {...figure, config: options});
    if (isNarrow.matches && !onPaper) Plotly.relayout(element, narrow);
  }
  const drawAll = onPaper => plots.forEach(element => draw(element, onPaper));
  drawAll(false);
  for (const query of [isDark, isNarrow]) query.addEventListener("change", () => drawAll(false));
  window.addEventListener("beforeprint", () => drawAll(true));
  window.addEventListener("afterprint", () => drawAll(false));
})();
"""


def symbol_scale(robots: int) -> float:
    """Return the size of the symbols of many robots, in parts of that of a few."""
    return float(min(1.0, (_FULL_SIZE_UP_TO / robots) ** 0.25))
