"""Parameters that differ from move_base's defaults, as few table rows."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Dict, List, Tuple

from quad_nav.config.differences import differences
from quad_nav.recording.trace import FlightTrace

_COSTMAPS = ("global_costmap/", "local_costmap/")


@dataclass(frozen=True)
class ParameterRow:
    """Row of the table.

    ``robots`` is empty if the row holds for all robots. ``{i}`` in a value stands for the robot's
    number.
    """

    path: str
    value: str
    default: str
    unit: str
    robots: str = ""


def parameter_rows(trace: FlightTrace) -> Tuple[ParameterRow, ...]:
    """Build the rows; costmaps with equal values share one, and so do robots."""
    found: Dict[ParameterRow, List[str]] = {}
    known = [robot for robot in trace.robots if robot.parameters]
    for robot in known:
        number = "".join(re.findall(r"\d+$", robot.name))
        for row in _with_common_costmaps(_rows(robot.parameters, number)):
            found.setdefault(row, []).append(robot.name)
    return tuple(
        ParameterRow(
            row.path,
            row.value,
            row.default,
            row.unit,
            "" if len(names) == len(known) else ", ".join(names),
        )
        for row, names in found.items()
    )


def _rows(tree: Any, number: str) -> List[ParameterRow]:
    return [
        ParameterRow(entry.path, _text(entry.value, number), _text(entry.default, ""), entry.unit)
        for entry in differences(tree)
    ]


def _text(value: Any, number: str) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:g}"
    text = str(value)
    return re.sub(rf"(?<=[A-Za-z_]){number}\b", "{i}", text) if number else text or '""'


def _with_common_costmaps(rows: List[ParameterRow]) -> List[ParameterRow]:
    """Merge rows that both costmaps have into one named ``*_costmap/...``."""
    everything = set(rows)
    common = []
    for row in rows:
        own = next((costmap for costmap in _COSTMAPS if row.path.startswith(costmap)), None)
        if own is None:
            common.append(row)
            continue
        rest = row.path[len(own) :]
        twins = [
            ParameterRow(costmap + rest, row.value, row.default, row.unit) for costmap in _COSTMAPS
        ]
        if not everything.issuperset(twins):
            common.append(row)
        elif own == _COSTMAPS[0]:
            common.append(ParameterRow("*_costmap/" + rest, row.value, row.default, row.unit))
    return common
