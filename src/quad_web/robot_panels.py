"""Table of robots, and the card of the selected one with what it can be told.

``data-testid``: ``robots`` (rows ``robots-row-<number>``); ``card``, ``card-name``, ``card-state``,
``card-facts``, ``goal-tool``, ``goal-x``, ``goal-y``, ``goal-yaw``, ``goal-send``, ``goal-fault``,
``pose-set``, ``cancel``, ``clear-costmaps``, ``lidar``, ``search``, ``deselect``.
"""

from __future__ import annotations

import math
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple, Union

import numpy as np
from nicegui import ui
from numpy.typing import NDArray

from quad_nav.errors import printable
from quad_nav.geometry import Pose2D
from quad_nav.topics.robot_topics import COLUMNS
from quad_web.flight_bar import enable, why_idle
from quad_web.goal_draft import entry_fault
from quad_web.live_table import LiveTable, column
from quad_web.page_client import PageClient
from quad_web.view.state import FleetState

_HINT = "Click one in the table or in the arena. A goal goes to the nearest one."
_FACTS = ("position", "heading", "speed", "goal", "gap", "recoveries left")
_LOCALIZATION = "localisation"
_STEP_S = 0.5  # ages below are shown as one, so that an idle row does not change

_COLUMNS = [
    column("robot", "#", "robot", align="right"),
    column("state", "state", "state", hint="reason"),
    column("goal", "goal"),
    *(column(topic.name, topic.column, digits=2, align="right") for topic in COLUMNS),
    column("speed_mps", "m/s", digits=2, align="right"),
    column("gap_m", "gap m", digits=2, align="right"),
    column("recoveries", "recov", "battery"),
    column("age", "last", align="right"),
]


def table_row(status: Mapping[str, Any], colour: str) -> Dict[str, Any]:
    """Return a row of the item ``status`` as a row of the table; its source says if it is lost."""
    goal, goals, age_s = status.get("goal"), status.get("goals"), status.get("age_s")
    return {
        "key": status["robot"],
        "robot": status["robot"],
        "colour": colour,
        "state": printable(status.get("state", "")),
        "reason": printable(status.get("reason", "")),
        "goal": None if goal is None else f"{goal}/{goals}" if goals else str(goal),
        **{topic.name: _rounded(status.get(topic.name)) for topic in COLUMNS},
        "speed_mps": _rounded(status.get("speed_mps")),
        "gap_m": _rounded(status.get("gap_m")),
        "recoveries": status.get("recoveries"),
        "age": age_text(age_s),
        "lost": status.get("state") == "lost",
    }


def age_text(age_s: Optional[float]) -> str:
    """Return the age of a robot's last message for people; "now" below half a second."""
    if age_s is None:
        return "never"
    if age_s < _STEP_S:
        return "now"
    return f"{age_s:.1f} s" if age_s < 10.0 else f"{age_s:.0f} s"


def _rounded(value: Optional[float]) -> Optional[float]:
    return None if value is None else round(float(value), 2)


class RobotTable:
    """All robots; a click selects one and follows it."""

    def __init__(self, client: PageClient, follow: Callable[[], None]) -> None:
        self._client = client
        self._follow = follow
        sort = {"sortBy": "robot", "descending": False}
        self._table = LiveTable(_COLUMNS, "robots", "no robots yet", self._pick, sort=sort)
        client.on_select(self._table.select)

    def refresh(self) -> None:
        """Show the item ``status`` as it is now."""
        colour = self._client.colour
        self._table.set_rows([table_row(row, colour(row["robot"])) for row in self._client.rows()])

    def _pick(self, robot: int) -> None:
        self._client.select(robot)
        self._follow()


def pose_of(state: FleetState, robot: int) -> Optional[Pose2D]:
    """Return a robot's pose in ``map``, None if it is not known."""
    poses = _poses(state)
    if not 0 <= robot < len(poses) or not np.isfinite(poses[robot]).all():
        return None
    return Pose2D(float(poses[robot][0]), float(poses[robot][1]), float(poses[robot][5]))


def _poses(state: FleetState) -> NDArray[np.float32]:
    """Return the array of the item ``poses``, without robots if there is none."""
    item = state.item("poses")
    return np.zeros((0, 9), np.float32) if item is None else item.arrays["pose"]


def nearest_robot(state: FleetState, x_m: float, y_m: float) -> Optional[int]:
    """Return the robot that is nearest to a position in ``map``, None without poses."""
    poses = _poses(state)
    distances = np.hypot(poses[:, 0] - x_m, poses[:, 1] - y_m)
    return None if np.isnan(distances).all() else int(np.nanargmin(distances))


