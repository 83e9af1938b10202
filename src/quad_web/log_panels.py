"""Log of events with a filter, and the diagnostics of the nodes.

``data-testid``: ``events``, ``events-text``, ``events-level``, ``events-robot``, ``diagnostics``,
``diagnostic-values``.
"""

from __future__ import annotations

import re
from typing import Any, Dict, List, Mapping, Optional, Sequence

from nicegui import ui

from quad_nav.errors import excerpt
from quad_web.flight_bar import clock_text
from quad_web.live_table import LiveTable, column
from quad_web.page_client import PageClient
from quad_web.view.state import MAX_EVENTS, Event

LEVELS = {
    "all": ["info", "warning", "error"],
    "warnings": ["warning", "error"],
    "errors": ["error"],
}
_ALL_ROBOTS, _SELECTED = "all robots", "selected"
_ORDER = ("ERROR", "STALE", "WARN", "OK")
_LONGEST = 500  # characters of an event


def event_row(event: Event, client: PageClient) -> Dict[str, Any]:
    """Return an event as a row of the table."""
    return {
        "key": event.number,
        "time_s": event.time_s,
        "time": clock_text(event.time_s),
        "level": event.level,
        "robot": event.robot,
        "name": "" if event.robot is None else client.name(event.robot),
        "colour": None if event.robot is None else client.colour(event.robot),
        "text": excerpt(event.text, _LONGEST),
    }


class EventLog:
    """Events of the flight, the newest at the end."""

    def __init__(self, client: PageClient) -> None:
        self._client = client
        self._next = 0
        self._first: Optional[int] = None
        with ui.element("div").classes("filters"):
            self._text = ui.input(placeholder="filter", on_change=self._filter)
            self._text.props("dense outlined clearable debounce=200 data-testid=events-text")
            self._level = ui.select(list(LEVELS), value="all", on_change=self._filter)
            self._level.props("dense outlined options-dense data-testid=events-level")
            robots = [_ALL_ROBOTS, _SELECTED]
            self._robot = ui.select(robots, value=_ALL_ROBOTS, on_change=self._filter)
            self._robot.props("dense outlined options-dense data-testid=events-robot")
        columns = [
            column("time", "time", sortable=False),
            column("level", "level", "level", sortable=False),
            column("name", "robot", "robot", sortable=False),
            column("text", "event", sortable=False, classes="wide", hint="text"),
        ]
        self._table = LiveTable(columns, "events", "no events yet", follow=True, limit=MAX_EVENTS)
        client.on_select(lambda robot: self._filter())

    def refresh(self) -> None:
        """Append the events that are new, and begin again if the log was cleared."""
        events = self._client.state.events()
        if self._was_cleared(events):
            self._table.clear()
        self._first = events[0].number if events else None
        new = [event for event in events if event.number >= self._next]
        self._next = max(self._next, events[-1].number + 1 if events else 0)
        self._table.append([event_row(event, self._client) for event in new])

    def _was_cleared(self, events: Sequence[Event]) -> bool:
        """Return whether the log has lost events that were not the oldest of a full one."""
        if self._first is None:
            return False
        return not events or (events[0].number != self._first and len(events) < MAX_EVENTS)

    def _filter(self) -> None:
        equal: Dict[str, List[Any]] = {"level": LEVELS[str(self._level.value)]}
        if self._robot.value == _SELECTED:
            equal["robot"] = [self._client.selected]
        self._table.filter(str(self._text.value or ""), equal)


def sorted_statuses(statuses: Sequence[Mapping[str, Any]]) -> List[Mapping[str, Any]]:
    """Return diagnostics with problems first, then by name: 2 comes before 10."""

    def order(status: Mapping[str, Any]) -> Any:
        level = status.get("level")
        parts = re.split(r"(\d+)", str(status.get("name")))
        name = [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]
        return (_ORDER.index(level) if level in _ORDER else -1, name)

    return sorted(statuses, key=order)


def problem_count(statuses: Sequence[Mapping[str, Any]]) -> int:
    """Return how many diagnostics are not OK."""
    return sum(status.get("level") != "OK" for status in statuses)


class Diagnostics:
    """State of each node and part, problems first; a click shows its values."""

    def __init__(self, client: PageClient) -> None:
        self._client = client
        self._picked: Optional[str] = None
        self._shown: Any = None
        self._values_shown: Any = None
        columns = [
            column("level", "level", "level", sortable=False),
            column("name", "part", sortable=False),
            column("message", "message", sortable=False, classes="wide", hint="message"),
            column("age_s", "age, s", digits=1, sortable=False),
        ]
        empty = "no diagnostics from this source"
        self._table = LiveTable(columns, "diagnostics", empty, self._pick)
        self._values = ui.element("dl").classes("values").props("data-testid=diagnostic-values")
        self._values.set_visibility(False)

    @property
    def problems(self) -> int:
        """Number of parts that are not OK."""
        return problem_count(self._statuses())

    def refresh(self) -> None:
        """Show the item ``diagnostics`` as it is now."""
        statuses = sorted_statuses(self._statuses())
        order = [status["name"] for status in statuses]
        if order != self._shown:
            self._shown = order
            self._table.clear()  # rows stay in the order in which they come
        self._table.set_rows(
            [
                {
                    "key": excerpt(str(status["name"])),
                    "level": str(status.get("level", "")),
                    "name": excerpt(str(status["name"])),
                    "message": excerpt(str(status.get("message", ""))),
                    "age_s": status.get("age_s"),
                }
                for status in statuses
            ]
        )
        self._show_values()

    def _statuses(self) -> Sequence[Mapping[str, Any]]:
        statuses: Sequence[Mapping[str, Any]] = self._client.data("diagnostics").get("statuses", ())
        return statuses

    def _pick(self, name: str) -> None:
        self._picked = None if name == self._picked else name
        self._table.select(self._picked)
        self._show_values()

    def _show_values(self) -> None:
        found = [one for one in self._statuses() if excerpt(str(one["name"])) == self._picked]
        values = dict(found[0].get("values") or {}) if found else {}
        self._values.set_visibility(bool(found))
        if found and (self._picked, values) != self._values_shown:
            self._values_shown = (self._picked, values)
            self._values.clear()
            with self._values:
                hardware = {"hardware": found[0]["hardware"]} if found[0].get("hardware") else {}
                for key, value in {**hardware, **values}.items():
                    with ui.element("dt"):
                        ui.label(excerpt(str(key)))
                    with ui.element("dd"):
                        ui.label(excerpt(str(value)))
