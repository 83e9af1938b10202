"""Feed every subscriber and service of a node with generated messages, in this process.

A node is an object with `valid` (a valid message for each topic), `requests()` (one for each
service), `settle()` (process what arrived), `fly()` (good messages and control cycles),
`recover()` (assert that good messages count again), `untouched(robot)` and `now_s`.
"""

from __future__ import annotations

import collections
import copy
import io
import re
import time
import traceback
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Callable, Dict

import genpy
import rospy
from fake_ros import FakeRos, FakeService, deliver, subscribed
from message_generator import Generator

SETTLE_EVERY, FLY_EVERY = 5, 200
SERVICE_SHARE = 100  # a plan or a reconfiguration takes as long as a hundred messages
LEAST_REQUESTS = 200
LINES_PER_S, LINES_AT_ONCE = 20.0, 60


@dataclass
class Report:
    """Outcome of generated messages to a node.

    Attributes:
        counts: Messages by subscriber or service.
        seconds: Wall time by subscriber or service.
        lines: Lines logged, by subscriber or service.
        faults: Faults with the number of times each occurred.
    """

    counts: Dict[str, int] = field(default_factory=dict)
    seconds: Dict[str, float] = field(default_factory=dict)
    lines: Dict[str, int] = field(default_factory=dict)
    faults: Dict[str, int] = field(default_factory=collections.Counter)

    def __str__(self) -> str:
        faults = [f"FAULT {count} x {text}" for text, count in self.faults.items()]
        total = f"in all {sum(self.counts.values())} in {sum(self.seconds.values()):.0f} s"
        return "\n".join([total, *faults])


class Feeder:
    """Feed one node."""

    def __init__(self, ros: FakeRos, node: Any, count: int, seed: int = 1) -> None:
        self._ros, self._node, self._count, self._seed = ros, node, count, seed
        self.report = Report()

    def run(self) -> Report:
        """Feed all subscribers and services, one after the other."""
        self._node.recover()
        for topic, takers in subscribed().items():
            valid = self._node.valid.get(topic)
            if valid is None:
                self.report.faults[f"{topic}: no generator for its {takers} subscribers"] += 1
                continue
            self._feed(f"{topic} (to {takers})", topic, valid, partial(deliver, topic))
        self._count = max(self._count // SERVICE_SHARE, LEAST_REQUESTS)
        for name, request in self._node.requests().items():
            self._feed(name, name, lambda request=request: copy.copy(request), self._caller(name))
        return self.report

    @staticmethod
    def _caller(name: str) -> Callable[[Any], None]:
        service = FakeService.all[name]

        def call(request: Any) -> None:
            try:
                response = service.handler(request)
            except rospy.ServiceException:
                return  # the client gets the reason
            response.serialize(io.BytesIO())

        return call

    def _feed(
        self,
        name: str,
        topic: str,
        valid: Callable[[], genpy.Message],
        receive: Callable[[genpy.Message], None],
    ) -> None:
        generator = Generator(valid, lambda: self._node.now_s, self._seed)
        self._ros.log.lines, start_s = [], time.monotonic()
        others = [k for k in range(2) if str(1 - k) in re.findall(r"\d", topic)]
        for n in range(1, self._count + 1):
            message = generator.message()
            self._guarded(name, partial(receive, message), message)
            if n % SETTLE_EVERY == 0:
                self._guarded(name, self._node.settle, message)
            if n % FLY_EVERY == 0:
                self._guarded(name, self._node.fly, message)
                for robot in others:
                    if not self._node.untouched(robot):
                        self.report.faults[f"{name}: robot {robot} has lost its input"] += 1
        self._guarded(name, self._node.recover, None)
        seconds, lines = time.monotonic() - start_s, self._ros.log.lines
        self.report.counts[name], self.report.seconds[name] = self._count, seconds
        self.report.lines[name] = len(lines)
        print(f"{name}: {self._count} messages, {seconds:.1f} s, {len(lines)} lines", flush=True)
        if len(lines) > LINES_AT_ONCE + LINES_PER_S * seconds:
            common = collections.Counter(re.sub(r"-?[\d.]+", "#", line[:80]) for line in lines)
            self.report.faults[f"{name}: {len(lines)} lines: {common.most_common(2)}"] += 1
        for line in lines:
            if len(line) > 3000 or not line.replace("\n", "").isprintable():
                self.report.faults[f"{name}: not printable: {line[:80]!r}"] += 1

    def _guarded(self, name: str, call: Callable[[], Any], message: Any) -> None:
        try:
            call()
        except Exception as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{last.filename.rsplit('/', 1)[-1]}:{last.lineno}"
            text = re.sub(r"\d+", "#", f"{error!r:.150}")
            fault = f"{name}: {place}: {text}"
            if fault not in self.report.faults and message is not None:
                print(f"{fault}\n{str(message)[:3000]}\n{traceback.format_exc()}", flush=True)
            self.report.faults[fault] += 1


def feed(node_name: str, make: Callable[[FakeRos], Any], count: int) -> Report:
    """Run a node and feed it."""
    with FakeRos(node_name) as ros:
        return Feeder(ros, make(ros), count).run()
