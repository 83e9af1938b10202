"""Picture of a mission before it flies: scene, costs, starts, goals, straight lines and plans."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any, List, Optional, Sequence, Tuple

import matplotlib.image
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.files.output import write_bytes
from quad_nav.grid import FREE, INSCRIBED, LETHAL, UNKNOWN
from quad_nav.report import style
from quad_nav.report.scene_drawing import MOVING, Extent, draw_hull, draw_scene, draw_starting
from quad_nav.report.style import (
    ALARM,
    QUIET,
    WIDTH_IN,
    centred_text,
    colour,
    new_figure,
    robot_legend,
)
from quad_nav.scenario.preview import MissionPreview, RobotPreview

SUFFIXES = (".png", ".svg", ".html")
_HALO = [withStroke(linewidth=2.5, foreground="white")]
_FULL_SIZE_UP_TO = 10  # robots; with more, symbols are smaller
# RViz's scheme "costmap": lethal magenta, inscribed cyan, others from blue to red.
_LETHAL_RGB, _INSCRIBED_RGB, _UNKNOWN_RGB = (255, 0, 255), (0, 255, 255), (112, 137, 134)
_INFLATED_RGB = (0, 0, 255)
_ALPHA = 0.35
_AROUND_GOAL_M = 0.6  # shown around goals outside of the scene
_MARGIN = 0.1  # widest margin for such goals, in parts of the scene's larger side


def cost_colours(costs: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return RViz's colours of costs, uint8[H, W, 4] of RGBA, transparent where it is free."""
    table = np.zeros((256, 4), dtype=np.uint8)
    part = np.linspace(0.0, 1.0, INSCRIBED - 1)
    table[1:INSCRIBED, 0] = np.round(255 * part)
    table[1:INSCRIBED, 2] = np.round(255 * (1.0 - part))
    table[INSCRIBED, :3], table[LETHAL, :3] = _INSCRIBED_RGB, _LETHAL_RGB
    table[UNKNOWN, :3] = _UNKNOWN_RGB
    table[FREE + 1 :, 3] = round(255 * _ALPHA)
    coloured: NDArray[np.uint8] = table[costs]
    return coloured


def cost_png(costmap: LayeredCostmap) -> bytes:
    """Encode a costmap in RViz's colours as PNG, with y upwards and one pixel for each cell."""
    buffer = io.BytesIO()
    colours = np.ascontiguousarray(cost_colours(costmap.costs)[::-1])  # older matplotlib needs it
    matplotlib.image.imsave(buffer, colours, format="png")
    return buffer.getvalue()


def costmap_extent(costmap: LayeredCostmap) -> Extent:
    """Return (x from, x to, y from, y to) of a costmap in ``map``."""
    spec = costmap.spec
    x, y = spec.origin_x_m, spec.origin_y_m
    return (x, x + spec.size_x * spec.resolution_m, y, y + spec.size_y * spec.resolution_m)


def shown_area(preview: MissionPreview, robots: Sequence[RobotPreview]) -> Extent:
    """Return the area that holds scene and goals, (x from, x to, y from, y to) in ``map``.

    Goals far outside of the scene, such as one at 90 instead of 9, are not in it.
    """
    scene = preview.scene
    places = [
        (goal.x_m + side * _AROUND_GOAL_M, goal.y_m + side * _AROUND_GOAL_M)
        for one in robots
        for goal in one.sequence.goals
        for side in (-1.0, 1.0)
        if scene is None or not scene.contains(goal.x_m, goal.y_m)
    ]
    if scene is not None:
        edge_m = scene.walls.thickness_m
        margin_m = max(_MARGIN * max(scene.size_x_m, scene.size_y_m), _AROUND_GOAL_M)
        low = np.array([scene.origin_x_m, scene.origin_y_m]) - margin_m
        high = np.array([scene.end_x_m, scene.end_y_m]) + margin_m
        clipped = np.clip(np.reshape(places, (-1, 2)), low, high)
        places = [(x_m, y_m) for x_m, y_m in clipped.tolist()]
        places += [
            (scene.origin_x_m - edge_m, scene.origin_y_m - edge_m),
            (scene.end_x_m + edge_m, scene.end_y_m + edge_m),
        ]
    if not places:
        return (0.0, 1.0, 0.0, 1.0)
    (x0, y0), (x1, y1) = np.min(places, axis=0), np.max(places, axis=0)
    return (float(x0), float(x1), float(y0), float(y1))


def write_picture(
    preview: MissionPreview, robots: Sequence[RobotPreview], title: str, path: Path
) -> None:
    """Write the picture as PNG or SVG, by the file's suffix.

    Raises:
        OSError: It cannot be written.
    """
    with style.styled():
        figure = preview_picture(preview, robots, title)
        encode = style.svg if path.suffix.lower() == ".svg" else style.png
        write_bytes(path, encode(figure))


