"""Picture of swaps of sides: the paths of several methods side by side."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import List, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch
from numpy.typing import NDArray

from quad_nav.files.output import write_bytes
from quad_nav.report.style import QUIET, WIDTH_IN, colour, new_figure, png, styled, svg

_BORDER_M = 1.0
_TITLE_IN = 0.55


@dataclass(frozen=True)
class PathsPanel:
    """Paths of one flight.

    Attributes:
        title: Text above the panel.
        tracks_m: Positions float64[t, n, 2] in ``map``; circles are drawn around the last ones.
        goals_m: Goals (x, y) of the robots in ``map``.
        body_radius_m: Radius of the hulls.
    """

    title: str
    tracks_m: NDArray[np.float64]
    goals_m: Sequence[Tuple[float, float]]
    body_radius_m: float


def write_paths(panels: Sequence[PathsPanel], columns: int, path: Path) -> None:
    """Draw panels in rows of ``columns`` to a file, SVG by its suffix and else PNG.

    Raises:
        OSError: The file cannot be written.
    """
    with styled():
        figure = paths_figure(panels, columns)
        write_bytes(path, (svg if path.suffix == ".svg" else png)(figure))


def paths_figure(panels: Sequence[PathsPanel], columns: int) -> Figure:
    """Draw panels in rows of ``columns``, all of a row with the same scale."""
    rows = -(-len(panels) // columns)
    width_in = WIDTH_IN / max(columns, 2)
    figure = new_figure(rows * (width_in + _TITLE_IN))
    figure.set_size_inches(width_in * columns, rows * (width_in + _TITLE_IN))
    grid = figure.subplots(rows, columns, squeeze=False)
    for k, axes in enumerate(grid.flat):
        if k < len(panels):
            row = panels[k - k % columns : k - k % columns + columns]
            _draw(axes, panels[k], max(_reach_m(panel) for panel in row))
        else:
            axes.set_axis_off()
    return figure


def _reach_m(panel: PathsPanel) -> float:
    return float(np.abs(panel.tracks_m).max()) + _BORDER_M


def _draw(axes: Axes, panel: PathsPanel, reach_m: float) -> None:
    axes.set_aspect("equal")
    axes.set_xlim(-reach_m, reach_m)
    axes.set_ylim(-reach_m, reach_m)
    axes.set_title(panel.title)
    axes.tick_params(labelsize=7)
    robots = panel.tracks_m.shape[1]
    colours = [colour(robot) for robot in range(robots)]
    width = 1.2 if robots <= 16 else 0.8
    lines = [panel.tracks_m[:, robot] for robot in range(robots)]
    axes.add_collection(LineCollection(lines, colors=colours, linewidths=width, alpha=0.85))
    hulls: List[Patch] = []
    for robot, goal in enumerate(panel.goals_m):
        start, end = panel.tracks_m[0, robot], panel.tracks_m[-1, robot]
        axes.plot(*start, ".", color=colours[robot], ms=3)
        axes.plot(*goal, "x", color=QUIET, ms=4, mew=0.8)
        hulls.append(
            Circle((end[0], end[1]), panel.body_radius_m, color=colours[robot], alpha=0.35)
        )
    for hull in hulls:
        axes.add_patch(hull)
