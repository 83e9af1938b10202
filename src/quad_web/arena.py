"""What the browser draws by itself: the arena, in 2D from above and in 3D, and the charts.

The modules in ``static`` draw; they get the items from the stream by themselves. Python says what
is shown and which tool the pointer has, and hears what the person does.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence

import nicegui
from nicegui import ui
from nicegui.dependencies import register_resource

from quad_web.view.actions import GoalChange, Role

STATIC = Path(__file__).parent / "static"
LIBRARIES = Path(nicegui.__file__).parent / "elements" / "lib"
MODES = ("2d", "3d")
TOOLS = ("view", "goal", "edit")

SHOWN = {
    "trail": "Trails",
    "plan": "Global plans",
    "local_plan": "Local plans",
    "scan": "LIDAR points",
    "global_costmap": "Global costmap",
    "local_costmap": "Local costmap",
    "cell": "Voronoi cells",
    "track": "Tracked obstacles",
    "goals": "Goals",
    "yields": "Yields",
    "contacts": "Contacts",
    "labels": "Numbers",
}
"""What can be switched on and off in the arena, with its name for people."""

SHOWN_AT_FIRST = (
    "trail",
    "plan",
    "local_plan",
    "scan",
    "track",
    "goals",
    "yields",
    "contacts",
    "labels",
)


def static_path() -> str:
    """Return the address of ``static`` on the server, another one when a file has changed."""
    newest_s = max(path.stat().st_mtime for path in STATIC.iterdir())
    resource = register_resource(STATIC, max_time=newest_s)
    return f"/_nicegui/{nicegui.__version__}/resources/{resource.key}"


class Arena(
    ui.element,
    component="static/arena.js",
    dependencies=[
        LIBRARIES / "three" / "three.module.js",
        LIBRARIES / "three" / "modules" / "OrbitControls.js",
        LIBRARIES / "three" / "modules" / "BufferGeometryUtils.js",
    ],
):
    """The arena.

    Args:
        role: A page that only watches has the tool "view" alone.
    """

    def __init__(self, role: Role) -> None:
        super().__init__()
        ui.add_css(STATIC / "arena.css")
        self._role = role
        self._state: Dict[str, Any] = {
            "role": role.value,
            "selected": None,
            "layers": list(SHOWN_AT_FIRST),
            "mode": "2d",
            "tool": "view",
            "following": False,
            "editing": None,
        }
        self._props["resource_path"] = static_path()
        self._props["state"] = self._state
        self._remember("select", "selected", _robot)
        self._remember("tool", "tool", str)
        self._remember("mode", "mode", str)
        self._remember("follow", "following", bool)
        self.on("edit", self._remember_goals)

    # -- what Python says ------------------------------------------------------------

    @property
    def selected(self) -> Optional[int]:
        """Number of the selected robot, None without one."""
        return self._state["selected"]

    @property
    def tool(self) -> str:
        """The pointer's tool, one of ``TOOLS``."""
        return self._state["tool"]

    def select(self, robot: Optional[int]) -> None:
        """Select a robot; None selects none."""
        self._apply(selected=robot)

    def follow(self, is_followed: bool) -> None:
        """Keep the selected robot in the middle, or stop to."""
        self._apply(following=is_followed)

    def set_layers(self, layers: Sequence[str]) -> None:
        """Show these of ``SHOWN``.

        Raises:
            ValueError: A name is unknown.
        """
        unknown = sorted(set(layers) - set(SHOWN))
        if unknown:
            raise ValueError(f"layers: {unknown} are unknown; expected some of {list(SHOWN)}")
        self._apply(layers=list(layers))

    def set_mode(self, mode: str) -> None:
        """Show the arena from above ("2d") or in space ("3d").

        Raises:
            ValueError: It is neither.
        """
        if mode not in MODES:
            raise ValueError(f"mode {mode!r}; expected one of {MODES}")
        self._apply(mode=mode)

    def set_tool(self, tool: str) -> None:
        """Set what the pointer does: select ("view"), send goals ("goal") or edit them ("edit").

        A page that only watches keeps "view".

        Raises:
            ValueError: The tool is unknown.
        """
        if tool not in TOOLS:
            raise ValueError(f"tool {tool!r}; expected one of {TOOLS}")
        self._apply(tool=tool if self._role is Role.STEER else "view")

    def edit_goals(
        self,
        robot: Optional[int],
        goals: Sequence[Mapping[str, Any]] = (),
        faults: Sequence[str] = (),
    ) -> None:
        """Show goals that can be edited; None ends it.

        Args:
            robot: Number of the robot.
            goals: ``source`` (number in the file or None), ``x``, ``y`` and ``yaw`` (or None).
            faults: What is wrong with each goal, "" for nothing.
        """
        editing = None
        if robot is not None:
            editing = {"robot": robot, "goals": [dict(g) for g in goals], "faults": list(faults)}
        self._apply(editing=editing)

    def _apply(self, **changes: Any) -> None:
        self._state.update(changes)
        self.run_method("apply", changes)

    # -- what the person does --------------------------------------------------------

    def on_select(self, callback: Callable[[Optional[int]], Any]) -> None:
        """Call with the number of a robot that was clicked, None for a click beside all."""
        self.on("select", lambda event: callback(_robot(event.args)))

    def on_goal(self, callback: Callable[[float, float, Optional[float]], Any]) -> None:
        """Call with x, y (m) and yaw (rad; None: any) of a goal for the selected robot."""
        self.on("goal", lambda event: callback(*_pose(event.args)))

    def on_edit(self, callback: Callable[[List[GoalChange]], Any]) -> None:
        """Call with all goals of the edited robot after each change."""
        self.on("edit", lambda event: callback(_goals(event.args)))

    def on_tool(self, callback: Callable[[str], Any]) -> None:
        """Call with the tool when the person leaves one."""
        self.on("tool", lambda event: callback(event.args))

    def on_mode(self, callback: Callable[[str], Any]) -> None:
        """Call with "2d" when the browser cannot draw in 3D."""
        self.on("mode", lambda event: callback(event.args))

    def on_link(self, callback: Callable[[bool], Any]) -> None:
        """Call with whether the stream is alive, when that changes."""
        self.on("link", lambda event: callback(event.args))

    def _remember(self, event_name: str, entry: str, kind: Callable[[Any], Any]) -> None:
        def remember(event: Any) -> None:
            self._state[entry] = kind(event.args)

        self.on(event_name, remember)

    def _remember_goals(self, event: Any) -> None:
        if self._state["editing"]:
            self._state["editing"] = {**self._state["editing"], "goals": event.args, "faults": []}


