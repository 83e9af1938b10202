"""Start a node: signals, log, connections, and waiting for what it needs."""

from __future__ import annotations

import io
import logging
import signal
import socket
import threading
import time
from types import FrameType
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import rosgraph
import rosgraph.network
import rospy

from quad_nav.errors import QuadError, excerpt, printable
from quad_nav.ros.common.rospy_repairs import (
    accept_many_connections,
    connect_once,
    hear_first,
    hear_one_clock,
    is_registered,
    log_without_master,
    refuse_second,
    register_again,
)

WARN_EVERY_S = 10.0  # wall time, as all durations here
POLL_S = 0.1
ALIVE_WITHIN_S = 1.0
WITHDRAWN_WITHIN_S = 2.0
SILENT_AFTER_S = 3.0
REPEAT_S = 15.0
MAX_LOG = 50_000  # characters of a line and of each of its arguments
_MAX_HEADER = 4096  # bytes


def init_node(
    name: str, at_signal: Callable[[], None] = lambda: None, hears_clock: bool = True
) -> None:
    """Call `rospy.init_node` and let Ctrl-C and SIGTERM shut down from another thread.

    rospy's own handler closes the publishers in the thread that it interrupts. It deadlocks if
    that thread is publishing and holds the lock.

    Args:
        name: Name of the node.
        at_signal: Called in the other thread, before anything is shut down.
        hears_clock: False if the node sets its time itself.
    """
    refuse_second(name)
    start_node(name, hears_clock=hears_clock)

    def shut_down(number: int, _frame: Optional[FrameType]) -> None:
        reason = signal.Signals(number).name

        def run() -> None:
            at_signal()
            rospy.signal_shutdown(reason)

        threading.Thread(target=run, daemon=True).start()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, shut_down)


def start_node(name: str, argv: Optional[Sequence[str]] = None, hears_clock: bool = True) -> None:
    """Call `rospy.init_node` without its handlers of signals, and set up logging and connections.

    Args:
        name: Name of the node.
        argv: Its command line, with remappings; None for that of the process.
        hears_clock: False if the node sets its time itself.
    """
    connect_once()
    hear_one_clock(hears_clock)
    rospy.init_node(name, argv, disable_signals=True)
    accept_many_connections()
    escape_log_messages()
    log_without_master()
    register_again()


def server_parameters() -> Dict[str, Any]:
    """Return the whole tree of the parameter server.

    `rospy.get_param("/")` returns the parameters that rospy has cached, once it has cached one.
    """
    tree: Dict[str, Any] = rosgraph.Master(rospy.get_name()).getParam("/")
    return tree


def escape_log_messages() -> None:
    """Escape what a terminal would obey in all further messages of this node."""
    logging.getLogger("rosout").addFilter(_escape)


def _escape(record: logging.LogRecord) -> bool:
    """Escape and cut a message and its arguments; lists of faults keep their lines."""
    record.msg = excerpt(str(record.msg), MAX_LOG, "\n")
    if isinstance(record.args, tuple):
        record.args = tuple(map(_printable_argument, record.args))
    return True


def _printable_argument(value: object) -> object:
    if isinstance(value, (int, float)):
        return value
    if isinstance(value, QuadError):
        return printable(value, "\n")
    return excerpt(str(value), MAX_LOG)


class Need(NamedTuple):
    """A condition to wait for, and a text that says what is missing and what is there instead."""

    is_met: Callable[[], bool]
    missing: Callable[[], str]


def wait_for(needs: Sequence[Need], timeout_s: float) -> List[str]:
    """Wait until all needs are met, a timeout has passed or the node shuts down.

    Logs the missing ones every ten seconds. The timeout is wall time, because the simulated
    clock may not have started.

    Returns:
        A sentence for each need that is not met.
    """
    start_s = time.monotonic()
    warn_s = start_s + WARN_EVERY_S
    while True:
        absent = [need for need in needs if not need.is_met()]
        now_s = time.monotonic()
        if not absent:
            return []
        if now_s - start_s >= timeout_s or rospy.is_shutdown():
            return [need.missing() for need in absent]
        if now_s >= warn_s:
            warn_s = now_s + WARN_EVERY_S
            rospy.logwarn(
                "still waiting after %.0f s:" + "\n  %s" * len(absent),
                now_s - start_s,
                *(need.missing() for need in absent),
            )
        time.sleep(POLL_S)


