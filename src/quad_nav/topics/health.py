"""Statuses that nodes publish on `/diagnostics`; `docs/diagnostics.md` lists them.

OK: as expected. WARN: the robot flies, but not as expected. ERROR: the part cannot work now.
STALE: no message has arrived yet, so the status is unknown.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from quad_nav.navigator.state import State
from quad_nav.scenario.coverage import robots_text

SLOW_BELOW = 0.8
"""A second is slow if the control rate is below this part of the configured one."""
SLOW_SECONDS = 3
"""Consecutive slow seconds that give a warning; a single one happens on a busy machine."""
LATE_S = 0.2
BLOCKED_S = 5.0


class Level(enum.IntEnum):
    """Level of a status, numbered as in `diagnostic_msgs/DiagnosticStatus`."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True)
class Health:
    """One status.

    Attributes:
        name: The form is "node: part".
        hardware_id: Name of the robot, or of a node that serves several.
        level: Severity.
        message: One line for people.
        values: Figures by their keys.
    """

    name: str
    hardware_id: str
    level: Level
    message: str
    values: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Input:
    """An input topic of a navigator.

    Attributes:
        topic: Resolved name.
        rate_hz: Messages per second of wall time.
        silent_s: Simulated time since the last message; None if none has arrived.
        late_s: Age of the last message's stamp when the message arrived.
        timeout_s: Longest accepted `silent_s`.
    """

    topic: str
    rate_hz: float
    silent_s: Optional[float]
    late_s: float
    timeout_s: float


@dataclass(frozen=True)
class Control:
    """Activity of a navigator during about one second.

    Attributes:
        state: State of the state machine.
        rate_hz: Control cycles per simulated second.
        expected_hz: The configured rate.
        slow_seconds: How long `rate_hz` has been below `SLOW_BELOW` of `expected_hz`.
        fault: Present fault, or "".
        is_stopped: Whether the robot stops because of the fault.
        reason: The last fault, present or past.
        reason_s: Time of the last fault.
        cycle_s: Wall time that the slowest control cycle of the last second took.
    """

    state: State
    rate_hz: float
    expected_hz: float
    slow_seconds: int
    fault: str
    is_stopped: bool
    reason: str
    reason_s: float
    cycle_s: float = 0.0


@dataclass(frozen=True)
class Loop:
    """Control loop of a process that serves one robot or many.

    Attributes:
        robots: Number of robots served.
        late_s: Greatest delay of a cycle within the last second.
        blocked_s: Wall time since the loop completed a cycle.
        cpu: Processor time per wall time of the process.
        memory_mb: Resident memory of the process.
    """

    robots: int
    late_s: float
    blocked_s: float
    cpu: float
    memory_mb: float


def inputs_health(node: str, robot: str, inputs: Sequence[Input], is_localized: bool) -> Health:
    """Assess the input topics of a navigator and whether its pose is known."""
    missing = [one.topic for one in inputs if one.silent_s is None]
    silent = [
        f"no message on {one.topic} for {one.silent_s:.1f} s"
        for one in inputs
        if one.silent_s is not None and one.silent_s > one.timeout_s
    ]
    values: Dict[str, str] = {"located": str(is_localized)}
    for one in inputs:
        values[f"{one.topic} Hz"] = f"{one.rate_hz:.1f}"
        values[f"{one.topic} silent s"] = "" if one.silent_s is None else f"{one.silent_s:.2f}"
        values[f"{one.topic} late s"] = f"{one.late_s:.3f}"
    level, message = Level.OK, "all inputs arriving"
    if missing:
        level, message = Level.STALE, "no message yet on " + ", ".join(missing)
    if silent:
        level, message = Level.ERROR, "; ".join(silent)
    elif not missing and not is_localized:
        level, message = Level.ERROR, "robot pose unknown, check /tf"
    return Health(f"{node}: inputs", robot, level, message, values)


def control_health(node: str, robot: str, control: Control) -> Health:
    """Assess the control rate and the faults of a navigator."""
    level, message = Level.OK, control.state.value
    if control.state is not State.IDLE:
        message += f" at {control.rate_hz:.1f} Hz"
    if control.slow_seconds >= SLOW_SECONDS:
        level = Level.WARN
        message += f", expected {control.expected_hz:g} Hz"
    if control.state is State.CLEARING:
        level, message = Level.WARN, f"{message}: recovery behaviour active"
    if control.fault:
        level, message = Level.WARN, f"{control.state.value}: {control.fault}"
        if control.is_stopped:
            level = Level.ERROR
    return Health(
        f"{node}: control",
        robot,
        level,
        message,
        {
            "state": control.state.value,
            "cycles per s": f"{control.rate_hz:.1f}",
            "controller_frequency": f"{control.expected_hz:g}",
            "cycle ms": f"{1e3 * control.cycle_s:.2f}",
            "last reason": control.reason,
            "last reason at s": f"{control.reason_s:.2f}",
        },
    )


def logged_name(name: str, hardware_id: str) -> str:
    """Return a status's name for the log: that of a navigator begins with the robot's name."""
    node, colon, part = name.partition(": ")
    return f"{hardware_id}: {part}" if colon and node.startswith("move_base") else name


class LevelChange(NamedTuple):
    """Change of the level of a status: its name for the log, and its message."""

    name: str
    before: Level
    level: Level
    message: str


def change_lines(changes: Sequence[LevelChange]) -> List[Tuple[Level, str]]:
    """Format changes for the log, one line for all robots with the same change.

    Returns:
        New level and line of each, in the order of their first robots.
    """
    robots: Dict[Tuple[str, LevelChange], List[int]] = {}
    for change in changes:
        robot, _, part = change.name.partition(": ")
        number = robot[len("quad") :] if robot.startswith("quad") else ""
        name = part if number.isdigit() else change.name
        alike = robots.setdefault((name, change._replace(name="")), [])
        if number.isdigit():
            alike.append(int(number))
    return [
        (
            change.level,
            f"{robots_text(numbers) + ': ' if numbers else ''}{name}: {change.before.name} -> "
            f"{change.level.name}: {change.message}",
        )
        for (name, change), numbers in robots.items()
    ]


def loop_health(node: str, loop: Loop, robot: str = "") -> Health:
    """Assess whether a process serves its robots in time; ``robot`` is its only one."""
    level, message = Level.OK, f"serving {loop.robots} robot{'s' * (loop.robots != 1)}"
    if loop.late_s > LATE_S:
        level, message = Level.WARN, f"up to {loop.late_s:.2f} s late, skipping control cycles"
    if loop.blocked_s > BLOCKED_S:
        level, message = Level.ERROR, f"control loop blocked for {loop.blocked_s:.0f} s"
    return Health(
        f"{node}: loop",
        robot or node,
        level,
        message,
        {
            "robots": str(loop.robots),
            "late s": f"{loop.late_s:.3f}",
            "cpu": f"{loop.cpu:.2f}",
            "memory MB": f"{loop.memory_mb:.0f}",
        },
    )
