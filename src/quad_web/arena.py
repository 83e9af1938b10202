"""What the browser draws by itself: the arena, in 2D from above and in 3D, and the charts.

The modules in ``static`` draw; they get the items from the stream by themselves. Python says what
is shown and which tool the pointer has, and hears what the person does.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, List, Mapping, Sequence

import nicegui
from nicegui import ui
from nicegui.dependencies import register_resource

from quad_web.view.actions import GoalChange, Role

STATIC = Path(__file__).parent / "static"
LIBRARIES = Path(nicegui.__file__).parent / "elements" / "lib"

SHOWN = {
    "trail": "Trails",
    "plan": "Global plans",
    "local_plan": "Local plans",
    "scan": "LIDAR points",
    "global_costmap": "Global costmap",
    "local_costmap": "Local costmap",
    "cell": "Voronoi cells",
    "track": "Tracked obstacles",
    "localization": "Localisation",
    "goals": "Goals",
    "yields": "Yields",
    "contacts": "Contacts",
    "labels": "Numbers",
}
"""What can be switched on and off in the arena, with its name for people."""

SHOWN_AT_FIRST = [name for name in SHOWN if name not in ("global_costmap", "local_costmap", "cell")]

_KEYS = "Arena: arrows move the view, plus and minus zoom, n and p select a robot"


def static_path() -> str:
    """Return the address of ``static`` on the server, another one when a file has changed."""
    newest_s = max(path.stat().st_mtime for path in STATIC.iterdir())
    resource = register_resource(STATIC, max_time=newest_s)
    return f"/_nicegui/{nicegui.__version__}/resources/{resource.key}"


class BrowserView(
    ui.element,
    component="static/view.js",
    dependencies=[
        LIBRARIES / "echarts" / "echarts.min.js",
        LIBRARIES / "three" / "three.module.js",
        LIBRARIES / "three" / "modules" / "OrbitControls.js",
        LIBRARIES / "three" / "modules" / "BufferGeometryUtils.js",
    ],
):
    """What a module of ``static`` draws; ``state`` is what it was told."""

    def __init__(self, module: str, **state: Any) -> None:
        super().__init__()
        ui.add_css(STATIC / "arena.css")
        self.state: Dict[str, Any] = state
        self._props.update(resource_path=static_path(), module=module, state=state)

    def apply(self, **changes: Any) -> None:
        """Change parts of the state; the module's ``apply`` says which there are."""
        self.state.update(changes)
        self.run_method("apply", changes)


class Arena(BrowserView):
    """The arena; its events are "select", "goal", "pose", "edit", "tool", "mode" and "follow".

    A page that only watches has the tool "view" alone.
    """

    def __init__(self, role: Role) -> None:
        super().__init__(
            "arena_view.js",
            role=role.value,
            selected=None,
            layers=SHOWN_AT_FIRST,
            mode="2d",
            tool="view",
            following=False,
            editing=None,
        )
        self.classes("quad-arena").props("tabindex=0 role=application")
        self.props["aria-label"] = _KEYS
        self._remember("select", "selected")
        self._remember("tool", "tool")
        self._remember("mode", "mode")
        self._remember("follow", "following")

    def _remember(self, event_name: str, entry: str) -> None:
        self.on(event_name, lambda event: self.state.update({entry: event.args}))


class Charts(BrowserView):
    """Charts of gap, clearance, speed and control-cycle time over the last minute.

    There is a line for each robot of a small fleet, the band from the least to the greatest value
    of a large one, and a bold line for the selected robot. The charts fill their parent, which
    needs a height: 180 pixels for one row, 300 for two, which they take below 860 pixels of width.
    """

    def __init__(self) -> None:
        super().__init__("charts_view.js", selected=None)
        self.classes("quad-charts").props("role=img aria-label=Charts")


def goal_pose(args: Mapping[str, Any]) -> Any:
    """Return x, y (m) and yaw (rad; None: any) of a goal that the page has sent.

    Raises:
        ValueError: They are not finite numbers.
    """
    yaw = args["yaw"]
    numbers = [float(args["x"]), float(args["y"]), *([] if yaw is None else [float(yaw)])]
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError(f"goal {args} of the page; expected finite numbers")
    return numbers[0], numbers[1], None if yaw is None else numbers[2]


def edited_goals(args: Sequence[Mapping[str, Any]]) -> List[GoalChange]:
    """Return all goals of the edited robot as the page has sent them."""
    return [
        GoalChange(None if goal["source"] is None else int(goal["source"]), *goal_pose(goal))
        for goal in args
    ]
