"""Lay out the page: panels around the arena.

On a wide screen the arena is in the middle, robots and the two editors are beside it, and charts,
events and diagnostics below. On a phone the arena is on top, the panels are behind tabs, and the
button that stops every robot stays at the bottom.

``data-testid``: ``tool-view``, ``tool-goal``, ``tool-pose``, ``mode`` (2D, 3D), ``layers`` (its
menu has ``layer-<name>``), ``side-<panel>``, ``dock-<panel>`` and ``phone-<panel>`` (tabs), and
``panel-<panel>``. Those of the panels are in their modules.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, Optional

from nicegui import background_tasks, context, ui

import quad_nav
from quad_nav.errors import excerpt
from quad_web.arena import SHOWN, SHOWN_AT_FIRST, Arena, Charts, edited_goals, goal_pose
from quad_web.flight_bar import FlightBar, StopButton, enable
from quad_web.goal_panel import GoalEditor
from quad_web.log_panels import Diagnostics, EventLog
from quad_web.page_client import PageClient
from quad_web.parameter_panel import Parameters
from quad_web.result_card import ResultCard
from quad_web.robot_panels import RobotCard, RobotTable
from quad_web.view.actions import Actions, Answer, Role
from quad_web.view.state import FleetState

_STYLES = (
    Path(quad_nav.__file__).parent / "report" / "colours.css",  # without matplotlib of the package
    Path(__file__).parent / "static" / "page.css",
)
_LONGEST = 600  # characters of an answer
_REFRESH_S = 0.5
_FULL_SPEED_REFRESH_S = 1.0  # the flight needs the processor
_READ_S = 2.0  # parameters and goal files, which others change, too

SIDE = {"robots": "Robots", "parameters": "Parameters", "goals": "Goals"}
DOCK = {"charts": "Charts", "events": "Events", "diagnostics": "Diagnostics"}
PHONE = {
    "robots": "Robots",
    "robot": "Robot",
    "charts": "Charts",
    "events": "Events",
    "parameters": "Params",
    "goals": "Goals",
    "diagnostics": "Diag",
}


class Page:
    """One page: the arena, its toolbar, and the panels.

    Args:
        state: What is shown; the log of events also gets what came of the page's actions.
        actions: What a person can do. A page that may only watch gets a ``WatchOnly``, which
            refuses everything, whatever its handlers do.
        role: Whether the person may steer.
    """

    def __init__(self, state: FleetState, actions: Actions, role: Role) -> None:
        """Make all elements, and refresh them while the page is open."""
        self._nicegui = context.client
        self.client = PageClient(state, actions, role, self._toast)
        self._panels: Dict[str, Any] = {}
        self._tabs: Dict[str, Any] = {}
        for style in _STYLES:
            ui.add_css(style)
        with ui.element("div").classes("page"):
            self.bar = FlightBar(self.client)
            self.stop = StopButton(self.client)
            with ui.element("div").classes("arena-box"):
                self._make_arena()
                self.result = ResultCard(self.client)
            self._make_tabs("phone", PHONE)
            with ui.element("div").classes("side"):
                self._make_tabs("side", SIDE)
                self._make_side()
            with ui.element("div").classes("dock"):
                self._make_tabs("dock", DOCK)
                self._make_dock()
        self._show_panels()
        self._show_tool("view")
        self.client.on_select(self._selected)
        self.refresh()
        self._timer: Any = None
        self._nicegui.on_connect(self._begin)

    def _begin(self) -> None:
        """Refresh from the first connection on; NiceGUI deletes the timers with the client.

        A timer would keep a page for a minute that is only asked for.
        """
        if self._timer is None:
            self._timer = ui.timer(_REFRESH_S, self._tick)
            ui.timer(_READ_S, self._read)

    # -- elements --------------------------------------------------------------------

    def _make_arena(self) -> None:
        role = self.client.role
        self.arena = Arena(role)
        self.arena.on("select", lambda event: self.client.select(event.args))
        self.arena.on("goal", lambda event: self.card.send(*goal_pose(event.args)))
        self.arena.on("pose", lambda event: self.card.set_pose(*goal_pose(event.args)))
        self.arena.on("edit", lambda event: self.goals.take(edited_goals(event.args)))
        self.arena.on("tool", lambda event: self.set_tool(event.args))
        self.arena.on("mode", lambda event: self._mode.set_value(event.args))
        with ui.element("div").classes("toolbar"):
            with ui.element("div").classes("group"):
                self._tools = {
                    tool: ui.button(
                        icon=icon, on_click=lambda _, tool=tool: self.set_tool(tool)
                    ).props(
                        f"flat dense data-testid=tool-{tool} title='{title}' aria-label='{title}'"
                    )
                    for tool, icon, title in (
                        ("view", "near_me", "Select"),
                        ("goal", "add_location_alt", "Send goal"),
                        ("pose", "pin_drop", "2D pose estimate"),
                    )
                }
                enable(self._tools["goal"], self.client, "send_goal")
                enable(self._tools["pose"], self.client, "set_pose")
            with ui.element("div").classes("group"):
                options = {"2d": "2D", "3d": "3D"}
                self._mode: Any = ui.toggle(options, value="2d")
                self._mode.on_value_change(lambda event: self.arena.apply(mode=event.value))
                self._mode.props("dense unelevated no-caps data-testid=mode")
            with ui.element("div").classes("group"):
                button = ui.button(icon="layers")
            button.props("flat dense data-testid=layers title='Layers' aria-label='Layers'")
            with button, ui.menu().classes("layers"):
                self._switches = {
                    name: ui.switch(
                        label, value=name in SHOWN_AT_FIRST, on_change=self._set_layers
                    ).props(f"dense data-testid=layer-{name}")
                    for name, label in SHOWN.items()
                }

    def _make_tabs(self, place: str, names: Dict[str, str]) -> None:
        first: Any = next(iter(names))  # the name of a tab does, too
        if "goals" in names and self._edits_only:
            first = "goals"
        with ui.tabs(value=first, on_change=self._tab_chosen) as tabs:
            tabs.classes(f"{place}-tabs").props("dense no-caps inline-label align=left")
            for name, label in names.items():
                ui.tab(name, label).props(f"data-testid={place}-{name}")
        self._tabs[place] = tabs

    @property
    def _edits_only(self) -> bool:
        """Whether there is no flight yet, only goals to edit."""
        return bool(self.client.refusal("start")) and not self.client.refusal("save_goals")

    def _panel(self, name: str) -> Any:
        panel = ui.element("section").classes(f"panel panel-{name}")
        panel.props["aria-label"] = {**SIDE, **DOCK, "robot": "Selected robot"}[name]
        self._panels[name] = panel.props(f"data-testid=panel-{name}")
        return panel

    def _make_side(self) -> None:
        with self._panel("robots"):
            self.table = RobotTable(self.client, lambda: self.arena.apply(following=True))
        with self._panel("robot"):
            self.card = RobotCard(self.client, self.set_tool)
        with self._panel("parameters"):
            self.parameters = Parameters(self.client)
        with self._panel("goals"):
            self.goals = GoalEditor(self.client, self.arena.apply, self.set_tool)

    def _make_dock(self) -> None:
        with self._panel("charts"):
            self.charts = Charts()
        with self._panel("events"):
            self.events = EventLog(self.client)
        with self._panel("diagnostics"):
            self.diagnostics = Diagnostics(self.client)

    # -- what it shows ---------------------------------------------------------------

    def _tick(self) -> None:
        self.refresh()
        flight = self.client.data("flight")
        is_at_full_speed = flight.get("wanted_rate") == 0.0 and flight.get("state") == "running"
        self._timer.interval = _FULL_SPEED_REFRESH_S if is_at_full_speed else _REFRESH_S

    def refresh(self) -> None:
        """Show what has changed in the state."""
        shown = (self.bar, self.result, self.table, self.card, self.events, self.diagnostics)
        for panel in shown:
            panel.refresh()
        for element in (self._tools["pose"], self._switches["localization"]):
            element.set_visibility(self.client.has_localization)
        problems = self.diagnostics.problems
        for place in ("dock", "phone"):
            classes = {"add": "has-problems"} if problems else {"remove": "has-problems"}
            self._tabs[place].classes(**classes)

    async def _read(self) -> None:
        """Read what an action must be asked for, while it is shown."""
        if self._is_shown("parameters"):
            await self.parameters.refresh()
        if self._is_shown("goals"):
            await self.goals.refresh()

    def _is_shown(self, panel: str) -> bool:
        """Return whether a panel's tab is open; which of the two rows is seen, CSS decides."""
        return any(tabs.value == panel for tabs in self._tabs.values())

    def _show_panels(self) -> None:
        for name, panel in self._panels.items():
            for place, tabs in self._tabs.items():
                is_on = tabs.value == name or (
                    place == "side" and name == "robot" and tabs.value == "robots"
                )
                classes = {"add": f"on-{place}"} if is_on else {"remove": f"on-{place}"}
                panel.classes(**classes)

    async def _tab_chosen(self, event: Any) -> None:
        self._show_panels()
        is_beside = event.sender is not self._tabs["dock"] and event.value != "goals"
        if is_beside and self._tool == "edit":
            self.set_tool("view")  # goals are edited beside their list
        await self._read()

    def _toast(self, answer: Answer) -> None:
        with self._nicegui:
            kind: Any = "positive" if answer.ok else "negative"
            timeout = 3000 if answer.ok else 8000
            ui.notify(
                excerpt(answer.text, _LONGEST),
                type=kind,
                position="top",
                timeout=timeout,
                multi_line=True,
            )

    # -- what it does ----------------------------------------------------------------

    def set_tool(self, tool: str) -> None:
        """Choose what the mouse does in the arena: "view", "goal", "pose" or "edit"."""
        if self.client.role is not Role.STEER:
            tool = "view"
        if tool != "view":
            self.arena.apply(following=False)  # the ground must not move under the pointer
        self.arena.apply(tool=tool)
        self._show_tool(tool)

    def _show_tool(self, tool: str) -> None:
        self._tool = tool
        for name, button in self._tools.items():
            classes = {"add": "is-on"} if name == tool else {"remove": "is-on"}
            button.classes(**classes)
        self.goals.set_editing(tool == "edit")

    def _set_layers(self) -> None:
        shown = [name for name, switch in self._switches.items() if switch.value]
        self.arena.apply(layers=shown)

    def _selected(self, robot: Optional[int]) -> None:
        self.arena.apply(selected=robot)
        self.charts.apply(selected=robot)
        background_tasks.create(self._read(), name="read the selected robot")
