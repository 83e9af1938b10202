"""A mission's figures as a table for a person and as JSON for a program.

The keys of the JSON are documented in ``docs/goals.md``.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import tabulate

from quad_nav.mission.flight_log import INTERRUPTED, FlightLog, Leg
from quad_nav.mission.sequencer import Sequencer
from quad_nav.sim.contacts import Contact
from quad_nav.versions import versions

EXIT_SUCCESS, EXIT_FAILURE, EXIT_BAD_INPUT = 0, 1, 2


@dataclass(frozen=True)
class RobotSummary:
    """One quadcopter's part; lengths and gaps are None where they could not be measured."""

    robot: str
    legs: Tuple[Leg, ...]
    path_length_m: float = 0.0
    min_clearance_m: Optional[float] = None
    min_separation_m: Optional[float] = None
    recoveries: int = 0
    contacts: int = 0
    aborts: int = 0
    spin_s: float = 0.0

    @property
    def straight_length_m(self) -> float:
        return sum(leg.straight_length_m for leg in self.legs)

    @property
    def reached(self) -> int:
        return sum(leg.reached for leg in self.legs)

    @property
    def skipped(self) -> int:
        return sum(
            not leg.reached and leg.attempts > 0 and leg.reason != INTERRUPTED for leg in self.legs
        )


@dataclass(frozen=True)
class MissionSummary:
    """The whole mission. ``reason`` says why it ended before its goals did, if it did."""

    robots: Tuple[RobotSummary, ...]
    contacts: Tuple[Contact, ...] = ()
    robot_radius_m: float = 0.0
    sim_time_s: float = 0.0
    wall_time_s: float = 0.0
    reason: str = ""
    problems: Tuple[str, ...] = ()
    contacts_reported: bool = True
    seed: Optional[int] = None
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def success(self) -> bool:
        """Every goal was reached and nothing touched."""
        return (
            not self.reason
            and not self.problems
            and not self.contacts
            and all(leg.reached for robot in self.robots for leg in robot.legs)
        )

    @property
    def exit_status(self) -> int:
        if self.problems:
            return EXIT_BAD_INPUT
        return EXIT_SUCCESS if self.success else EXIT_FAILURE

    @property
    def min_separation_m(self) -> Optional[float]:
        """Least gap between any two quadcopters."""
        gaps = [robot.min_separation_m for robot in self.robots]
        return min((gap for gap in gaps if gap is not None), default=None)

    @property
    def real_time_factor(self) -> Optional[float]:
        return self.sim_time_s / self.wall_time_s if self.wall_time_s > 0 else None


def summarize(
    log: FlightLog,
    sequencers: Mapping[str, Sequencer],
    clock_s: float,
    *,
    sim_time_s: float,
    wall_time_s: float,
    reason: str = "",
    seed: Optional[int] = None,
    contacts_reported: bool = True,
) -> MissionSummary:
    """Sum up a mission, ended or not, from its log.

    Args:
        log: Flight log of all robots.
        sequencers: Each robot's sequencer, by the robot's name.
        clock_s: Present time on the clock of the log and the sequencers.
        sim_time_s: Duration of the mission.
        wall_time_s: Wall time that it took.
        reason: Reason why the mission ended before its goals did, "" if it did not.
        seed: Seed of the simulation.
        contacts_reported: False if nothing reports contacts, as on real quadcopters.
    """
    robots = (
        summarize_robot(log, name, log.robots[name].all_legs(sequencer, clock_s))
        for name, sequencer in sequencers.items()
    )
    return MissionSummary(
        tuple(robots),
        tuple(log.contacts),
        log.robot_radius_m,
        sim_time_s,
        wall_time_s,
        reason,
        contacts_reported=contacts_reported,
        seed=seed,
        versions=versions(),
    )


def summarize_robot(log: FlightLog, name: str, legs: Sequence[Leg]) -> RobotSummary:
    """Sum up one robot's part; ``legs`` are all of its goals, flown or not."""
    robot = log.robots[name]
    return RobotSummary(
        name,
        tuple(legs),
        robot.path_length_m,
        log.distances.min_clearance_m(name),
        log.distances.min_separation_m(name),
        robot.recoveries,
        log.contacts_of(name),
        robot.aborts,
        robot.spin_s,
    )


def to_json(summary: MissionSummary) -> Dict[str, Any]:
    """What ``write_json`` writes; lengths and times to the millimetre and millisecond."""
    return {
        "success": summary.success,
        "exit_status": summary.exit_status,
        "reason": summary.reason,
        "problems": list(summary.problems),
        "sim_time_s": _rounded(summary.sim_time_s),
        "wall_time_s": _rounded(summary.wall_time_s),
        "real_time_factor": _rounded(summary.real_time_factor),
        "robot_radius_m": summary.robot_radius_m,
        "robots": [_robot_json(robot) for robot in summary.robots],
        "contacts": [
            {
                "time_s": _rounded(contact.time_s),
                "robot": contact.robot,
                "with": contact.other,
                "x_m": _rounded(contact.x_m),
                "y_m": _rounded(contact.y_m),
            }
            for contact in summary.contacts
        ],
        "contacts_reported": summary.contacts_reported,
        "min_separation_m": _rounded(summary.min_separation_m),
        "seed": summary.seed,
        "versions": dict(summary.versions),
    }


