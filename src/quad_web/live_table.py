"""A table in the page whose rows change often: only cells that have changed are sent."""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence

from nicegui import ui
from nicegui.events import GenericEventArguments

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
        """Make an empty table.

        Args:
            columns: As ``column`` returns them.
            testid: ``data-testid`` of the table; rows have ``<testid>-row-<key>``.
            empty: Text without rows.
            on_pick: Called with the key of a row that was clicked.
            **options: ``follow=True`` shows the end of a log; ``limit`` of rows in the browser;
                ``sort``, as ``{"sortBy": name, "descending": False}``.
        """
        super().__init__()
        self._props.update(columns=list(columns), testid=testid, empty=empty, **options)
        self._props["data-testid"] = testid
        self._rows: Dict[Any, Row] = {}
        if on_pick is not None:
            pick = on_pick

            def picked(event: GenericEventArguments) -> None:
                pick(event.args)

            self.on("pick", picked)

    def set_rows(self, rows: Sequence[Row]) -> int:
        """Show these rows, each with its ``key``, and return how many cells were sent.

        The rows are kept to compare them with the next ones; the caller does not change them.
        """
        new = {row["key"]: row for row in rows}
        removed = [key for key in self._rows if key not in new]
        changed = [
            cells
            for key, row in new.items()
            for cells in [_changed_cells(self._rows.get(key, {}), row)]
            if cells
        ]
        self._rows = new
        if changed or removed:
            self.run_method("patch", changed, removed)
        return sum(len(cells) - 1 for cells in changed)

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


def _changed_cells(before: Row, after: Row) -> Dict[str, Any]:
    """Return the key and the cells that differ; empty if none does."""
    cells = {name: value for name, value in after.items() if before.get(name, _NONE) != value}
    return {"key": after["key"], **cells} if cells else {}


_NONE = object()
