"""Waits until everything that a node needs is there, and names what is not."""

from __future__ import annotations

import socket
import time
from dataclasses import dataclass
from typing import Callable, List, Optional, Sequence

import rosgraph
import rospy

WARN_EVERY_S = 10.0
POLL_S = 0.1
ALIVE_WITHIN_S = 1.0


@dataclass(frozen=True)
class Need:
    """Something to wait for; ``missing`` says what is there instead once it is looked for."""

    is_there: Callable[[], bool]
    missing: Callable[[], str]


def wait_for(needs: Sequence[Need], timeout_s: float) -> List[str]:
    """What is still missing after ``timeout_s`` of wall time, a sentence each.

    Names it in the log every ten seconds meanwhile. Wall time, because the
    simulated clock may not have started. Ends early when the node shuts down.
    """
    start_s = time.monotonic()
    warn_s = start_s + WARN_EVERY_S
    while True:
        absent = [need for need in needs if not need.is_there()]
        now_s = time.monotonic()
        if not absent:
            return []
        if now_s - start_s >= timeout_s or rospy.is_shutdown():
            return [need.missing() for need in absent]
        if now_s >= warn_s:
            warn_s = now_s + WARN_EVERY_S
            rospy.logwarn(
                "waiting for %.0f s:\n  %s",
                now_s - start_s,
                "\n  ".join(need.missing() for need in absent),
            )
        time.sleep(POLL_S)


def service_is_there(name: str) -> bool:
    return name in _providers(2)


def why_gone(service: str, node: str) -> str:
    """That the master or the node that served something has died; "" when both live."""
    try:
        address = rosgraph.Master(rospy.get_name()).lookupService(service)
    except rosgraph.MasterError:
        return f"the {node} is gone"
    except OSError:
        return "the ROS master has died"
    try:
        socket.create_connection(rospy.core.parse_rosrpc_uri(address), ALIVE_WITHIN_S).close()
    except OSError:
        return f"the {node} has died"
    return ""


def missing_service(name: str) -> str:
    there = _near(name, _providers(2))
    return f"{name}: no node serves it; {there or 'there is no service like it'}"


def missing_topic(name: str, message_type: str) -> str:
    """Why nothing has come on a topic."""
    kinds = dict(rospy.get_published_topics())
    if name not in kinds:
        alike = sorted(topic for topic, kind in kinds.items() if kind == message_type)
        there = (
            f"of this type there is {', '.join(alike)}"
            if alike
            else "no topic of this type is published"
        )
        return f"{name} [{message_type}]: no node publishes it; {there}"
    if kinds[name] != message_type:
        return f"{name}: is published as {kinds[name]}; expected {message_type}"
    return f"{name} [{message_type}]: is published, but nothing has come on it yet"


def missing_subscriber(name: str) -> str:
    """Why nobody would hear what is published on a topic."""
    listeners = _providers(1)
    if name in listeners:
        return f"{name}: a node listens to it, but has not connected yet"
    there = _near(name, listeners)
    return f"{name}: no navigator listens to it; {there or 'nor to any topic like it'}"


def _providers(kind: int) -> List[str]:
    """Names of the published (0) or subscribed (1) topics or of the services (2) of the system."""
    return [name for name, _ in rosgraph.Master(rospy.get_name()).getSystemState()[kind]]


def _near(name: str, names: Sequence[str]) -> Optional[str]:
    """The names beside one in its namespace."""
    folder = name.rsplit("/", 1)[0] + "/"
    beside = sorted(other for other in names if other.startswith(folder) and other != name)
    return f"there is {', '.join(beside)}" if beside and folder != "/" else None