def preview_picture(preview: MissionPreview, robots: Sequence[RobotPreview], title: str) -> Figure:
    """Draw the mission; faulty goals are red and have their reason beside them."""
    x0, x1, y0, y1 = shown_area(preview, robots)
    figure = new_figure((WIDTH_IN - 0.6) * min(max((y1 - y0) / (x1 - x0), 0.3), 1.6) + 1.3)
    axes = figure.subplots()
    draw_scene(axes, preview.scene)
    if preview.scene is not None:
        draw_starting(axes, preview.scene, preview.moving)
    costmap = preview.costmap(robots[0].number) if robots else None
    if costmap is not None:
        axes.imshow(
            cost_colours(costmap.costs),
            origin="lower",
            extent=costmap_extent(costmap),
            interpolation="nearest",
            zorder=2,
        )
    heading = f"{title}: quad fly refuses it" if preview.problems else title
    axes.set(xlim=(x0, x1), ylim=(y0, y1), xlabel="x (m)", ylabel="y (m)", title=heading)
    scale = min(1.0, (_FULL_SIZE_UP_TO / max(len(robots), 1)) ** 0.3)
    for robot in robots:
        _draw_robot(axes, robot, preview.robot_radius_m, scale)
    names = [robot.name for robot in robots]
    symbols = _symbols(costmap, any(any(one.faults) for one in robots), bool(preview.moving))
    robot_legend(figure, names, symbols)
    return figure


def _draw_robot(axes: Axes, robot: RobotPreview, radius_m: float, scale: float) -> None:
    number, tint = robot.number, colour(robot.number)
    stops = [(goal.x_m, goal.y_m) for goal in robot.sequence.goals]
    if robot.start is not None:
        here = np.array([robot.start.x_m, robot.start.y_m])
        draw_hull(axes, number, here, robot.start.yaw_rad, radius_m)
        axes.plot(*here, "s", ms=12 * scale, color=tint, mec="white", zorder=8)
        centred_text(axes, (here[0], here[1]), str(number), 7.5 * scale, "white", zorder=10)
        stops.insert(0, (robot.start.x_m, robot.start.y_m))
    axes.plot(*np.transpose(stops), color=tint, lw=1.0 * scale, ls=(0, (2, 2)), zorder=4)
    for plan in robot.plans:
        axes.plot(plan[:, 0], plan[:, 1], color=tint, lw=1.8 * scale, zorder=5)
    for index, goal in enumerate(robot.sequence.goals):
        _draw_goal(axes, robot, index, (goal.x_m, goal.y_m), goal.yaw_rad, scale)


def _draw_goal(
    axes: Axes,
    robot: RobotPreview,
    index: int,
    place: Tuple[float, float],
    yaw_rad: Optional[float],
    scale: float,
) -> None:
    fault = robot.faults[index]
    place, aim, far = _at_edge(axes, place)
    tint: Any = ALARM if fault else colour(robot.number)
    if yaw_rad is not None:
        ahead = (16 * scale * np.cos(yaw_rad), 16 * scale * np.sin(yaw_rad))
        arrow = {"arrowstyle": "<|-", "color": tint, "lw": 1.5, "shrinkA": 0, "shrinkB": 7 * scale}
        axes.annotate("", place, ahead, textcoords="offset points", arrowprops=arrow, zorder=8)
    if far:
        arrow = {"arrowstyle": "-|>", "color": tint, "lw": 1.5, "shrinkA": 7 * scale, "shrinkB": 0}
        axes.annotate("", aim, place, textcoords="data", arrowprops=arrow, zorder=8)
    face = "white" if fault else tint
    axes.plot(*place, "o", ms=15 * scale, color=face, mec=tint, mew=1.8 * scale, zorder=9)
    centred_text(axes, place, str(index + 1), 9 * scale, tint if fault else "white", zorder=10)
    if fault:
        is_left = place[0] < sum(axes.get_xlim()) / 2
        axes.annotate(
            far + fault.split(";")[0],
            place,
            (11 * scale if is_left else -11 * scale, 8 * scale),
            textcoords="offset points",
            ha="left" if is_left else "right",
            fontsize=8,
            color=ALARM,
            path_effects=_HALO,
            zorder=12,
            annotation_clip=True,
        )


def _at_edge(axes: Axes, place: Tuple[float, float]) -> Tuple[Tuple[float, float], Any, str]:
    """Return where a goal is drawn, and for one outside of the picture an arrow's end and a text.

    It stands beside the edge, and the arrow and the text say where it is.
    """
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    inset_m = 0.05 * max(x1 - x0, y1 - y0)
    x_m = min(max(place[0], x0 + inset_m), x1 - inset_m)
    y_m = min(max(place[1], y0 + inset_m), y1 - inset_m)
    if x0 <= place[0] <= x1 and y0 <= place[1] <= y1:
        return place, None, ""
    ahead = np.array(place) - (x_m, y_m)
    aim = (x_m, y_m) + 0.9 * inset_m * ahead / np.hypot(*ahead)
    return (x_m, y_m), tuple(aim), f"({place[0]:g}, {place[1]:g}) "


def _symbols(costmap: Optional[LayeredCostmap], has_faults: bool, has_moving: bool) -> List[Any]:
    def line(label: str, **looks: Any) -> Line2D:
        return Line2D([], [], label=label, **{"color": QUIET, "mec": QUIET, **looks})

    found: List[Any] = [
        line("start", ls="", marker="s", ms=8),
        line("goal", ls="", marker="o", ms=8),
        line("straight line", lw=1.0, ls=(0, (2, 2))),
        line("global plan", lw=1.8),
    ]
    if has_faults:
        found.append(line("refused goal", ls="", marker="o", ms=8, color="white", mec=ALARM))
    if has_moving:
        found.append(Patch(color=MOVING, label="moving obstacle"))
    if costmap is not None:
        kinds = {"lethal": _LETHAL_RGB, "inscribed": _INSCRIBED_RGB, "inflated": _INFLATED_RGB}
        for label, (red, green, blue) in kinds.items():
            rgba = (red / 255, green / 255, blue / 255, _ALPHA)
            found.append(Patch(color=rgba, label=label))
    return found