def goal_pose(
    state: FleetState, robot: Optional[int], x_m: float, y_m: float, yaw_rad: Optional[float]
) -> Pose2D:
    """Return a goal in ``map`` for a robot, None for the nearest; without a yaw it looks ahead."""
    if yaw_rad is not None:
        return Pose2D(x_m, y_m, yaw_rad)
    number = nearest_robot(state, x_m, y_m) if robot is None else robot
    here = None if number is None else pose_of(state, number)
    if here is None:
        return Pose2D(x_m, y_m)
    return Pose2D(x_m, y_m, math.atan2(y_m - here.y_m, x_m - here.x_m))


def typed_number(text: Any) -> Union[float, str, None]:
    """Return what was typed as a number if it is one, None if nothing was typed."""
    stripped = str(text if text is not None else "").strip()
    if not stripped:
        return None
    try:
        return float(stripped)
    except ValueError:
        return stripped


class RobotCard:
    """The selected robot: what it does, and what it can be told."""

    def __init__(self, client: PageClient, set_tool: Callable[[str], None]) -> None:
        """Make the card; ``set_tool`` is that of the arena."""
        self._client = client
        self._set_tool = set_tool
        with ui.element("div").classes("card").props("data-testid=card"):
            self._make_head()
            self._facts = ui.element("dl").classes("facts").props("data-testid=card-facts")
            self._make_facts()
            self._make_actions()
            self._make_goal()
        client.on_select(lambda robot: self.refresh())
        self.refresh()

    def _make_head(self) -> None:
        with ui.element("div").classes("card-head"):
            self._dot = ui.element("span").classes("dot")
            self._name = ui.label().classes("card-name").props("data-testid=card-name")
            self._name.tag = "h2"
            self._state = ui.label().classes("chip state").props("data-testid=card-state")
            ui.space()
            self._deselect = ui.button(icon="close", on_click=lambda: self._client.select(None))
            self._deselect.props(
                "flat dense round size=sm data-testid=deselect title=Deselect aria-label=Deselect"
            )
        self._reason = ui.label().classes("muted")

    def _make_facts(self) -> None:
        self._values: Dict[str, ui.label] = {}
        with self._facts:
            for name in (*_FACTS, _LOCALIZATION):
                with ui.element("div") as self._located:  # the last one is that of localization
                    with ui.element("dt"):
                        ui.label(name)
                    with ui.element("dd"):
                        self._values[name] = ui.label("–")
            self._located.classes("wide")

    def _make_actions(self) -> None:
        client = self._client
        with ui.element("div").classes("actions"):
            self._cancel = ui.button("Cancel goal", icon="cancel", on_click=self._call("cancel"))
            self._cancel.props("outline dense no-caps data-testid=cancel")
            clear = self._call("clear_costmaps")
            self._clear = ui.button("Clear costmaps", icon="layers_clear", on_click=clear)
            self._clear.props("outline dense no-caps data-testid=clear-costmaps")
            self._lidar = ui.switch("LIDAR").props("dense data-testid=lidar")
            self._lidar.on("update:model-value", self._switch_lidar)
            self._lidar_shown: Optional[Tuple[int, bool]] = None
            search = self._call("set_uniform")
            self._search = ui.button("Global localisation", icon="travel_explore", on_click=search)
            self._search.props("outline dense no-caps data-testid=search")
            self._controls = (
                (self._cancel, "cancel"),
                (self._clear, "clear_costmaps"),
                (self._lidar, "enable_lidar"),
                (self._search, "set_uniform"),
            )
            for element, name in self._controls:
                enable(element, client, name)

    def _make_goal(self) -> None:
        client = self._client
        with ui.element("div").classes("goal-form"):
            tool = ui.button("Goal in the arena", icon="add_location_alt")
            tool.props("outline dense no-caps data-testid=goal-tool")
            tool.on_click(lambda: self._set_tool("goal"))
            self._fields = [
                ui.input(label).props(f"dense outlined inputmode=decimal data-testid=goal-{name}")
                for name, label in (("x", "x, m"), ("y", "y, m"), ("yaw", "yaw, rad"))
            ]
            send = ui.button("Send", on_click=self._send_typed)
            send.props("unelevated dense no-caps data-testid=goal-send")
            self._set = ui.button("Set pose", on_click=lambda: self._take_typed(self.set_pose))
            self._set.props("outline dense no-caps data-testid=pose-set")
            enable(self._set, client, "set_pose")
            for field in self._fields:
                field.on("keydown.enter", self._send_typed)
            for element in (tool, *self._fields, send):
                enable(element, client, "send_goal")
        self._fault = ui.label().classes("fault").props("data-testid=goal-fault")

    # -- what it shows ---------------------------------------------------------------

    def refresh(self) -> None:
        """Show the selected robot as it is now."""
        client, robot = self._client, self._client.selected
        row = client.row(robot)
        self._name.text = "No robot selected" if robot is None else client.name(robot)
        self._dot.style(f"background: {client.colour(robot) if row else 'transparent'}")
        self._deselect.set_visibility(robot is not None)
        self._facts.set_visibility(row is not None)
        state = table_row(row, "")["state"] if row else ""
        self._state.props["data-state"] = state
        self._state.text = state  # sends the property, too
        hint = _HINT if robot is None else ""
        self._reason.text = printable(row.get("reason", "")) if row else hint
        self._reason.set_visibility(bool(self._reason.text))
        for element, name in self._controls:
            element.set_enabled(row is not None and not why_idle(client, name))
        self._show_localization((row or {}).get("localization") or {})
        if row is not None and robot is not None:
            self._show_facts(row, robot)
            self._show_lidar(robot, bool(row.get("lidar", True)))

    def _show_localization(self, located: Mapping[str, Any]) -> None:
        """Show the controls and the figures of a localization, if one runs."""
        self._located.set_visibility(bool(located))
        self._set.set_visibility(bool(located))
        self._search.set_visibility(bool(located.get("searches")))
        self._values[_LOCALIZATION].text = localization_text(located)

    def _show_lidar(self, robot: int, is_on: bool) -> None:
        """Set the switch when the state changes: after a click the row is old for a moment."""
        if (robot, is_on) != self._lidar_shown:
            self._lidar_shown = (robot, is_on)
            self._lidar.value = is_on

    def _show_facts(self, row: Mapping[str, Any], robot: int) -> None:
        pose = pose_of(self._client.state, robot)
        shown = table_row(row, "")
        used = row.get("recoveries")
        facts = {
            "position": f"{pose.x_m:.2f}, {pose.y_m:.2f} m" if pose else "–",
            "heading": f"{math.degrees(pose.yaw_rad):.0f}°" if pose else "–",
            "speed": with_unit(shown["speed_mps"], "m/s"),
            "goal": _goal_text(shown["goal"], shown["goal_distance"]),
            "gap": with_unit(shown["gap_m"], "m"),
            "recoveries left": f"{used[1] - used[0]} of {used[1]}" if used and used[1] else "–",
        }
        for name, text in facts.items():
            self._values[name].text = text

    # -- what it does ----------------------------------------------------------------

    def _call(self, name: str) -> Callable[[], Any]:
        async def call() -> None:
            robot = self._client.selected
            if robot is not None:
                await self._client.call(name, robot, robot=robot)

        return call

    async def _switch_lidar(self) -> None:
        robot = self._client.selected
        if robot is None:
            return
        is_on = bool(self._lidar.value)
        answer = await self._client.call("enable_lidar", robot, is_on, robot=robot)
        if not answer.ok:
            self._lidar.value = not is_on

    async def _send_typed(self) -> None:
        await self._take_typed(self.send)

    async def _take_typed(self, take: Callable[..., Any]) -> None:
        entry: List[Any] = [typed_number(field.value) for field in self._fields]
        self._fault.text = entry_fault(entry)
        if not self._fault.text:
            await take(*entry)

    async def send(self, x_m: float, y_m: float, yaw_rad: Optional[float]) -> None:
        """Send the selected robot, without one the nearest, to a pose in ``map``."""
        robot = self._client.selected
        pose = goal_pose(self._client.state, robot, x_m, y_m, yaw_rad)
        await self._client.call("send_goal", robot, pose, robot=robot)

    async def set_pose(self, x_m: float, y_m: float, yaw_rad: Optional[float]) -> None:
        """Tell the selected robot where it is; without a yaw it looks as it believes."""
        robot = self._client.selected
        if robot is not None:
            located = (self._client.row(robot) or {}).get("localization") or {}
            yaw_rad = located.get("yaw", 0.0) if yaw_rad is None else yaw_rad
            pose = Pose2D(x_m, y_m, yaw_rad)
            await self._client.call("set_pose", robot, pose, robot=robot)


def with_unit(value: Optional[float], unit: str) -> str:
    """Return a quantity for people."""
    return "–" if value is None else f"{value:.2f} {unit}"


def localization_text(located: Mapping[str, Any]) -> str:
    """Return how well a robot knows its place."""
    deviation_m, error_m = located.get("deviation_m"), located.get("error_m")
    parts = ["lost"] if located.get("is_lost") else []
    if deviation_m is not None:
        parts.append(f"±{deviation_m:.2f} m")
    if error_m is not None:
        turned = math.degrees(located["error_rad"])
        parts.append(f"{error_m:.2f} m, {turned:.0f}° from the truth")
    return "; ".join(parts) or "–"


def _goal_text(goal: Optional[str], distance_m: Optional[float]) -> str:
    if goal is None:
        return "none"
    return goal if distance_m is None else f"{goal}, {distance_m:.2f} m away"
