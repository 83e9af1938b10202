"""Fuzz target that needs ROS: bytes as they come over the wire, to the callbacks of a navigator."""

from __future__ import annotations

import sys
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any, List, Tuple

import genpy

sys.path.insert(0, str(Path(__file__).parents[1] / "ros"))

from fake_ros import FakeRos, FakeSubscriber, deliver  # noqa: E402
from hostile_navigators import Navigators  # noqa: E402

SETTLE_EVERY, FLY_EVERY, RECOVER_EVERY = 5, 500, 50_000


class _Fuzzed:
    """A navigator that has taken off, and the number of messages that it has had."""

    def __init__(self) -> None:
        self.ros = FakeRos("/move_base0")
        self.ros.__enter__()
        self.node = Navigators(self.ros, 1)
        self.node.recover()
        self.topics: List[Tuple[str, Any]] = [
            (one.resolved_name, one.data_class) for one in FakeSubscriber.all
        ]
        self.count = 0


@lru_cache(maxsize=None)
def _fuzzed() -> _Fuzzed:
    return _Fuzzed()


def messages(data: bytes) -> None:
    """The first byte says which topic, the rest is a message as it comes over the wire."""
    fuzzed = _fuzzed()
    topic, data_class = fuzzed.topics[data[0] % len(fuzzed.topics) if data else 0]
    try:
        message = data_class().deserialize(data[1:])
    except (genpy.DeserializationError, ValueError):
        return  # rospy drops the connection
    deliver(topic, message)
    fuzzed.count += 1
    if fuzzed.count % SETTLE_EVERY == 0:
        fuzzed.node.settle()
    if fuzzed.count % FLY_EVERY == 0:
        fuzzed.node.fly()
        fuzzed.ros.log.lines.clear()
    if fuzzed.count % RECOVER_EVERY == 0:
        fuzzed.node.recover()


def write_corpus(folder: Path) -> None:
    """Write a valid message for each topic, with which the fuzzer begins."""
    fuzzed = _fuzzed()
    for number, (topic, _) in enumerate(fuzzed.topics):
        content = BytesIO()
        fuzzed.node.valid[topic]().serialize(content)
        (folder / f"topic{number}").write_bytes(bytes([number]) + content.getvalue())
