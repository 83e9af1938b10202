"""A table in the page whose rows change often: only cells that have changed are sent."""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence

from nicegui import ui

Row = Mapping[str, Any]


def column(name: str, label: str, kind: str = "text", **options: Any) -> Dict[str, Any]:
    """Return a column.

    Args:
        name: Its field in the rows.
        label: Its heading.
        kind: How its cells are drawn: "text", "robot" (with the row's ``colour``), "state",
            "level", or "battery" ([used, all]).
        **options: Further properties of Quasar's columns; ``digits`` of numbers; ``hint``, the
            field of the rows that is shown as a tooltip.
    """
    return {
        "name": name,
        "label": label,
        "field": name,
        "kind": kind,
        "align": "left",
        "sortable": True,
        **options,
    }


class LiveTable(ui.element, component="static/live_table.js"):
    """Rows by key; a click calls ``on_pick`` with the row's key."""

    def __init__(
        self,
        columns: Sequence[Mapping[str, Any]],
        testid: str,
        empty: str,
        on_pick: Optional[Callable[[Any], None]] = None,
        **options: Any,
    ) -> None:
        """Make a table that says ``empty`` without rows; rows have ``<testid>-row-<key>``.

        Options are ``follow=True`` for the end of a log, a ``limit`` of rows in the browser, and
        ``sort``, as ``{"sortBy": name, "descending": False}``.
        """
        super().__init__()
        self._props.update(columns=list(columns), testid=testid, empty=empty, **options)
        self._props["data-testid"] = testid
        self._props["picks"] = on_pick is not None
        self._rows: Dict[Any, Row] = {}
        if on_pick is not None:
            self.on("pick", lambda event: on_pick(event.args))

    def set_rows(self, rows: Sequence[Row]) -> None:
        """Show these rows, each with its ``key``; the caller does not change them."""
        new = {row["key"]: row for row in rows}
        removed = [key for key in self._rows if key not in new]
        changed = []
        for key, row in new.items():
            before = self._rows.get(key, {})
            cells = {name: one for name, one in row.items() if not before or before[name] != one}
            if cells:
                changed.append({**cells, "key": key})
        self._rows = new
        if changed or removed:
            self.run_method("patch", changed, removed)

    def append(self, rows: Sequence[Row]) -> None:
        """Append rows with new keys, which never change; ``limit`` bounds how many stay."""
        if rows:
            self.run_method("patch", list(rows), [])

    def clear(self) -> None:
        """Remove all rows."""
        self._rows = {}
        self.run_method("clear")

    def select(self, key: Any) -> None:
        """Mark a row, None for no row."""
        self.run_method("select", key)

    def filter(self, text: str = "", equal: Optional[Mapping[str, List[Any]]] = None) -> None:
        """Show only rows with this text, and with one of the values in each of the fields."""
        self.run_method("filter", text, dict(equal or {}))
