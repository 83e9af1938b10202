"""What nodes tell on ``/diagnostics``: levels and their meaning, as ``docs/diagnostics.md`` has it.

OK: as it should be. WARN: it flies, not as it should. ERROR: it cannot do its work now.
STALE: nothing is known, because nothing has come yet.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Dict, Mapping, Optional, Sequence

from quad_nav.navigator.tick import State

SLOW_BELOW = 0.8
"""Part of the wanted control rate below which a second is a slow one."""
SLOW_SECONDS = 3
"""Slow seconds in a row before it counts: one alone is a busy machine's."""
LATE_S = 0.2
STUCK_S = 5.0


class Level(enum.IntEnum):
    """The numbers are ``diagnostic_msgs/DiagnosticStatus``'s."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True)
class Health:
    """One status; ``name`` is "node: part", ``hardware_id`` the quadcopter or the node."""

    name: str
    hardware_id: str
    level: Level
    message: str
    values: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Input:
    """A topic that a navigator needs.

    ``rate_hz``: messages per second of wall time. ``silent_s``: simulated time since the
    last one came, None when none ever did; ``late_s``: how old its stamp was then.
    """

    topic: str
    rate_hz: float
    silent_s: Optional[float]
    late_s: float
    allowed_s: float


@dataclass(frozen=True)
class Control:
    """What a navigator has been doing for about a second.

    ``rate_hz`` and ``wanted_hz`` are control cycles per simulated second; ``slow_seconds``
    how long it has been below ``SLOW_BELOW`` of what is wanted. ``trouble`` is what is wrong
    now, ``reason`` the last thing that went wrong, ``reason_s`` when that was.
    """

    state: State
    rate_hz: float
    wanted_hz: float
    slow_seconds: int
    trouble: str
    reason: str
    reason_s: float


@dataclass(frozen=True)
class Loop:
    """A process's loop: the greatest lateness in a second, and when it last came round."""

    robots: int
    late_s: float
    unseen_s: float
    cpu: float
    memory_mb: float


def inputs_health(node: str, robot: str, inputs: Sequence[Input], is_located: bool) -> Health:
    """Whether everything that a navigator needs is coming."""
    missing = [one.topic for one in inputs if one.silent_s is None]
    silent = [
        f"nothing on {one.topic} for {one.silent_s:.1f} s"
        for one in inputs
        if one.silent_s is not None and one.silent_s > one.allowed_s
    ]
    values: Dict[str, str] = {"located": str(is_located)}
    for one in inputs:
        values[f"{one.topic} Hz"] = f"{one.rate_hz:.1f}"
        values[f"{one.topic} silent s"] = "" if one.silent_s is None else f"{one.silent_s:.2f}"
        values[f"{one.topic} late s"] = f"{one.late_s:.3f}"
    level, message = Level.OK, "all are coming"
    if missing:
        level, message = Level.STALE, "nothing yet on " + ", ".join(missing)
    if silent:
        level, message = Level.ERROR, "; ".join(silent)
    elif not missing and not is_located:
        level, message = Level.ERROR, "its place is unknown, see /tf"
    return Health(f"{node}: inputs", robot, level, message, values)


def control_health(node: str, robot: str, control: Control) -> Health:
    """What the navigator does, and how well it keeps up."""
    level, message = Level.OK, control.state.value
    if control.state is not State.IDLE:
        message += f" at {control.rate_hz:.1f} Hz"
    if control.slow_seconds >= SLOW_SECONDS:
        level = Level.WARN
        message += f", {control.wanted_hz:g} Hz are wanted"
    if control.state is State.CLEARING:
        level, message = Level.WARN, f"{message}: a recovery behaviour runs"
    if control.trouble:
        level, message = Level.WARN, f"{control.state.value}: {control.trouble}"
        if control.trouble.startswith("stopped"):
            level = Level.ERROR
    return Health(
        f"{node}: control",
        robot,
        level,
        message,
        {
            "state": control.state.value,
            "cycles per s": f"{control.rate_hz:.1f}",
            "controller_frequency": f"{control.wanted_hz:g}",
            "last reason": control.reason,
            "last reason at s": f"{control.reason_s:.2f}",
        },
    )


def loop_health(node: str, loop: Loop) -> Health:
    """Whether a process serves its robots in time."""
    level, message = Level.OK, f"{loop.robots} served"
    if loop.late_s > LATE_S:
        level, message = Level.WARN, f"up to {loop.late_s:.2f} s late: cycles are left out"
    if loop.unseen_s > STUCK_S:
        level, message = Level.ERROR, f"has not come round for {loop.unseen_s:.0f} s"
    return Health(
        f"{node}: loop",
        node,
        level,
        message,
        {
            "robots": str(loop.robots),
            "late s": f"{loop.late_s:.3f}",
            "cpu": f"{loop.cpu:.2f}",
            "memory MB": f"{loop.memory_mb:.0f}",
        },
    )
