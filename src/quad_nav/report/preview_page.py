"""Page of a mission before it flies: one HTML file, and the data that its script draws."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence

import jinja2
import numpy as np
from numpy.typing import NDArray

from quad_nav.report.preview_picture import cost_png, costmap_extent, shown_area
from quad_nav.report.scene_drawing import MOVING, keyframe_paths, outlines
from quad_nav.scenario.preview import MissionPreview, RobotPreview
from quad_nav.sim.colours import robot_rgba

_DIGITS = 3  # of coordinates in metres


def page_data(
    preview: MissionPreview, robots: Sequence[RobotPreview], title: str
) -> Dict[str, Any]:
    """Return everything that the page's script draws, ready for JSON.

    Args:
        preview: The mission.
        robots: Its robots with goals.
        title: Heading of the page.
    """
    scene = preview.scene
    solids, passed = outlines(scene) if scene else ([], [])
    return {
        "title": title,
        "area": list(shown_area(preview, robots)),
        "radius": preview.robot_radius_m,
        "costmap": _costmap(preview, robots),
        "solids": _lines(solids),
        "passed": _lines(passed),
        "moving": _lines([one.outline_m() for one in preview.moving]),
        "motions": _lines(keyframe_paths(scene) if scene else []),
        "movingColor": MOVING,
        "robots": [
            {**_robot_data(robot), "file": str(preview.files.get(robot.number, ""))}
            for robot in robots
        ],
        "problems": list(preview.problems),
        "warnings": list(preview.warnings),
    }


def preview_page(data: Mapping[str, Any]) -> str:
    """Render the page.

    Args:
        data: Result of ``page_data``.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([Path(__file__).parent]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    return environment.get_template("preview.html.jinja").render(data=data)


def _robot_data(robot: RobotPreview) -> Dict[str, Any]:
    """Return what the page's script draws of one robot, ready for JSON."""
    start = robot.start
    return {
        "number": robot.number,
        "name": robot.name,
        "color": _css(robot.number),
        "start": [start.x_m, start.y_m, start.yaw_rad] if start else None,
        "goals": [
            {"x": goal.x_m, "y": goal.y_m, "yaw": goal.yaw_rad, "fault": fault}
            for goal, fault in zip(robot.sequence.goals, robot.faults)
        ],
        "plans": [np.round(plan, _DIGITS).tolist() for plan in robot.plans],
        "warnings": list(robot.warnings),
    }


def _lines(lines: Sequence[NDArray[np.float64]]) -> List[Any]:
    return [np.round(line, _DIGITS).tolist() for line in lines]


def _costmap(preview: MissionPreview, robots: Sequence[RobotPreview]) -> Optional[Dict[str, Any]]:
    """Return the first robot's global costmap as a picture with its extent."""
    costmap = preview.costmap(robots[0].number) if robots else None
    if costmap is None:
        return None
    picture = base64.b64encode(cost_png(costmap)).decode("ascii")
    extent: List[float] = list(costmap_extent(costmap))
    return {"extent": extent, "href": f"data:image/png;base64,{picture}"}


def _css(robot: int) -> str:
    red, green, blue = (round(255 * part) for part in robot_rgba(robot)[:3])
    return f"rgb({red}, {green}, {blue})"
