"""Fly one flight of a study, and its result."""

from __future__ import annotations

import json
import math
from dataclasses import MISSING, asdict, dataclass
from dataclasses import fields as dataclass_fields
from typing import Any, List, Mapping, Optional

from quad_nav.files.values import Rule, is_number, number, unknown_names, value_faults, whole
from quad_nav.geometry import Twist2D
from quad_nav.mission.summary import MissionSummary, RobotSummary
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.offline.flight import Flight, FlightObserver, StopAtContact
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightSetup

_TURN_ARM_M = 0.3
"""Distance of the hull from the centre, at which a change of turn rate counts as speed."""


@dataclass(frozen=True)
class FlightTask:
    """Flight that any machine can fly, with everything it needs.

    ``refused`` is the reason why the parameters are invalid; ``setup`` is None then.
    """

    setup: Optional[FlightSetup]
    ends_at_contact: bool = False
    refused: str = ""


@dataclass(frozen=True)
class FlightResult:
    """Result of a flight. Distances are between hulls, None if nothing was near.

    Attributes:
        goals: Number of goals.
        reached: Number of reached goals.
        contacts: Number of contacts.
        time_s: Time from the first goal to the last one's end, of the slowest robot.
        straight_m: Length of the straight path from the start through the goals, of the robot for
            which it is longest.
        clearance_m: Smallest clearance.
        separation_m: Smallest separation.
        roughness_mps2: Mean change of the commands per second, see ``Roughness``.
        recoveries: Number of recovery behaviours.
        reason: Reason why the flight ended early or did not start.
    """

    goals: int
    reached: int
    contacts: int
    time_s: float
    straight_m: float
    clearance_m: Optional[float] = None
    separation_m: Optional[float] = None
    roughness_mps2: float = 0.0
    recoveries: int = 0
    reason: str = ""

    @property
    def completed(self) -> bool:
        """True if every goal was reached."""
        return self.goals > 0 and self.reached == self.goals

    @property
    def succeeded(self) -> bool:
        """True if every goal was reached without contact."""
        return self.completed and self.contacts == 0

    @property
    def gap_m(self) -> Optional[float]:
        """Smaller of clearance and separation."""
        gaps = [gap for gap in (self.clearance_m, self.separation_m) if gap is not None]
        return min(gaps, default=None)

    def to_json(self) -> str:
        """Serialize the result."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> FlightResult:
        """Parse a serialized result.

        Raises:
            ValueError: The text is not a result; says all that is wrong.
        """
        try:
            fields = json.loads(text)
        except (ValueError, TypeError, RecursionError) as error:
            raise ValueError(f"result is not JSON: {error}") from None
        faults = _result_faults(fields)
        if faults:
            raise ValueError("; ".join(faults))
        return cls(**fields)


_MOST = 10**9
_GAP = Rule(lambda value: value is None or is_number(value), "a number or null")
_RULES = {
    "goals": whole(0, _MOST),
    "reached": whole(0, _MOST),
    "contacts": whole(0, _MOST),
    "time_s": number(at_least=0, at_most=_MOST),
    "straight_m": number(at_least=0, at_most=_MOST),
    "clearance_m": _GAP,
    "separation_m": _GAP,
    "roughness_mps2": number(at_least=0, at_most=_MOST),
    "recoveries": whole(0, _MOST),
    "reason": Rule(lambda value: isinstance(value, str), "a text"),
}
_DEFAULTS = {
    field.name: None if field.default is MISSING else field.default
    for field in dataclass_fields(FlightResult)
}


def _result_faults(fields: Any) -> List[str]:
    """Return the faults of a serialized result; older ones lack fields that have a default."""
    if not isinstance(fields, dict):
        return ["result is no mapping"]
    values: Mapping[str, Any] = {**_DEFAULTS, **fields}
    faults = unknown_names(fields, _RULES, "result", "a field of a result")
    faults += value_faults(values, _RULES, "result")
    if not faults and values["reached"] > values["goals"]:
        faults.append(f"result: reached: {values['reached']} of {values['goals']} goals")
    return [fault if len(fault) <= 300 else f"{fault[:300]} ..." for fault in faults]


def fly_task(task: FlightTask) -> FlightResult:
    """Fly a task; invalid parameters reach no goal."""
    if task.setup is None:
        return FlightResult(1, 0, 0, 0.0, 1.0, reason=task.refused)
    roughness = Roughness()
    stops = (StopAtContact(),) if task.ends_at_contact else ()
    summary = fly(task.setup, (roughness, *stops))
    return result_of(summary, task.setup, roughness.mean_mps2)


def result_of(summary: MissionSummary, setup: FlightSetup, roughness_mps2: float) -> FlightResult:
    """Extract the result from a flight's summary."""
    legs = [leg for robot in summary.robots for leg in robot.legs]
    return FlightResult(
        goals=len(legs),
        reached=sum(leg.reached for leg in legs),
        contacts=len(summary.contacts),
        time_s=max(map(_time_s, summary.robots)),
        straight_m=max(
            _straight_m(robot, start.x_m, start.y_m)
            for robot, start in zip(summary.robots, setup.scene.starts)
        ),
        clearance_m=_least([robot.min_clearance_m for robot in summary.robots]),
        separation_m=_least([robot.min_separation_m for robot in summary.robots]),
        roughness_mps2=roughness_mps2,
        recoveries=sum(robot.recoveries for robot in summary.robots),
        reason=summary.reason,
    )


class Roughness(FlightObserver):
    """Measures the mean change of the commands per second and robot.

    A command is (vx, vy, turn rate). A change of the turn rate counts as the change of speed that
    it causes at the hull, 0.3 m from the centre. A command without a successor changes nothing.
    """

    def __init__(self) -> None:
        self._last: List[Optional[Twist2D]] = []
        self._total_mps = 0.0
        self._time_s = 0.0

    def on_start(self, flight: Flight) -> None:
        """Reset the last commands."""
        self._last = [None] * len(flight.robots)

    def on_tick(self, robot: int, tick: Tick, located: RobotPoses, wall_s: float) -> None:
        """Add the change from the last command."""
        new, old = tick.command, self._last[robot]
        if new is None:
            return
        if old is not None:
            self._total_mps += math.hypot(new.vx_mps - old.vx_mps, new.vy_mps - old.vy_mps)
            self._total_mps += _TURN_ARM_M * abs(new.vyaw_radps - old.vyaw_radps)
        self._last[robot] = new

    def on_end(self, flight: Flight) -> None:
        """Store the flight's duration."""
        self._time_s = flight.now_s

    @property
    def mean_mps2(self) -> float:
        """Mean change of the commands per second and robot."""
        robot_s = self._time_s * len(self._last)
        return self._total_mps / robot_s if robot_s > 0.0 else 0.0


def _time_s(robot: RobotSummary) -> float:
    return sum(leg.time_s or 0.0 for leg in robot.legs)


def _straight_m(robot: RobotSummary, x_m: float, y_m: float) -> float:
    total_m = 0.0
    for leg in robot.legs:
        total_m += math.hypot(leg.goal.x_m - x_m, leg.goal.y_m - y_m)
        x_m, y_m = leg.goal.x_m, leg.goal.y_m
    return total_m


def _least(gaps: List[Optional[float]]) -> Optional[float]:
    known = [gap for gap in gaps if gap is not None and math.isfinite(gap)]
    return min(known, default=None)
