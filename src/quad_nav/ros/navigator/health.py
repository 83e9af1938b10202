"""How navigators are: their inputs, control and the loop that serves them, measured."""

from __future__ import annotations

import os
import time
from typing import List, Sequence

import rospy

from quad_nav.navigator.tick import RobotPoses, State, Tick
from quad_nav.topics import health
from quad_nav.topics.health import Health

SILENT_AFTER_S = 3.0  # of simulated time, for a topic that nobody expects more often
TROUBLE_LASTS_S = 1.5  # of simulated time, after the last warning


class InputMeter:
    """Counts what comes on a topic."""

    def __init__(self, subscriber: rospy.Subscriber, allowed_s: float = 0.0):
        self._topic, self._allowed_s = subscriber.resolved_name, allowed_s or SILENT_AFTER_S
        self._count = self._read = 0
        self._heard_s = self._late_s = 0.0
        self._read_wall_s = time.monotonic()
        subscriber.impl.add_callback(self._hear, None)

    def _hear(self, message) -> None:
        self._count += 1
        self._heard_s = rospy.get_time()
        self._late_s = self._heard_s - message.header.stamp.to_sec()

    def read(self, now_s: float) -> health.Input:
        """Since it was read last."""
        wall_s = time.monotonic()
        rate_hz = (self._count - self._read) / max(wall_s - self._read_wall_s, 1e-3)
        self._read, self._read_wall_s = self._count, wall_s
        silent_s = max(now_s - self._heard_s, 0.0) if self._count else None
        return health.Input(self._topic, rate_hz, silent_s, self._late_s, self._allowed_s)


class NavigatorHealth:
    """One robot's. ``ticked`` is called by the navigator's loop, ``read`` by another thread."""

    def __init__(self, node: str, robot: str, inputs: Sequence[InputMeter]):
        self._node, self._robot, self._inputs = node, robot, inputs
        self._state, self._is_located = State.IDLE, False
        self._cycles = self._cycles_read = 0
        self._busy_since_s = self._read_s = self._trouble_s = self._reason_s = 0.0
        self._trouble = self._reason = ""
        self._slow_seconds = 0
        self.wanted_hz = 0.0

    def ticked(self, tick: Tick, located: RobotPoses) -> None:
        """Takes what a tick says."""
        if self._state is State.IDLE and tick.state is not State.IDLE:
            self._busy_since_s = tick.now_s
        self._state, self._is_located = tick.state, located.in_global is not None
        self._cycles += tick.cycle
        if tick.warnings or tick.planning_failed:
            self._trouble = (tick.warnings or [f"no plan: {tick.planning_failed}"])[0]
            self._trouble_s = self._reason_s = tick.now_s
            self._reason = self._trouble
        if tick.outcome is not None and not tick.outcome.succeeded:
            self._reason, self._reason_s = tick.outcome.text, tick.now_s

    def read(self, now_s: float) -> List[Health]:
        """Since it was read last."""
        elapsed_s = now_s - self._read_s
        rate_hz = (self._cycles - self._cycles_read) / elapsed_s if elapsed_s > 0.0 else 0.0
        was_busy = self._state is not State.IDLE and self._busy_since_s <= self._read_s
        is_slow = was_busy and elapsed_s > 0.0 and rate_hz < health.SLOW_BELOW * self.wanted_hz
        self._slow_seconds = self._slow_seconds + 1 if is_slow else 0
        self._cycles_read, self._read_s = self._cycles, now_s
        trouble = self._trouble if 0.0 <= now_s - self._trouble_s < TROUBLE_LASTS_S else ""
        control = health.Control(
            self._state,
            rate_hz,
            self.wanted_hz,
            self._slow_seconds,
            trouble,
            self._reason,
            self._reason_s,
        )
        return [
            health.control_health(self._node, self._robot, control),
            health.inputs_health(
                self._node, self._robot, [one.read(now_s) for one in self._inputs], self._is_located
            ),
        ]


class LoopHealth:
    """A process's loop. ``came_round`` is called by it, ``read`` by another thread."""

    def __init__(self, robots: int):
        self._robots = robots
        self._late_s, self._round_s, self._round_now_s = 0.0, time.monotonic(), 0.0
        self._read_wall_s, self._read_cpu_s = time.monotonic(), time.process_time()

    def came_round(self, now_s: float, late_s: float) -> None:
        self._late_s = max(self._late_s, late_s)
        self._round_s, self._round_now_s = time.monotonic(), now_s

    def read(self, now_s: float) -> Health:
        """Since it was read last; a loop that waits for a clock that stands is not stuck."""
        wall_s, cpu_s = time.monotonic(), time.process_time()
        cpu = (cpu_s - self._read_cpu_s) / max(wall_s - self._read_wall_s, 1e-3)
        self._read_wall_s, self._read_cpu_s = wall_s, cpu_s
        late_s, self._late_s = self._late_s, 0.0
        unseen_s = wall_s - self._round_s if now_s > self._round_now_s + health.LATE_S else 0.0
        return health.loop_health(
            rospy.get_name().lstrip("/"),
            health.Loop(self._robots, late_s, unseen_s, cpu, _memory_mb()),
        )


def _memory_mb() -> float:
    """Resident memory of this process."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
