"""rospy without a ROS master: nodes run in this process, and tests call their callbacks.

`FakeRos` replaces what connects rospy to other processes. Subscribers and services register
themselves, so a test knows every one of them. Publishers serialise what they are given, as rospy
does, and always have a subscriber. The clock stands still until `set_time`.
"""

from __future__ import annotations

import collections
import contextlib
import io
import logging
from typing import Any, Callable, Dict, List, Optional, Tuple
from unittest import mock

import genpy
import rosgraph.masterapi
import rospy
from rospy.msg import args_kwds_to_message

from quad_nav.ros.common.readiness import escape_log_messages


class FakeImpl:
    """Callbacks of one subscriber."""

    def __init__(self) -> None:
        self.callbacks: List[Tuple[Callable, Any]] = []

    def add_callback(self, callback: Callable, args: Any) -> None:
        self.callbacks.append((callback, args))

    def remove_callback(self, callback: Callable, args: Any) -> None:
        self.callbacks.remove((callback, args))


class FakeSubscriber:
    """Subscriber whose messages come from `receive`."""

    all: List[FakeSubscriber] = []
    impl: Optional[FakeImpl]

    def __init__(
        self, name: str, data_class: Any, callback: Any = None, callback_args: Any = None, **_: Any
    ) -> None:
        self.resolved_name = rospy.resolve_name(name)
        self.data_class, self.type = data_class, data_class._type
        self.impl = FakeImpl()
        if callback is not None:
            self.impl.add_callback(callback, callback_args)
        FakeSubscriber.all.append(self)

    def get_num_connections(self) -> int:
        return 1

    def unregister(self) -> None:
        FakeSubscriber.all = [one for one in FakeSubscriber.all if one is not self]
        self.impl = None

    def receive(self, message: genpy.Message, sender: str = "/hostile") -> None:
        """Call the callbacks as rospy does."""
        if not isinstance(message, self.data_class):
            buff = io.BytesIO()
            message.serialize(buff)
            message = self.data_class().deserialize(buff.getvalue())
        message._connection_header = {"callerid": sender}
        for callback, args in list(self.impl.callbacks):
            callback(message) if args is None else callback(message, args)


class FakePublisher:
    """Publisher that serialises its messages and hands actions' goals to their server."""

    all: Dict[str, FakePublisher] = {}

    def __init__(self, name: str, data_class: Any, *_: Any, **__: Any) -> None:
        self.resolved_name, self.data_class = rospy.resolve_name(name), data_class
        self.type = data_class._type
        self.last: Optional[genpy.Message] = None
        self.impl = self
        FakePublisher.all[self.resolved_name] = self

    def publish(self, *args: Any, **kwds: Any) -> None:
        self.last = args_kwds_to_message(self.data_class, args, kwds)
        self.last.serialize(io.BytesIO())

    def get_num_connections(self) -> int:
        return 1

    def has_connection(self, node: str) -> bool:
        return True

    def unregister(self) -> None:
        if FakePublisher.all[self.resolved_name] is self:
            del FakePublisher.all[self.resolved_name]


class FakeService:
    """Service whose requests come from the test."""

    all: Dict[str, FakeService] = {}

    def __init__(self, name: str, service_class: Any, handler: Callable, **_: Any) -> None:
        self.resolved_name = rospy.resolve_name(name)
        self.service_class, self.handler = service_class, handler
        FakeService.all[self.resolved_name] = self

    def shutdown(self) -> None:
        del FakeService.all[self.resolved_name]


class FakeWall:
    """Wall time that a test sets, in place of the module `time`."""

    now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s


class Lines(logging.Handler):
    """Lines that were logged."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: List[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


class FakeRos:
    """Context in which rospy has no master."""

    def __init__(self, node: str) -> None:
        self._parameters: Dict[str, Any] = {}
        self.log = Lines()
        self.exit_stack = contextlib.ExitStack()  # what a node under test undoes at the end
        self._patches = [
            mock.patch.object(rospy, name, value)
            for name, value in {
                "Subscriber": FakeSubscriber,
                "Publisher": FakePublisher,
                "Service": FakeService,
                "Timer": mock.MagicMock(),
                "get_param": lambda name, default=None: self._parameters.get(name, default),
                "has_param": lambda name: name in self._parameters,
                "set_param": self._parameters.__setitem__,
                "search_param": lambda name: None,
                "get_name": lambda: node,
                "get_published_topics": lambda: [],
                "is_shutdown": lambda: False,
                "on_shutdown": lambda _: None,
            }.items()
        ]
        self._patches.append(
            mock.patch.object(
                rosgraph.masterapi.Master, "lookupService", side_effect=rosgraph.masterapi.Error
            )
        )

    def __enter__(self) -> FakeRos:
        FakeSubscriber.all, FakePublisher.all, FakeService.all = [], {}, {}
        for patch in self._patches:
            patch.start()
        self._logger = logging.getLogger("rosout")
        self._handlers, self._logger.handlers = self._logger.handlers, [self.log]
        self._logger.propagate = False
        self._filters = list(self._logger.filters)
        escape_log_messages()  # as `init_node`
        self._logger.setLevel(logging.INFO)
        rospy.rostime.set_rostime_initialized(True)
        self.set_time(1.0)
        return self

    def __exit__(self, *_: Any) -> None:
        self.exit_stack.close()
        self._logger.handlers, self._logger.propagate = self._handlers, True
        self._logger.filters = self._filters
        for patch in self._patches:
            patch.stop()

    @staticmethod
    def forget_subscribers() -> None:
        """Forget the subscribers so far: the node subscribes again."""
        FakeSubscriber.all = []

    @staticmethod
    def set_time(now_s: float) -> None:
        """Set the simulated clock."""
        rospy.rostime._set_rostime(rospy.Time.from_sec(now_s))


def subscribed() -> Dict[str, int]:
    """Return the number of subscribers of every topic of the nodes that run."""
    return dict(collections.Counter(one.resolved_name for one in FakeSubscriber.all))


def deliver(topic: str, message: genpy.Message, sender: str = "/hostile") -> None:
    """Hand a message to every subscriber of a topic, of which there must be one."""
    takers = [one for one in FakeSubscriber.all if one.resolved_name == topic]
    assert takers, f"no subscriber of {topic}"
    for one in takers:
        one.receive(message, sender)
