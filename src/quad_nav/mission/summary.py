"""Summary of a mission: its figures, and their JSON, documented in ``docs/summary.md``.

``summary_table`` prints the same figures as tables.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple, Union

from quad_nav.files.output import write_text
from quad_nav.mission.distances import gap_m
from quad_nav.mission.flight_log import INTERRUPTED, FlightLog, Leg
from quad_nav.mission.sequencer import Sequencer
from quad_nav.sim.contacts import Contact
from quad_nav.versions import versions

EXIT_SUCCESS, EXIT_FAILURE, EXIT_BAD_INPUT, EXIT_INTERRUPTED = 0, 1, 2, 130
FACTS = (
    "command",
    "configuration",
    "scene",
    "goals",
    "airframe",
    "jitter_m",
    "odom_drift",
    "localization",
    "lidar",
    "time_limit_s",
)
"""Keys of the JSON object about the set-up of the flight; null if unknown."""


@dataclass(frozen=True)
class RobotSummary:
    """Figures of one robot; lengths and distances are None if they were not measured.

    ``reason`` says why its mission ended before the others', "" if it did not.
    """

    robot: str
    legs: Tuple[Leg, ...]
    path_length_m: float = 0.0
    min_clearance_m: Optional[float] = None
    min_separation_m: Optional[float] = None
    recoveries: int = 0
    contacts: int = 0
    aborts: int = 0
    spin_s: float = 0.0
    reason: str = ""

    @property
    def straight_length_m(self) -> float:
        """Sum of the legs' straight lengths."""
        return sum(leg.straight_length_m for leg in self.legs)

    @property
    def reached(self) -> int:
        """Number of goals that were reached."""
        return sum(leg.reached for leg in self.legs)

    @property
    def skipped(self) -> int:
        """Number of goals that were sent and given up."""
        return sum(
            not leg.reached and leg.attempts > 0 and leg.reason != INTERRUPTED for leg in self.legs
        )


@dataclass(frozen=True)
class MissionSummary:
    """Figures of a mission.

    Attributes:
        robots: Figures of each robot.
        contacts: All contacts in the order in which they began.
        robot_radius_m: Radius of the hulls that clearances and separations are measured from.
        sim_time_s: Duration of the mission.
        wall_time_s: Wall time that it took.
        reason: Reason why the mission ended before its goals did, "" if it did not.
        problems: Faults in the input, because of which nothing was flown.
        contacts_reported: False if nothing reports contacts.
        seed: Seed of the simulation.
        versions: Versions of the software that flew.
        facts: Facts about the set-up, by the keys of ``FACTS``; see ``scenario.flight_facts``.
        interventions: What people did that changed the mission, one line each.
    """

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
    facts: Mapping[str, Any] = field(default_factory=dict)
    interventions: Tuple[str, ...] = ()

    @property
    def success(self) -> bool:
        """True if every goal was reached without a contact."""
        return (
            not self.reason
            and not self.problems
            and not self.contacts
            and not any(robot.reason for robot in self.robots)
            and all(leg.reached for robot in self.robots for leg in robot.legs)
        )

    @property
    def exit_status(self) -> int:
        """Exit status of the program that flew the mission."""
        if self.problems:
            return EXIT_BAD_INPUT
        if self.reason == INTERRUPTED:
            return EXIT_INTERRUPTED
        return EXIT_SUCCESS if self.success else EXIT_FAILURE

    @property
    def min_separation_m(self) -> Optional[float]:
        """Smallest separation of any two robots."""
        separations_m = [robot.min_separation_m for robot in self.robots]
        return min((value_m for value_m in separations_m if value_m is not None), default=None)

    @property
    def real_time_factor(self) -> Optional[float]:
        """Simulated seconds per second of wall time."""
        return self.sim_time_s / self.wall_time_s if self.wall_time_s > 0 else None


def summarize(
    log: FlightLog,
    sequencers: Mapping[str, Sequencer],
    clock_s: float,
    *,
    sim_time_s: float,
    wall_time_s: float,
    reason: str = "",
    reasons: Mapping[str, str] = MappingProxyType({}),
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
        reasons: The same by robot.
        seed: Seed of the simulation.
        contacts_reported: False if nothing reports contacts, as on real quadcopters.
    """
    robots = (
        summarize_robot(log, name, log.robots[name].all_legs(one, clock_s), reasons.get(name, ""))
        for name, one in sequencers.items()
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


def summarize_robot(
    log: FlightLog, name: str, legs: Sequence[Leg], reason: str = ""
) -> RobotSummary:
    """Sum up one robot's part.

    Args:
        log: Flight log of all robots.
        name: The robot's name.
        legs: All of its goals, flown or not.
        reason: Reason why its mission ended early.
    """
    robot = log.robots[name]
    return RobotSummary(
        name,
        tuple(legs),
        robot.path_length_m,
        gap_m(log.distances.min_clearance_m(name), log.touches(name, robots=False)),
        gap_m(log.distances.min_separation_m(name), log.touches(name, robots=True)),
        robot.recoveries,
        log.contacts_of(name),
        robot.aborts,
        robot.spin_s,
        reason,
    )


def to_json(summary: MissionSummary) -> Dict[str, Any]:
    """Return the JSON object; lengths and times are rounded to 1 mm and 1 ms.

    A number that is not finite is null: a summary can always be written.
    """
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
        "interventions": list(summary.interventions),
        "min_separation_m": _rounded(summary.min_separation_m),
        "seed": summary.seed,
        "versions": dict(summary.versions),
        **{key: _plain(summary.facts.get(key)) for key in FACTS},
    }


def write_json(summary: MissionSummary, path: Union[str, Path]) -> None:
    """Write the JSON object to a file and create its folders; a reader never sees a part of it.

    Raises:
        OSError: The file cannot be written.
    """
    write_text(Path(path), json.dumps(to_json(summary), indent=2, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    """Return a value as JSON; numbers that are not finite and other types become text."""
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    is_number = isinstance(value, (int, float)) and math.isfinite(value)
    return value if value is None or is_number or isinstance(value, str) else str(value)


def _rounded(value: Optional[float]) -> Optional[float]:
    return None if value is None or not math.isfinite(value) else round(value, 3)


def _robot_json(robot: RobotSummary) -> Dict[str, Any]:
    return {
        "robot": robot.robot,
        "reason": robot.reason,
        "goals": [
            {
                "goal": leg.index + 1,
                "lap": leg.lap,
                "x_m": leg.goal.x_m,
                "y_m": leg.goal.y_m,
                "yaw_rad": leg.goal.yaw_rad,
                "yaw_error_rad": _rounded(leg.yaw_error_rad),
                "wait_s": leg.goal.wait_s,
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
