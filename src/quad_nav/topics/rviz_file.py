"""Make an RViz configuration for any number of quadcopters from the one for two.

    python -m quad_nav.topics.rviz_file --robots 8 > fleet.rviz

The group of quadcopter 0 is the template for all. With more than `MAX_WITH_ALL_DISPLAYS`
quadcopters, only plans and flown paths are enabled at first. The other displays stay disabled
until the user enables them; a disabled display does not subscribe and costs nothing.
"""

from __future__ import annotations

import argparse
import copy
import math
import sys
from typing import Any, Dict, List, Sequence, Tuple

import yaml

from quad_nav.errors import InputError, printable
from quad_nav.files.shipped import shipped
from quad_nav.scenario import RANDOM
from quad_nav.scenario.scenario import scene_of
from quad_nav.sim.colours import robot_rgba
from quad_nav.sim.scene import Scene

MAX_WITH_ALL_DISPLAYS = 4
_ENABLED_FOR_MANY = ("Global plan", "Flown path")
_WINDOW_PX = 750.0  # the shorter side of the view in an ordinary window
EXIT_BAD_INPUT = 2


def document(robots: int, scene: Scene) -> Dict[str, Any]:
    """Return the content of a .rviz file; the scene sets the grid and the view."""
    template = yaml.safe_load(shipped("rviz", "quad_multi.rviz").read_text(encoding="utf-8"))
    manager = template["Visualization Manager"]
    displays = manager["Displays"]
    group = next(one for one in displays if one["Name"] == "Quadcopter 0")
    general = [one for one in displays if not one["Name"].startswith("Quadcopter ")]
    for display in general:
        _fit_general(display, robots, scene)
    manager["Displays"] = general + [_of_robot(group, number, robots) for number in range(robots)]
    manager["Tools"] = _tools(manager["Tools"], robots)
    for view in (manager["Views"]["Current"], *manager["Views"].get("Saved", ())):
        _centre(view, scene)
    _fold(template, robots)
    return template


def _fit_general(display: Dict[str, Any], robots: int, scene: Scene) -> None:
    if display["Class"] == "rviz/Grid":
        cells = math.ceil(max(scene.size_x_m, scene.size_y_m))
        display["Plane Cell Count"] = cells
        display["Offset"] = {
            "X": scene.origin_x_m + 0.5 * cells,
            "Y": scene.origin_y_m + 0.5 * cells,
            "Z": 0,
        }
    elif display["Class"] == "rviz/TF" and robots > MAX_WITH_ALL_DISPLAYS:
        display["Enabled"] = display["Value"] = False


def _of_robot(group: Dict[str, Any], number: int, robots: int) -> Dict[str, Any]:
    """Copy the template with another quadcopter's number and colours."""
    own = _renumbered(group, number)
    for display in own["Displays"]:
        if robots > MAX_WITH_ALL_DISPLAYS:
            display["Enabled"] = display["Value"] = display["Name"] in _ENABLED_FOR_MANY
    return own


def _renumbered(value: Any, number: int) -> Any:
    """Replace names, topics and colours of quadcopter 0 by those of another."""
    if isinstance(value, dict):
        return {key: _renumbered(one, number) for key, one in value.items()}
    if isinstance(value, list):
        return [_renumbered(one, number) for one in value]
    if isinstance(value, str):
        if value == "Quadcopter 0":
            return f"Quadcopter {number}"
        if value == _rgb(0):
            return _rgb(number)
        if value.startswith("/"):
            return (
                value.replace("/move_base0/", f"/move_base{number}/", 1)
                if "/move_base0/" in value
                else _with_number(value, number)
            )
    return copy.copy(value)


def _with_number(value: Any, number: int) -> Any:
    """Replace the 0 at the end of a topic or a class."""
    return value[:-1] + str(number) if isinstance(value, str) and value.endswith("0") else value


def _tools(tools: Sequence[Dict[str, Any]], robots: int) -> List[Dict[str, Any]]:
    """Return numbered tools for each quadcopter, if these are few, and all others.

    Larger fleets have the tools of `goal_router`: for the selected or the nearest quadcopter.
    """
    made: List[Dict[str, Any]] = []
    for tool in tools:
        if not tool["Class"][-1].isdigit():
            made.append(tool)
        elif tool["Class"].endswith("0") and robots <= MAX_WITH_ALL_DISPLAYS:
            made += [
                {key: _with_number(value, number) for key, value in tool.items()}
                for number in range(robots)
            ]
    return made


def _centre(view: Dict[str, Any], scene: Scene) -> None:
    """Fit the view to the whole arena."""
    middle_x_m = scene.origin_x_m + 0.5 * scene.size_x_m
    middle_y_m = scene.origin_y_m + 0.5 * scene.size_y_m
    longest_m = max(scene.size_x_m, scene.size_y_m)
    if view["Class"] == "rviz/TopDownOrtho":
        view["X"], view["Y"] = middle_x_m, middle_y_m
        view["Scale"] = _WINDOW_PX / longest_m
    elif "Focal Point" in view:
        view["Focal Point"] = {"X": middle_x_m, "Y": middle_y_m, "Z": 0}
        view["Distance"] = 1.5 * longest_m


def _fold(template: Dict[str, Any], robots: int) -> None:
    for panel in template["Panels"]:
        if panel["Class"] == "rviz/Displays" and robots > MAX_WITH_ALL_DISPLAYS:
            panel["Property Tree Widget"]["Expanded"] = []


def _rgb(number: int) -> str:
    return "; ".join(str(round(255 * part)) for part in robot_rgba(number)[:3])


def arguments(words: Sequence[str]) -> Tuple[argparse.Namespace, List[str]]:
    """Parse the command line; the second value holds the unknown words, for RViz."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("--robots", type=int, required=True)
    # vehicles.launch gives no scene for a room that is unknown: the arena has its size, about.
    arena = str(shipped("scenes", "arena.yaml"))
    parser.add_argument("--scene", default=RANDOM, nargs="?", const=arena)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size", type=float, default=0.0)
    return parser.parse_known_args(words)


def main() -> int:
    """Print the configuration; return 0, or 2 for arguments that are not valid."""
    given, _ = arguments(sys.argv[1:])
    try:
        yaml.safe_dump(document(given.robots, scene_of(vars(given))), sys.stdout, sort_keys=False)
    except InputError as error:
        print(printable(error, "\n"), file=sys.stderr)
        return EXIT_BAD_INPUT
    return 0


if __name__ == "__main__":
    sys.exit(main())