def write_json(summary: MissionSummary, path: Union[str, Path]) -> None:
    """Write the JSON, with its folders; a reader never sees half of it."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    partial.write_text(
        json.dumps(to_json(summary), indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )
    partial.replace(path)


def table(summary: MissionSummary) -> str:
    """The figures in at most 100 columns."""
    parts = [_goal_table(summary.robots), _robot_table(summary)]
    if summary.contacts:
        parts.append(_contact_table(summary.contacts))
    parts.append(_verdict(summary))
    return "\n\n".join(parts)


def _goal_table(robots: Sequence[RobotSummary]) -> str:
    laps = any(leg.lap > 1 for robot in robots for leg in robot.legs)
    header = [
        "robot",
        "goal",
        "x\nm",
        "y\nm",
        "result",
        "time\ns",
        "tries",
        "path\nm",
        "straight\nm",
        "path /\nstraight",
    ]
    rows: List[Sequence[str]] = []
    notes: List[str] = []
    for robot in robots:
        if rows:
            rows.append(tabulate.SEPARATING_LINE)
        for leg in robot.legs:
            goal = f"{leg.lap}/{leg.index + 1}" if laps else str(leg.index + 1)
            rows.append(_goal_row(robot.robot if leg is robot.legs[0] else "", goal, leg))
            if leg.reason and leg.attempts and leg.reason != INTERRUPTED:
                notes.append(f"{robot.robot} goal {goal}: {leg.reason}")
    if laps:
        header[1] = "lap/goal"
    text = tabulate.tabulate(
        rows,
        header,
        tablefmt="simple",
        disable_numparse=True,
        colalign=("left", "right", "right", "right", "left") + ("right",) * 5,
    )
    return "\n".join([text, *notes])


def _goal_row(robot: str, goal: str, leg: Leg) -> List[str]:
    flown = leg.time_s is not None
    result = (
        "reached"
        if leg.reached
        else (leg.reason if leg.reason == INTERRUPTED or not flown else "skipped")
    )
    return [
        robot,
        goal,
        f"{leg.goal.x_m:.2f}",
        f"{leg.goal.y_m:.2f}",
        result,
        _figure(leg.time_s, 1),
        str(leg.attempts),
        _figure(leg.path_length_m if flown else None, 2),
        _figure(leg.straight_length_m if flown else None, 2),
        _ratio(leg.path_length_m, leg.straight_length_m),
    ]


def _robot_table(summary: MissionSummary) -> str:
    rows = [
        [
            robot.robot,
            f"{robot.reached} of {len(robot.legs)}",
            str(robot.skipped),
            str(robot.recoveries),
            str(robot.contacts) if summary.contacts_reported else "-",
            f"{robot.path_length_m:.2f}",
            _ratio(robot.path_length_m, robot.straight_length_m),
            _figure(robot.min_clearance_m, 2),
            _figure(robot.min_separation_m, 2),
        ]
        for robot in summary.robots
    ]
    header = [
        "robot",
        "reached",
        "skipped",
        "recov-\neries",
        "con-\ntacts",
        "path\nm",
        "path /\nstraight",
        "least gap to\nobstacle, m",
        "least gap to\nrobot, m",
    ]
    text = tabulate.tabulate(
        rows, header, tablefmt="simple", disable_numparse=True, colalign=("left",) + ("right",) * 8
    )
    note = f"Gaps are between hulls: discs of {summary.robot_radius_m:.2f} m radius."
    return f"{text}\n{note}"


def _contact_table(contacts: Sequence[Contact]) -> str:
    rows = [
        [
            f"{contact.time_s:.2f}",
            contact.robot,
            contact.other,
            f"{contact.x_m:.2f}",
            f"{contact.y_m:.2f}",
        ]
        for contact in contacts
    ]
    return tabulate.tabulate(
        rows,
        ["contact at\ns", "robot", "touched", "x\nm", "y\nm"],
        tablefmt="simple",
        disable_numparse=True,
        colalign=("right", "left", "left", "right", "right"),
    )


def _verdict(summary: MissionSummary) -> str:
    legs = [leg for robot in summary.robots for leg in robot.legs]
    reached = sum(leg.reached for leg in legs)
    factor = summary.real_time_factor
    speed = f", real-time factor {factor:.2f}" if factor is not None else ""
    touched = f", {len(summary.contacts)} contact{'s' * (len(summary.contacts) != 1)}"
    reason = f"\nIt ended early: {summary.reason}." if summary.reason else ""
    return (
        f"Mission {'flown' if summary.success else 'FAILED'}: {reached} of {len(legs)} goals "
        f"reached{touched if summary.contacts_reported else ''} "
        f"in {summary.sim_time_s:.1f} s (wall {summary.wall_time_s:.1f} s{speed}).{reason}"
    )


def _figure(value: Optional[float], decimals: int) -> str:
    return "-" if value is None else f"{value:.{decimals}f}"


def _ratio(path_m: float, straight_m: float) -> str:
    return f"{path_m / straight_m:.2f}" if straight_m > 0.01 else "-"


def _rounded(value: Optional[float]) -> Optional[float]:
    return None if value is None else round(value, 3)


def _robot_json(robot: RobotSummary) -> Dict[str, Any]:
    return {
        "robot": robot.robot,
        "goals": [
            {
                "goal": leg.index + 1,
                "lap": leg.lap,
                "x_m": leg.goal.x_m,
                "y_m": leg.goal.y_m,
                "yaw_rad": leg.goal.yaw_rad,
                "reached": leg.reached,
                "time_s": _rounded(leg.time_s),
                "reason": leg.reason,
                "attempts": leg.attempts,
                "path_length_m": _rounded(leg.path_length_m),
                "straight_length_m": _rounded(leg.straight_length_m),
            }
            for leg in robot.legs
        ],
        "path_length_m": _rounded(robot.path_length_m),
        "straight_length_m": _rounded(robot.straight_length_m),
        "min_clearance_m": _rounded(robot.min_clearance_m),
        "min_separation_m": _rounded(robot.min_separation_m),
        "recoveries": robot.recoveries,
        "contacts": robot.contacts,
        "aborts": robot.aborts,
        "spin_s": _rounded(robot.spin_s),
    }