class Charts(
    ui.element,
    component="static/charts.js",
    dependencies=[LIBRARIES / "echarts" / "echarts.min.js"],
):
    """Charts of gap, clearance, speed and control-cycle time over the last minute.

    There is a line for each robot of a small fleet, the band from the least to the greatest value
    of a large one, and a bold line for the selected robot. The charts fill their parent, which
    needs a height: 180 pixels for one row, 300 for two, which they take below 860 pixels of width.
    """

    def __init__(self) -> None:
        super().__init__()
        ui.add_css(STATIC / "charts.css")
        self._props["resource_path"] = static_path()
        self._props["selected"] = None

    def select(self, robot: Optional[int]) -> None:
        """Draw the lines of one robot bold; None: of no robot."""
        self._props["selected"] = robot
        self.run_method("select", robot)


def _robot(args: Any) -> Optional[int]:
    return None if args is None else int(args)


def _pose(args: Mapping[str, Any]) -> Any:
    """Return x, y and yaw of a message from the page.

    Raises:
        ValueError: They are not finite numbers.
    """
    yaw = args["yaw"]
    numbers = [float(args["x"]), float(args["y"]), *([] if yaw is None else [float(yaw)])]
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError(f"goal {args} of the page; expected finite numbers")
    return numbers[0], numbers[1], None if yaw is None else numbers[2]


def _goals(args: Sequence[Mapping[str, Any]]) -> List[GoalChange]:
    return [
        GoalChange(None if goal["source"] is None else int(goal["source"]), *_pose(goal))
        for goal in args
    ]
