"""Plots of several panels in a grid, and how matplotlib draws a plot on paper."""

from __future__ import annotations

import html
import re
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from quad_nav.report.page import Section, picture
from quad_nav.report.plot import Json, Plot, layout
from quad_nav.report.style import label_log, new_figure, robot_legend

_GAP_PX, _TOP_PX, _BOTTOM_PX = 70, 60, 52  # between the rows of panels, above and below them
_GAP = 0.08  # between the columns, in parts of the width
_PX_PER_IN = 100.0
_MARKERS = {"circle": "o", "circle-open": "o", "x": "X", "square": "s", "star": "*"}
_DASHES = {"dash": "--"}


class Panel(NamedTuple):
    """One pair of axes: its title, its traces and its axes, as plotly.js has them."""

    title: str
    traces: Sequence[Json]
    x: Json
    y: Json


def panel_plot(
    name: str, alt: str, panels: Sequence[Panel], columns: int, panel_px: int, legend: bool = False
) -> Plot:
    """Place panels in a grid, each below its title."""
    lines = -(-len(panels) // columns)
    plot_px = lines * panel_px + (lines - 1) * _GAP_PX
    width, height = (1.0 + _GAP) / columns - _GAP, panel_px / plot_px
    traces: List[Json] = []
    axes: Json = {}
    titles = []
    for k, panel in enumerate(panels):
        line, column = divmod(k, columns)
        left, top = column * (width + _GAP), 1.0 - line * (height + _GAP_PX / plot_px)
        suffix = "" if k == 0 else str(k + 1)
        across, up = [left, min(left + width, 1.0)], [max(top - height, 0.0), top]
        axes[f"xaxis{suffix}"] = {**panel.x, "domain": across, "anchor": f"y{suffix}"}
        axes[f"yaxis{suffix}"] = {**panel.y, "domain": up, "anchor": f"x{suffix}"}
        traces += [{**one, "xaxis": f"x{suffix}", "yaxis": f"y{suffix}"} for one in panel.traces]
        place = {"xref": "paper", "yref": "paper", "x": left, "y": top}
        corner = {"xanchor": "left", "yanchor": "bottom", "align": "left", "showarrow": False}
        titles.append({"text": f"<b>{panel.title}</b>", **place, **corner})
    margin = {"l": 56, "r": 12, "t": _TOP_PX, "b": _BOTTOM_PX}
    style = layout(**axes, annotations=titles, showlegend=legend, margin=margin)
    around_px = _TOP_PX + _BOTTOM_PX
    changes, column_px = _one_column(len(panels), panel_px)
    return Plot(
        name,
        alt,
        traces,
        style,
        height_px=plot_px + around_px,
        narrow={**changes, "margin.t": _TOP_PX},
        narrow_px=column_px + around_px,
    )


def _one_column(count: int, panel_px: int) -> Tuple[Json, int]:
    """Return the changes of a layout that put all panels below each other, and their height."""
    total_px = count * panel_px + (count - 1) * _GAP_PX
    changes: Json = {}
    for k in range(count):
        top = 1.0 - k * (panel_px + _GAP_PX) / total_px
        suffix = "" if k == 0 else str(k + 1)
        changes[f"xaxis{suffix}.domain"] = [0.0, 1.0]
        changes[f"yaxis{suffix}.domain"] = [max(top - panel_px / total_px, 0.0), top]
        changes[f"yaxis{suffix}.showticklabels"] = True
        changes[f"annotations[{k}].x"] = 0.0
        changes[f"annotations[{k}].y"] = top
    return changes, total_px


def plot_section(anchor: str, heading: str, caption: str, plot: Plot) -> Section:
    """Make a section of a page with a plot, and its picture for paper."""
    paper = picture(plot.name, plot.alt, lambda: paper_figure(plot))
    return Section(anchor, heading, caption, plots=(plot,), paper=(paper,))


def paper_figure(plot: Plot) -> Figure:
    """Draw a plot with scatter traces, bars and heatmaps, such as `panel_plot` makes."""
    style = plot.layout
    names = [key[5:] for key in style if key.startswith("xaxis")]
    places = [_corner(style, suffix) for suffix in names]
    columns = sorted({x for x, _ in places})
    rows = sorted({y for _, y in places}, reverse=True)
    figure = new_figure(plot.height_px / _PX_PER_IN)
    grid = figure.subplots(len(rows), len(columns), squeeze=False)
    panels: Dict[str, Axes] = {}
    for suffix, (x, y) in zip(names, places):
        panels[suffix] = grid[rows.index(y), columns.index(x)]
    for axes in grid.flat:
        if axes not in panels.values():
            axes.axis("off")
    for trace in plot.traces:
        _DRAWN[trace["type"]](panels[trace.get("xaxis", "x")[1:]], trace)
    for suffix, axes in panels.items():
        _scale(axes, style[f"xaxis{suffix}"], "x")
        _scale(axes, style[f"yaxis{suffix}"], "y")
    for axes, title in zip(panels.values(), style.get("annotations", ())):
        axes.set_title(_words(title["text"]), fontsize=8 if len(columns) > 2 else None)
    if style.get("showlegend", True):
        handles: Dict[str, Any] = {}
        for axes in panels.values():
            for handle, name in zip(*axes.get_legend_handles_labels()):
                handles.setdefault(name, handle)
        handles.pop("", None)
        robot_legend(figure, (), list(handles.values()))
    return figure


def _corner(style: Json, suffix: str) -> Tuple[float, float]:
    return tuple(style[f"{side}axis{suffix}"].get("domain", (0.0,))[0] for side in "xy")


def _words(text: str) -> str:
    """Return a text without plotly's tags and entities."""
    return html.unescape(re.sub("<[^>]*>", "", text.replace("<br>", "\n")))


def _ink(colour: str) -> Any:
    parts = re.fullmatch(r"rgba\((.*)\)", colour)
    if parts is None:
        return colour
    *rgb, alpha = map(float, parts.group(1).split(","))
    return (*(part / 255.0 for part in rgb), alpha)


def _known(values: Sequence[Optional[float]]) -> List[float]:
    return [np.nan if value is None else value for value in values]


def _reach(errors: Optional[Json]) -> Optional[Tuple[Sequence[float], Sequence[float]]]:
    """Return how far error bars reach below and above."""
    if errors is None or not errors.get("visible", True):
        return None
    return errors["arrayminus"], errors["array"]


def _scatter(axes: Axes, trace: Json) -> None:
    x, y, marker, line = trace["x"], _known(trace["y"]), trace.get("marker"), trace.get("line", {})
    name, reach = trace.get("name", ""), _reach(trace.get("error_y"))
    _fill(axes, trace)
    if "lines" in trace["mode"]:
        axes.plot(
            _known(x),
            y,
            color=_ink(line["color"]),
            lw=0.7 * line["width"],
            ls=_DASHES.get(line.get("dash", ""), "-"),
            drawstyle="steps-post" if line.get("shape") == "hv" else "default",
            label=name if marker is None else "",
        )
    if reach is not None:
        ink = _ink(marker["color"]) if marker else None
        axes.errorbar(x, y, yerr=reach, fmt="none", ecolor=ink, elinewidth=1.0, capsize=3)
    if "markers" not in trace["mode"] or marker is None:
        return
    count = len(y)
    sizes, inks, symbols = (
        value if isinstance(value, (list, tuple)) else [value] * count
        for value in (marker["size"], marker["color"], marker.get("symbol", "circle"))
    )
    for symbol in dict.fromkeys(symbols):
        chosen = [k for k in range(count) if symbols[k] == symbol]
        colours = [_ink(inks[k]) for k in chosen]
        is_open = symbol == "circle-open"
        filled = {"facecolors": "none", "edgecolors": colours} if is_open else {"color": colours}
        axes.scatter(
            [x[k] for k in chosen],
            [y[k] for k in chosen],
            s=[(0.6 * sizes[k]) ** 2 for k in chosen],
            marker=_MARKERS.get(symbol, "_"),
            alpha=marker.get("opacity"),
            label=name if symbol == symbols[0] else "",
            zorder=3,
            clip_on=False,
            **filled,
        )


def _fill(axes: Axes, trace: Json) -> None:
    """Fill the area between a line and 0, if it is the edge of a band."""
    if "fill" not in trace:
        return
    is_step = trace["line"].get("shape") == "hv"
    axes.fill_between(
        _known(trace["x"]),
        _known(trace["y"]),
        color=_ink(trace["fillcolor"]),
        step="post" if is_step else None,
        lw=0,
    )


def _bars(axes: Axes, trace: Json) -> None:
    values = [value or 0.0 for value in trace["x"]]
    reach, ink = _reach(trace.get("error_x")), _ink(trace["marker"]["color"])
    bars = {"height": trace["width"], "color": ink, "capsize": 2, "error_kw": {"elinewidth": 0.9}}
    axes.barh(trace["y"], values, xerr=reach, **bars)


def _heatmap(axes: Axes, trace: Json) -> None:
    scale = LinearSegmentedColormap.from_list("better", [tuple(one) for one in trace["colorscale"]])
    scale = scale.reversed() if trace["reversescale"] else scale
    cells = np.array([_known(line) for line in trace["z"]])
    limits = {"vmin": trace["zmin"], "vmax": trace["zmax"]}
    image = axes.imshow(
        cells, aspect="auto", origin="lower", cmap=scale, alpha=trace["opacity"], **limits
    )
    if not any(map(any, trace["text"])):  # the cells are too many for numbers
        axes.figure.colorbar(image, ax=axes)
    for (i, j), _ in np.ndenumerate(cells):
        words = _words(trace["text"][i][j])
        axes.text(j, i, words, color=trace["textfont"]["color"], ha="center", va="center", size=7)
    axes.grid(visible=False)
    axes.set_xticks(range(cells.shape[1]), [_words(one) for one in trace["x"]])
    axes.set_yticks(range(cells.shape[0]), [_words(one) for one in trace["y"]])


_DRAWN = {"scatter": _scatter, "bar": _bars, "heatmap": _heatmap}


def _scale(axes: Axes, given: Json, side: str) -> None:
    """Set the limits, the ticks and the title of an axis."""
    axis = axes.xaxis if side == "x" else axes.yaxis
    set_limits = getattr(axes, f"set_{side}lim")
    axis.set_label_text(_words(given["title"]["text"]))
    if given.get("type") == "log":
        getattr(axes, f"set_{side}scale")("log")
        if "range" in given:
            set_limits(*(10.0**end for end in given["range"]))
        label_log(axis)
    elif "range" in given:
        set_limits(*given["range"])
    elif given.get("rangemode") == "tozero":
        least = getattr(axes.dataLim, f"{side}0")
        set_limits(min(least, 0.0) if np.isfinite(least) else 0.0, None)
    if "tickvals" in given:
        shown = given.get("showticklabels", True)
        axis.set_ticks(
            given["tickvals"], [_words(one) if shown else "" for one in given["ticktext"]]
        )
    if given.get("showgrid") is False:
        axis.grid(visible=False)
