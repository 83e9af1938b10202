"""Summary of a mission as tables for the terminal."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass, field
from typing import Container, Iterable, List, Optional, Sequence, Tuple

from quad_nav.errors import printable
from quad_nav.mission.flight_log import INTERRUPTED, Leg
from quad_nav.mission.localization_errors import error_note
from quad_nav.mission.summary import MissionSummary, RobotSummary
from quad_nav.sim.contacts import Contact

DEFAULT_WIDTH = 100
"""Width in columns where the output is not a terminal."""

_GAP = "  "


@dataclass(frozen=True)
class _Column:
    """Column of a table; the one with the highest ``drop_rank`` is dropped first, 0 never."""

    head: str
    is_text: bool = False
    drop_rank: int = 0
    cells: List[str] = field(default_factory=list)

    @property
    def width(self) -> int:
        return max(len(line) for text in (self.head, *self.cells) for line in text.split("\n"))


def table(summary: MissionSummary, width: int = DEFAULT_WIDTH) -> str:
    """Return the tables of a mission.

    Args:
        summary: The mission.
        width: Width of the terminal. A table that is wider loses its least important columns, and
            a line below it names them.
    """
    parts = [_goal_table(summary.robots, width), _robot_table(summary, width)]
    if summary.contacts:
        parts.append(_contact_table(summary.contacts, width))
    parts.append(_verdict(summary, width))
    figures = summary.facts.get("localization")
    if figures is not None:
        parts[-1] += f"\n{error_note(figures)}"
    return "\n\n".join(parts)


def _goal_table(robots: Sequence[RobotSummary], width: int) -> str:
    has_laps = any(leg.lap > 1 for robot in robots for leg in robot.legs)
    has_yaws = any(leg.goal.yaw_rad is not None for robot in robots for leg in robot.legs)
    columns = [
        _Column("robot", is_text=True),
        _Column("lap/goal" if has_laps else "goal"),
        _Column("x (m)", drop_rank=3),
        _Column("y (m)", drop_rank=2),
        _Column("result", is_text=True),
        _Column("time (s)"),
        _Column("attempts", drop_rank=4),
        _Column("path (m)", drop_rank=1),
        _Column("straight (m)", drop_rank=6),
        _Column("detour", drop_rank=5),
    ]
    if has_yaws:
        columns.insert(5, _Column("yaw error\n(rad)", drop_rank=2))
    first_rows: List[int] = []
    notes: List[str] = []
    for robot in robots:
        first_rows.append(len(columns[0].cells))
        for leg in robot.legs:
            goal = f"{leg.lap}/{leg.index + 1}" if has_laps else str(leg.index + 1)
            cells = _goal_row(robot.robot if leg is robot.legs[0] else "", goal, leg)
            if has_yaws:
                cells.insert(5, _number(leg.yaw_error_rad, 2))
            _add_row(columns, cells)
            if leg.reason and leg.attempts and leg.reason != INTERRUPTED:
                notes.append(printable(f"{robot.robot}: goal {goal}: {leg.reason}"))
    return "\n".join([_text(columns, width, first_rows[1:]), *notes])


def _goal_row(robot: str, goal: str, leg: Leg) -> List[str]:
    is_sent = leg.time_s is not None
    result = "reached"
    if not leg.reached:
        result = leg.reason if leg.reason == INTERRUPTED or not is_sent else "skipped"
    return [
        robot,
        goal,
        f"{leg.goal.x_m:.2f}",
        f"{leg.goal.y_m:.2f}",
        result,
        _number(leg.time_s, 1),
        str(leg.attempts),
        _number(leg.path_length_m if is_sent else None, 2),
        _number(leg.straight_length_m if is_sent else None, 2),
        _detour(leg.path_length_m, leg.straight_length_m),
    ]


def _robot_table(summary: MissionSummary, width: int) -> str:
    columns = [
        _Column("robot", is_text=True),
        _Column("reached"),
        _Column("skipped", drop_rank=5),
        _Column("recoveries", drop_rank=2),
        _Column("contacts"),
        _Column("path (m)", drop_rank=3),
        _Column("detour", drop_rank=4),
        _Column("min\nclearance (m)", drop_rank=1),
        _Column("min\nseparation (m)"),
    ]
    for robot in summary.robots:
        _add_row(
            columns,
            (
                robot.robot,
                f"{robot.reached} of {len(robot.legs)}",
                str(robot.skipped),
                str(robot.recoveries),
                str(robot.contacts) if summary.contacts_reported else "-",
                f"{robot.path_length_m:.2f}",
                _detour(robot.path_length_m, robot.straight_length_m),
                _number(robot.min_clearance_m, 2),
                _number(robot.min_separation_m, 2),
            ),
        )
    note = f"Clearance and separation: from hulls of {summary.robot_radius_m:.2f} m radius."
    return f"{_text(columns, width)}\n{note}"


def _contact_table(contacts: Sequence[Contact], width: int) -> str:
    columns = [
        _Column("contact at (s)"),
        _Column("robot", is_text=True),
        _Column("touched", is_text=True),
        _Column("x (m)", drop_rank=2),
        _Column("y (m)", drop_rank=1),
    ]
    for contact in contacts:
        _add_row(
            columns,
            (
                f"{contact.time_s:.2f}",
                contact.robot,
                contact.other,
                f"{contact.x_m:.2f}",
                f"{contact.y_m:.2f}",
            ),
        )
    return _text(columns, width)


def _add_row(columns: Sequence[_Column], cells: Iterable[str]) -> None:
    for column, cell in zip(columns, cells):
        column.cells.append(printable(cell))


def _text(columns: Sequence[_Column], width: int, lines_above: Container[int] = ()) -> str:
    """Return the table, with a line above some rows, in at most ``width`` columns if it can."""
    shown, dropped = _fit(columns, width)
    heads = [column.head.split("\n") for column in shown]
    height = max(map(len, heads))
    heads = [[""] * (height - len(head)) + head for head in heads]
    line = _GAP.join("-" * column.width for column in shown)
    lines = [*(_row(shown, cells) for cells in zip(*heads)), line]
    for number, cells in enumerate(zip(*(column.cells for column in shown))):
        if number in lines_above:
            lines.append(line)
        lines.append(_row(shown, cells))
    text = "\n".join(lines)
    if not dropped:
        return text
    names = ", ".join(column.head.replace("\n", " ") for column in dropped)
    return f"{text}\nNot shown in {width} columns: {names}"


def _row(columns: Sequence[_Column], cells: Iterable[str]) -> str:
    padded = (
        cell.ljust(column.width) if column.is_text else cell.rjust(column.width)
        for column, cell in zip(columns, cells)
    )
    return _GAP.join(padded).rstrip()


def _fit(columns: Sequence[_Column], width: int) -> Tuple[List[_Column], List[_Column]]:
    """Split the columns into those that fit and those that are dropped."""
    shown = list(columns)
    while sum(column.width + len(_GAP) for column in shown) - len(_GAP) > width:
        least = max(shown, key=lambda column: column.drop_rank)
        if least.drop_rank == 0:
            break
        shown.remove(least)
    return shown, [column for column in columns if column not in shown]


def _verdict(summary: MissionSummary, width: int) -> str:
    legs = [leg for robot in summary.robots for leg in robot.legs]
    reached = sum(leg.reached for leg in legs)
    factor = summary.real_time_factor
    speed = f", real-time factor {factor:.2f}" if factor is not None else ""
    count = len(summary.contacts)
    contacts = f", {count} contact{'s' * (count != 1)}" if summary.contacts_reported else ""
    early = f"\nThe mission ended early: {printable(summary.reason)}."
    reason = early if summary.reason else ""
    for robot in summary.robots:
        if robot.reason:
            reason += f"\n{robot.robot} ended early: {printable(robot.reason)}."
    if summary.interventions:
        reason += "\nPeople steered the mission:"
        reason += "".join(f"\n  {printable(line)}" for line in summary.interventions)
    verdict = (
        f"Mission {'succeeded' if summary.success else 'FAILED'}: {reached} of {len(legs)} goals "
        f"reached{contacts} in {summary.sim_time_s:.1f} s "
        f"(wall {summary.wall_time_s:.1f} s{speed})."
    )
    return textwrap.fill(verdict, width, break_on_hyphens=False) + reason


def _number(value: Optional[float], decimals: int) -> str:
    return "-" if value is None else f"{value:.{decimals}f}"


def _detour(path_m: float, straight_m: float) -> str:
    """Return path length over straight length."""
    return f"{path_m / straight_m:.2f}" if straight_m > 0.01 else "-"