class TopicWatch:
    """Log subscribed topics on which no message has ever arrived.

    The times are wall times, because a stopped simulation publishes nothing. `check_clock`
    covers `/clock` itself.
    """

    def __init__(self, subscribers: Sequence[rospy.Subscriber] = ()) -> None:
        """Watch the topics of subscribers; the first check is due after `SILENT_AFTER_S`."""
        self._silent: Dict[str, Tuple[rospy.Subscriber, float]] = {}
        self._next_check_s = time.monotonic() + SILENT_AFTER_S
        for subscriber in subscribers:
            self.add(subscriber)

    def add(self, subscriber: rospy.Subscriber) -> None:
        """Watch the topic of a subscriber too, until it unregisters."""
        name = subscriber.resolved_name
        self._silent[name] = subscriber, time.monotonic()
        hear_first(subscriber, lambda: self._silent.pop(name, None))

    def check_clock(self) -> None:
        """Log that `/clock` has not started."""
        if self._is_due():
            rospy.logwarn(
                "no message on /clock yet and use_sim_time is set; waiting for the simulator"
            )

    def check(self) -> None:
        """Log the topics without a message."""
        if not self._silent or not self._is_due():
            return
        for name, (subscriber, since_s) in list(self._silent.items()):
            if not is_registered(subscriber):
                self._silent.pop(name, None)
            elif time.monotonic() - since_s >= SILENT_AFTER_S:
                rospy.logwarn("%s", missing_topic(name, subscriber.type))

    def _is_due(self) -> bool:
        now_s = time.monotonic()
        if now_s < self._next_check_s:
            return False
        self._next_check_s = now_s + REPEAT_S
        return True


def service_exists(name: str) -> bool:
    """Return whether a node provides a service."""
    return name in _providers(2)


def hears(node: str, topics: Sequence[str]) -> bool:
    """Return whether a node subscribes to one of some topics."""
    subscribed = rosgraph.Master(rospy.get_name()).getSystemState()[1]
    return any(topic in topics and f"/{node}" in nodes for topic, nodes in subscribed)


def lost_service(service: str, node: str) -> str:
    """Say that the ROS master or the node that provides a service has died; "" if neither has.

    A node that shuts down in order withdraws its services from the master, a dead one does not.
    """
    end_s = time.monotonic() + WITHDRAWN_WITHIN_S
    while time.monotonic() < end_s:
        try:
            _probe(service, rosgraph.Master(rospy.get_name()).lookupService(service))
            return ""
        except rosgraph.MasterError:
            return ""
        except (OSError, rosgraph.network.ROSHandshakeException):
            if not _is_master_alive():
                return "the ROS master has died"
            time.sleep(POLL_S)
    return f"the {node} has died"


def _is_master_alive() -> bool:
    try:
        rosgraph.Master(rospy.get_name()).getPid()
    except (OSError, rosgraph.MasterError):
        return False
    return True


def _probe(service: str, address: str) -> None:
    """Exchange the headers of a connection, as a client that only asks for a service's type."""
    server = rospy.core.parse_rosrpc_uri(address)
    with socket.create_connection(server, ALIVE_WITHIN_S) as connection:
        connection.settimeout(ALIVE_WITHIN_S)
        header = {"probe": "1", "md5sum": "*", "callerid": rospy.get_name(), "service": service}
        rosgraph.network.write_ros_handshake_header(connection, header)
        rosgraph.network.read_ros_handshake_header(connection, io.BytesIO(), _MAX_HEADER)


def missing_service(name: str) -> str:
    """Say that no node provides a service, and which ones exist in its namespace."""
    alike = _beside(name, _providers(2))
    return f"{name}: no node provides this service; similar services: {alike}"


def missing_topic(name: str, message_type: str) -> str:
    """Say why no message has arrived on a topic."""
    try:
        types = dict(rospy.get_published_topics())
    except OSError as error:
        return f"{name} [{message_type}]: no message yet, and the ROS master is silent: {error}"
    if name not in types:
        alike = sorted(topic for topic, kind in types.items() if kind == message_type)
        return (
            f"{name} [{message_type}]: no node publishes this topic; topics of this type:"
            f" {', '.join(alike) or 'none'}"
        )
    if types[name] != message_type:
        return f"{name}: published as {types[name]}, expected {message_type}"
    return f"{name} [{message_type}]: published, but no message has arrived yet"


def missing_subscriber(name: str) -> str:
    """Say why a message on a topic would reach no node."""
    subscribed = _providers(1)
    if name in subscribed:
        return f"{name}: a node subscribes to this topic, but has not connected yet"
    alike = _beside(name, subscribed)
    return f"{name}: no navigator subscribes to this topic; similar topics: {alike}"


def _providers(kind: int) -> List[str]:
    """Return all published (0) or subscribed (1) topics or the services (2) of the system."""
    return [name for name, _ in rosgraph.Master(rospy.get_name()).getSystemState()[kind]]


def _beside(name: str, names: Sequence[str]) -> str:
    """List the other names in the namespace of one."""
    folder = name.rsplit("/", 1)[0] + "/"
    others = sorted(other for other in names if other.startswith(folder) and other != name)
    return ", ".join(others) if others and folder != "/" else "none"
