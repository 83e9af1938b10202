"""Measure the health of navigators: inputs, control and the loop that serves them."""

from __future__ import annotations

import os
import time
from typing import List, Mapping, Sequence

import rospy

from quad_nav.navigator.tick import RobotPoses, State, Tick
from quad_nav.topics import health
from quad_nav.topics.health import Health

TIMEOUT_S = 3.0  # simulated time, for a topic without an expected period
FAULT_LASTS_S = 1.5  # simulated time after the last warning


class InputMeter:
    """Measure rate, silence and latency of an input."""

    def __init__(self, topic: str, timeout_s: float = 0.0) -> None:
        """Start without messages; a timeout of 0 stands for `TIMEOUT_S`."""
        self._topic, self._timeout_s = topic, timeout_s or TIMEOUT_S
        self._count = self._read = 0
        self._received_s = self._late_s = 0.0
        self._read_wall_s = time.monotonic()

    def add(self, stamp_s: float, now_s: float) -> None:
        """Count a message that arrives now."""
        self._count += 1
        self._received_s, self._late_s = now_s, now_s - stamp_s

    def read(self, now_s: float) -> health.Input:
        """Return the figures since the last call."""
        wall_s = time.monotonic()
        rate_hz = (self._count - self._read) / max(wall_s - self._read_wall_s, 1e-3)
        self._read, self._read_wall_s = self._count, wall_s
        silent_s = max(now_s - self._received_s, 0.0) if self._count else None
        return health.Input(self._topic, rate_hz, silent_s, self._late_s, self._timeout_s)


class NavigatorHealth:
    """Measure one robot's navigator.

    The control loop calls `update`, another thread calls `read`.

    Attributes:
        expected_hz: The configured control rate.
    """

    def __init__(self, node: str, robot: str, inputs: Sequence[InputMeter]) -> None:
        self._node, self._robot, self._inputs = node, robot, inputs
        self._state, self._is_localized = State.IDLE, True  # no tick has told otherwise
        self._cycles = self._cycles_read = 0
        self._cycle_s = 0.0
        self._busy_since_s = self._read_s = self._fault_s = self._reason_s = 0.0
        self._fault = self._reason = ""
        self._is_stopped = False  # by the fault
        self._slow_seconds = 0
        self.expected_hz = 0.0

    def update(self, tick: Tick, poses: RobotPoses, wall_s: float) -> None:
        """Add a tick of the navigator, which took some wall time."""
        if self._state is State.IDLE and tick.state is not State.IDLE:
            self._busy_since_s = tick.now_s
        self._state, self._is_localized = tick.state, poses.in_global is not None
        self._cycles += tick.cycle
        if tick.cycle:
            self._cycle_s = max(self._cycle_s, wall_s)
        if tick.warnings or tick.planning_failed:
            self._fault = (tick.warnings or [f"no plan: {tick.planning_failed}"])[0]
            self._fault_s = self._reason_s = tick.now_s
            self._reason, self._is_stopped = self._fault, tick.is_stopped
        if tick.outcome is not None and not tick.outcome.succeeded:
            self._reason, self._reason_s = tick.outcome.text, tick.now_s

    def read(self, now_s: float) -> List[Health]:
        """Return the statuses of control and inputs since the last call."""
        elapsed_s = now_s - self._read_s
        rate_hz = (self._cycles - self._cycles_read) / elapsed_s if elapsed_s > 0.0 else 0.0
        was_busy = self._state is not State.IDLE and self._busy_since_s <= self._read_s
        is_slow = was_busy and elapsed_s > 0.0 and rate_hz < health.SLOW_BELOW * self.expected_hz
        self._slow_seconds = self._slow_seconds + 1 if is_slow else 0
        self._cycles_read, self._read_s = self._cycles, now_s
        cycle_s, self._cycle_s = self._cycle_s, 0.0
        fault = self._fault if 0.0 <= now_s - self._fault_s < FAULT_LASTS_S else ""
        control = health.Control(
            self._state,
            rate_hz,
            self.expected_hz,
            self._slow_seconds,
            fault,
            self._is_stopped,
            self._reason,
            self._reason_s,
            cycle_s,
        )
        return [
            health.control_health(self._node, self._robot, control),
            health.inputs_health(
                self._node,
                self._robot,
                [one.read(now_s) for one in self._inputs],
                self._is_localized,
            ),
        ]


class LoopHealth:
    """Measure the control loop of a process and its robots, given by name.

    The loop calls `update`, another thread calls `read`.
    """

    def __init__(self, robots: Mapping[str, NavigatorHealth]) -> None:
        self._robots = robots
        self._late_s, self._round_s, self._round_now_s = 0.0, time.monotonic(), 0.0
        self._read_wall_s, self._read_cpu_s = time.monotonic(), time.process_time()

    def update(self, now_s: float, late_s: float) -> None:
        """Add a round of the loop that was late by some time."""
        self._late_s = max(self._late_s, late_s)
        self._round_s, self._round_now_s = time.monotonic(), now_s

    def read(self) -> List[Health]:
        """Return the statuses of loop and robots since the last call.

        A loop that waits for a stopped clock does not count as blocked.
        """
        now_s = rospy.get_time()
        wall_s, cpu_s = time.monotonic(), time.process_time()
        cpu = (cpu_s - self._read_cpu_s) / max(wall_s - self._read_wall_s, 1e-3)
        self._read_wall_s, self._read_cpu_s = wall_s, cpu_s
        late_s, self._late_s = self._late_s, 0.0
        blocked_s = wall_s - self._round_s if now_s > self._round_now_s + health.LATE_S else 0.0
        robots = list(self._robots)
        loop = health.loop_health(
            rospy.get_name().lstrip("/"),
            health.Loop(len(robots), late_s, blocked_s, cpu, _memory_mb()),
            robots[0] if len(robots) == 1 else "",
        )
        return [loop, *(one for meters in self._robots.values() for one in meters.read(now_s))]


def _memory_mb() -> float:
    """Return the resident memory of this process."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
