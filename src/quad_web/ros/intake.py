"""Subscribe to what is wanted, and keep the newest message of each topic as bytes.

Messages are decoded when they are shown, not when they arrive: most of them never are.
"""

from __future__ import annotations

import functools
import threading
import time
from collections import deque
from typing import Any, Callable, Deque, Dict, List, Mapping, NamedTuple, Optional, Tuple

import rosgraph
import rospy
from genpy import DeserializationError

from quad_nav.ros.common.diagnostics import ThrottledWarnings

RETRY_S = 1.0
PAUSE_S = 0.02
"""Between two subscriptions: hundreds at once would stall the nodes that publish."""


@functools.lru_cache(maxsize=None)
def raw_type(message_type: Any) -> Any:
    """Return a message type whose instances keep their bytes in `data_bytes`."""

    def deserialize(message: Any, data: bytes) -> Any:
        message.data_bytes = bytes(data)
        return message

    return type(message_type.__name__, (message_type,), {"deserialize": deserialize})


class Topic(NamedTuple):
    """A topic to subscribe to: type of its messages, and what is called with each."""

    message_type: Any
    callback: Callable[[Any], None]


class Newest:
    """The newest messages of a topic, as bytes.

    Attributes:
        topic: The topic, for `Subscriptions`.
        received_s: Wall time, monotonic, of the newest message; None before the first.
    """

    def __init__(self, name: str, message_type: Any, kept: int = 1) -> None:
        """Keep messages of this type; subscribing is up to `Subscriptions`."""
        self._name, self._message_type = name, message_type
        self._raw: Deque[Any] = deque(maxlen=kept)
        self.received_s: Optional[float] = None
        self.topic = Topic(raw_type(message_type), self._store)

    def _store(self, message: Any) -> None:
        self._raw.append(message)
        self.received_s = time.monotonic()

    def clear(self) -> None:
        """Forget what is kept."""
        self._raw.clear()

    def take_bytes(self) -> Optional[bytes]:
        """Return the newest message's bytes; None if there is none since the last call."""
        return self._raw.popleft().data_bytes if self._raw else None

    def take(self) -> Optional[Any]:
        """Return the newest message; None if there is none since the last call.

        Raises:
            ValueError: If it cannot be decoded.
        """
        messages = self.take_all()
        return messages[-1] if messages else None

    def take_all(self) -> List[Any]:
        """Return all messages that are kept since the last call, the oldest first.

        Raises:
            ValueError: If one cannot be decoded.
        """
        raw = [self._raw.popleft() for _ in range(len(self._raw))]
        # Another subscriber of this process may have had a message decoded.
        return [
            decoded(self._message_type, one.data_bytes) if hasattr(one, "data_bytes") else one
            for one in raw
        ]


def decoded(message_type: Any, data: bytes) -> Any:
    """Decode a message.

    Raises:
        ValueError: If the bytes are not such a message.
    """
    try:
        return message_type().deserialize(data)
    except (DeserializationError, UnicodeDecodeError, OverflowError) as error:
        raise ValueError(f"it cannot be read: {error}") from error


class Subscriptions:
    """Subscribe to the topics that are wanted at present, in a thread of its own.

    Subscribing asks the ROS master, which may take long or hang.
    """

    def __init__(self) -> None:
        """Start without topics."""
        self._wanted: Dict[str, Topic] = {}
        self._open: Dict[str, Tuple[Topic, rospy.Subscriber]] = {}
        self._changed = threading.Event()
        self._warnings = ThrottledWarnings()
        threading.Thread(target=self._run, name="subscriptions", daemon=True).start()

    def want(self, topics: Mapping[str, Topic]) -> None:
        """Subscribe to these topics, by their names, and to no others, soon."""
        if topics != self._wanted:
            self._wanted = dict(topics)
            self._changed.set()

    def _run(self) -> None:
        while not rospy.is_shutdown():
            self._changed.wait(RETRY_S)
            self._changed.clear()
            try:
                self._change()
            except (OSError, rosgraph.MasterException, rospy.ROSException) as error:
                if not rospy.core.is_shutdown_requested():
                    self._warnings.warn(f"web: topics cannot be subscribed to, retrying: {error}")

    def _change(self) -> None:
        wanted = self._wanted
        for name, (topic, subscriber) in list(self._open.items()):
            if wanted.get(name) != topic:
                del self._open[name]
                subscriber.unregister()
        for name, topic in wanted.items():
            if name in self._open:
                continue
            self._open[name] = (
                topic,
                rospy.Subscriber(
                    name, topic.message_type, topic.callback, queue_size=10, tcp_nodelay=True
                ),
            )
            if self._changed.wait(PAUSE_S):
                return  # something else is wanted by now
