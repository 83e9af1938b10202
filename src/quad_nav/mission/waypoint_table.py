"""Waypoints in tables: CSV with and without names of columns, and the goals of tuw_multi_robot."""

from __future__ import annotations

import csv
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from quad_nav.errors import InputError
from quad_nav.mission.waypoint_fields import (
    LISTS,
    PLACE,
    Record,
    Value,
    field_of,
    is_position,
    number_of,
)
from quad_nav.mission.waypoint_tree import NamedRecords

TUW = "tuw_multi_robot_msgs::RobotGoalsArray"
_COMMENTS = ("#", "%", "//")


class _Row(NamedTuple):
    cells: List[str]
    line: int


def read_table(text: str) -> Optional[Tuple[str, List[Record]]]:
    """Read a table: what it is, and a record for each row. None for a text that is no table.

    Raises:
        InputError: The columns are unknown.
    """
    rows, comments = _rows(text)
    if not rows:
        return None
    names = [one for one in comments if is_position(map(field_of, one.cells))][-1:]
    if is_position(map(field_of, rows[0].cells)):
        names = [rows.pop(0)]
    if not names and len(rows) > 1 and _numeric(rows[1]) and not _numeric(rows[0]):
        found = ", ".join(rows[0].cells)
        raise InputError(
            [f"line {rows[0].line}: {found}; expected the names of columns, x and y among them"]
        )
    if not names and not _numeric(rows[0]):
        return None
    if names:
        columns = _named(names[0])
        kind = f"a table with the columns {', '.join(columns)} (named in line {names[0].line})"
    else:
        columns = _unnamed(rows[0])
        kind = f"a table without names, of the columns {', '.join(columns)}"
    width = 0 if names else _width(rows[0])
    return kind, [_record(row, columns, width) for row in rows]


def read_tuw(text: str) -> List[NamedRecords]:
    """Read the goals of a fleet as tuw_multi_robot_goal_generator saves them.

    Three lines are a title, ``frame_id: map`` and a time. Then there are lines with the name of a
    robot, each followed by its goals: x, y, z and a quaternion or a yaw.

    Raises:
        InputError: A goal comes before the first robot, or a robot has none.
    """
    robots: List[NamedRecords] = []
    problems: List[str] = []
    for number, line in list(enumerate(text.splitlines(), 1))[3:]:
        cells = [cell.strip() for cell in line.split(",")]
        if len(cells) > 1 and robots:
            fields = LISTS[7 if len(cells) > 4 else 4]
            robots[-1].records.append(_record(_Row(cells, number), _columns(fields), len(fields)))
        elif len(cells) > 1:
            problems.append(f"line {number}: a goal; expected the name of its robot before it")
        elif cells[0]:
            robots.append(NamedRecords(cells[0], []))
    problems += [f"{one.name}: has no goals; expected one" for one in robots if not one.records]
    if problems:
        raise InputError(problems)
    return robots


def _rows(text: str) -> Tuple[List[_Row], List[_Row]]:
    """Return the rows of a table, and the comments before the first."""
    lines = [(number, line.strip()) for number, line in enumerate(text.splitlines(), 1)]
    used = [(number, line) for number, line in lines if line]
    rows = [(number, line) for number, line in used if not line.startswith(_COMMENTS)]
    if not rows or ":" in rows[0][1]:
        return [], []
    comments = [(number, line.lstrip("#%/ ")) for number, line in used if number < rows[0][0]]
    return [_Row(_cells(line), number) for number, line in rows], [
        _Row(_cells(line), number) for number, line in comments
    ]


def _cells(line: str) -> List[str]:
    separator = next((one for one in ",;\t" if one in line), "")
    if not separator:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _numeric(row: _Row) -> List[int]:
    """Return the indices of a row's numbers; [] if they are too few for a position."""
    found = [k for k, cell in enumerate(row.cells) if number_of(cell) is not None]
    return found if len(found) > 1 else []


def _named(row: _Row) -> Dict[str, int]:
    columns: Dict[str, int] = {}
    for index, cell in enumerate(row.cells):
        columns.setdefault(field_of(cell), index)
    columns.pop("", None)
    return columns


def _unnamed(row: _Row) -> Dict[str, int]:
    """Return the columns that a first row without names has, by their number."""
    found = _numeric(row)
    values = [float(row.cells[k]) for k in found]
    fields: Sequence[str] = LISTS.get(len(found), ())
    if len(found) >= 7:
        is_rotation = abs(sum(value * value for value in values[3:7]) - 1.0) < 0.05
        fields = LISTS[7] if is_rotation else ()
    if not fields:
        raise InputError(
            [
                f"line {row.line}: {len(found)} columns without names; expected 2 (x, y), 3 (x, y, "
                "yaw), 4 (x, y, z, yaw), 7 (x, y, z and a quaternion), or names in the first line"
            ]
        )
    return {field: found[k] for k, field in enumerate(fields)}


def _columns(fields: Sequence[str]) -> Dict[str, int]:
    return {field: k for k, field in enumerate(fields)}


def _record(row: _Row, columns: Dict[str, int], width: int) -> Record:
    """Return the record of a row; ``width`` is the number of columns without names, else 0."""
    needed = max(columns.values()) + 1
    if len(row.cells) < needed or (width and _width(row) != width):
        text = f"has {_width(row)} columns; expected {width or needed}"
        return {PLACE: Value(text, row.line)}
    fields = {field: Value(row.cells[k], row.line) for field, k in columns.items()}
    return {PLACE: Value(None, row.line), **fields}


def _width(row: _Row) -> int:
    """Return the number of cells up to the last one that is not empty."""
    return max((k + 1 for k, cell in enumerate(row.cells) if cell), default=0)
