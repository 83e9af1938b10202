"""Key metrics of a flight, for the head of a report and for comparisons."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Mapping, Optional, Tuple

import numpy as np

from quad_nav.mission.distances import gap_m, nearest_separations_m
from quad_nav.mission.localization_errors import error_figures
from quad_nav.recording.trace import FlightTrace, RobotTrace
from quad_nav.report.measures import (
    Span,
    Tracks,
    clearances_m,
    goal_end_s,
    mission_span,
    path_length_m,
    resampled_tracks,
    smallest,
    speed_mps,
    spins,
    straight_length_m,
    tilt_rad,
    trace_span_s,
)


@dataclass(frozen=True)
class RobotMetrics:
    """Metrics of one robot; lengths and distances that were not measured are None."""

    name: str
    goals: int
    reached: int
    skipped: int
    path_length_m: float
    straight_length_m: float
    min_clearance_m: Optional[float]
    min_separation_m: Optional[float]
    recoveries: int
    contacts: int
    spin_s: float
    top_speed_mps: float
    top_tilt_rad: float


@dataclass(frozen=True)
class FlightMetrics:
    """Metrics of a flight.

    ``mission_s`` runs from sending the first goal to the end of the last one. ``covered_s`` is the
    period of a recording that does not hold the whole mission; None if it does. ``cycle_ms`` is
    the mean wall time of a control cycle; None if it is not known, as from recordings.
    ``localization`` has the figures of the believed poses' errors; None without errors.
    """

    title: str
    config_name: str
    seed: Optional[int]
    robots: Tuple[RobotMetrics, ...]
    mission_s: float
    contacts: int
    reason: str
    cycle_ms: Optional[float] = None
    localization: Optional[Mapping[str, Any]] = None
    covered_s: Optional[Span] = None

    @property
    def goals(self) -> int:
        """Number of goals that were sent, and of those of the goal files that were left."""
        return sum(robot.goals for robot in self.robots)

    @property
    def reached(self) -> int:
        """Number of goals that were reached."""
        return sum(robot.reached for robot in self.robots)

    @property
    def success(self) -> bool:
        """True if goals were sent, all were reached and there was no contact."""
        return self.verdict == "completed"

    @property
    def verdict(self) -> str:
        """``completed``, ``failed``, ``unknown`` or, as far as is recorded, ``not complete``."""
        if self.faults:
            return "failed"
        if not self.goals:
            return "unknown"
        return "completed" if self.covered_s is None else "not complete"

    @property
    def remarks(self) -> Tuple[str, ...]:
        """Reasons for the verdict."""
        if self.covered_s is None:
            return self.faults if self.goals else ("goals are not recorded", *self.faults)
        first_s, last_s = self.covered_s
        return (f"recording covers {first_s:.1f} to {last_s:.1f} s", *self.faults)

    @property
    def faults(self) -> Tuple[str, ...]:
        """Reasons why the flight failed."""
        found = [f"ended early ({self.reason})"] if self.reason else []
        missed = self.goals - self.reached
        if self.covered_s is not None:
            missed = sum(robot.skipped for robot in self.robots)
        if missed:
            found.append(f"{missed} of {self.goals} goals not reached")
        if self.contacts:
            found.append(f"{self.contacts} contact{'s' * (self.contacts > 1)}")
        return tuple(found)

    @property
    def detour(self) -> Optional[float]:
        """Flown length divided by straight length; None if the straight length is 0."""
        straight_m = sum(robot.straight_length_m for robot in self.robots)
        if straight_m < 0.01:
            return None
        return sum(robot.path_length_m for robot in self.robots) / straight_m

    @property
    def min_clearance_m(self) -> Optional[float]:
        """Smallest clearance of all robots."""
        return smallest([_number(robot.min_clearance_m) for robot in self.robots])

    @property
    def min_separation_m(self) -> Optional[float]:
        """Smallest separation of all robots."""
        return smallest([_number(robot.min_separation_m) for robot in self.robots])

    @property
    def position_error_m(self) -> Optional[float]:
        """Error of the believed positions in 95 % of the time; None if it is not known."""
        figures = self.localization
        return None if figures is None else float(figures["position_error_m"]["p95"])

    @property
    def path_length_m(self) -> float:
        """Length of all robots' paths."""
        return sum(robot.path_length_m for robot in self.robots)

    @property
    def spin_s(self) -> float:
        """Time that the robots turned in place."""
        return sum(robot.spin_s for robot in self.robots)

    @property
    def recoveries(self) -> int:
        """Number of recovery behaviours of all robots."""
        return sum(robot.recoveries for robot in self.robots)


def flight_metrics(trace: FlightTrace, tracks: Optional[Tracks] = None) -> FlightMetrics:
    """Compute the metrics of a flight; ``tracks`` are its resampled tracks, if known."""
    tracks = resampled_tracks(trace) if tracks is None else tracks
    clearances = clearances_m(tracks, trace)
    separations = nearest_separations_m(tracks.positions_m, trace.robot_radius_m)
    robots = tuple(
        _robot(robot, trace, smallest(clearances[k]), smallest(separations[k]))
        for k, robot in enumerate(trace.robots)
    )
    sent = [goal.sent_s for robot in trace.robots for goal in robot.goals]
    ended = [goal_end_s(goal, robot) for robot in trace.robots for goal in robot.goals]
    return FlightMetrics(
        trace.title,
        trace.config_name,
        trace.seed,
        robots,
        max(ended) - min(sent) if sent else 0.0,
        len(trace.contacts),
        trace.reason,
        _mean_cycle_ms(trace),
        _localization(trace),
        _covered_s(trace),
    )


def _covered_s(trace: FlightTrace) -> Optional[Span]:
    """Return the period of a recording that lacks a part of the mission; None if it lacks none."""
    is_whole = all(
        len({goal.index for goal in robot.goals}) >= len(robot.mission)
        and all(goal.ended_s is not None for goal in robot.goals)
        for robot in trace.robots
    )
    return None if is_whole or trace.reason else trace_span_s(trace)


def _localization(trace: FlightTrace) -> Optional[Mapping[str, Any]]:
    errors = [robot.errors for robot in trace.robots if len(robot.errors)]
    return error_figures(errors) if errors else None


def _mean_cycle_ms(trace: FlightTrace) -> Optional[float]:
    walls_s = np.concatenate([robot.cycle_walls_s for robot in trace.robots] or [np.empty(0)])
    return 1e3 * float(walls_s.mean()) if len(walls_s) else None


def _robot(
    robot: RobotTrace,
    trace: FlightTrace,
    clearance_m: Optional[float],
    separation_m: Optional[float],
) -> RobotMetrics:
    span = mission_span(robot)
    others = {one.name for one in trace.robots}
    touched = [
        {contact.robot, contact.other} <= others
        for contact in trace.contacts
        if contact.involves(robot.name)
    ]
    return RobotMetrics(
        robot.name,
        len(robot.goals) + len(robot.unsent),
        sum(goal.reached for goal in robot.goals),
        sum(goal.ended_s is not None and not goal.reached for goal in robot.goals),
        path_length_m(robot, span),
        straight_length_m(robot),
        gap_m(clearance_m, False in touched),
        gap_m(separation_m, True in touched),
        len(robot.recoveries),
        len(touched),
        sum(last - first for first, last in spins(robot)),
        float(np.max(speed_mps(robot), initial=0.0)),
        float(np.max(tilt_rad(robot.quaternions), initial=0.0)),
    )


def _number(value: Optional[float]) -> float:
    return np.nan if value is None else value
