"""The key figures of a flight: what the head of the page and comparisons show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np

from quad_nav.recording.trace import FlightTrace, RobotTrace
from quad_nav.report.measures import (
    Tracks,
    clearances_m,
    end_s,
    flying_span,
    least,
    path_length_m,
    separations_m,
    speed_mps,
    spins,
    straight_length_m,
    tilt_rad,
    tracks,
)


@dataclass(frozen=True)
class RobotMetrics:
    """One quadcopter's; lengths and gaps are None where they could not be measured."""

    name: str
    sent: int
    reached: int
    path_length_m: float
    straight_length_m: float
    least_clearance_m: Optional[float]
    least_separation_m: Optional[float]
    recoveries: int
    contacts: int
    spin_s: float
    top_speed_mps: float
    top_tilt_rad: float


@dataclass(frozen=True)
class FlightMetrics:
    """A whole flight's. ``mission_s`` runs from the first goal's sending to the last one's end."""

    title: str
    config_name: str
    seed: Optional[int]
    robots: Tuple[RobotMetrics, ...]
    mission_s: float
    contacts: int
    reason: str

    @property
    def sent(self) -> int:
        return sum(robot.sent for robot in self.robots)

    @property
    def reached(self) -> int:
        return sum(robot.reached for robot in self.robots)

    @property
    def success(self) -> bool:
        """Goals were sent, all of them were reached and nothing touched."""
        return not self.faults

    @property
    def faults(self) -> Tuple[str, ...]:
        """Why it was no success."""
        found = [f"it ended early ({self.reason})"] if self.reason else []
        if self.reached < self.sent:
            found.append(f"{self.sent - self.reached} of {self.sent} goals not reached")
        if self.contacts:
            found.append(f"{self.contacts} contact{'s' * (self.contacts > 1)}")
        return tuple(found) if self.sent else (*found, "no goal was sent")

    @property
    def path_ratio(self) -> Optional[float]:
        """Way flown in parts of the straight one; None where there was none to fly."""
        straight_m = sum(robot.straight_length_m for robot in self.robots)
        if straight_m < 0.01:
            return None
        return sum(robot.path_length_m for robot in self.robots) / straight_m

    @property
    def least_clearance_m(self) -> Optional[float]:
        return least([_number(robot.least_clearance_m) for robot in self.robots])

    @property
    def least_separation_m(self) -> Optional[float]:
        return least([_number(robot.least_separation_m) for robot in self.robots])

    @property
    def recoveries(self) -> int:
        return sum(robot.recoveries for robot in self.robots)


def flight_metrics(trace: FlightTrace, among: Optional[Tracks] = None) -> FlightMetrics:
    """The figures of a flight; ``among`` are its tracks where they are there already."""
    among = tracks(trace) if among is None else among
    clearances = clearances_m(among, trace.scene, trace.robot_radius_m)
    separations = separations_m(among, trace.robot_radius_m)
    robots = tuple(
        _robot(robot, trace, least(clearances[k]), least(separations[k]))
        for k, robot in enumerate(trace.robots)
    )
    sent = [goal.sent_s for robot in trace.robots for goal in robot.goals]
    ended = [end_s(goal, robot) for robot in trace.robots for goal in robot.goals]
    return FlightMetrics(
        trace.title,
        trace.config_name,
        trace.seed,
        robots,
        max(ended) - min(sent) if sent else 0.0,
        len(trace.contacts),
        trace.reason,
    )


def _robot(
    robot: RobotTrace,
    trace: FlightTrace,
    clearance_m: Optional[float],
    separation_m: Optional[float],
) -> RobotMetrics:
    span = flying_span(robot)
    return RobotMetrics(
        robot.name,
        len(robot.goals),
        sum(goal.reached for goal in robot.goals),
        path_length_m(robot, span),
        straight_length_m(robot),
        clearance_m,
        separation_m,
        len(robot.recoveries),
        sum(robot.name in (contact.robot, contact.other) for contact in trace.contacts),
        sum(last - first for first, last in spins(robot)),
        float(np.max(speed_mps(robot), initial=0.0)),
        float(np.max(tilt_rad(robot.quaternions), initial=0.0)),
    )


def _number(value: Optional[float]) -> float:
    return np.nan if value is None else value
