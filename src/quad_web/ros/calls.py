"""Call services and wait for what comes of it, but never longer than a person waits."""

from __future__ import annotations

import queue
import threading
from typing import Any, Callable, List, Sequence, Tuple, TypeVar

import rosgraph
import rospy
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest

from quad_nav.errors import QuadError

PATIENCE_S = 3.0  # wall time

T = TypeVar("T")


class CallFailed(QuadError):
    """A node did not do what it was asked to; the text says why."""


def in_threads(functions: Sequence[Callable[[], T]], patience_s: float = PATIENCE_S) -> List[T]:
    """Call functions at the same time and return their results.

    Threads that hang are left behind; they do not keep the node from ending.

    Raises:
        CallFailed: If one raises it, or takes longer than the patience.
    """
    results: List[queue.SimpleQueue[Tuple[bool, Any]]] = [queue.SimpleQueue() for _ in functions]

    def run(function: Callable[[], T], result: queue.SimpleQueue[Tuple[bool, Any]]) -> None:
        try:
            result.put((True, function()))
        except CallFailed as error:
            result.put((False, error))
        except Exception as error:  # raised where the result is waited for
            result.put((False, CallFailed(f"{type(error).__name__}: {error}")))

    for function, result in zip(functions, results):
        threading.Thread(target=run, args=(function, result), daemon=True).start()
    values = []
    for result in results:
        try:
            is_value, value = result.get(timeout=patience_s)
        except queue.Empty:
            raise CallFailed(f"no response within {patience_s:g} s") from None
        if not is_value:
            raise value
        values.append(value)
    return values


def call(name: str, service_type: Any, request: Any = None, patience_s: float = PATIENCE_S) -> Any:
    """Call a service and return its response.

    Raises:
        CallFailed: If no node provides it, it fails, or it does not respond in time.
    """

    def ask() -> Any:
        try:
            rosgraph.Master(rospy.get_name()).lookupService(name)
        except rosgraph.MasterError:
            raise CallFailed(f"{name}: no node provides this service") from None
        except OSError as error:
            raise CallFailed(f"the ROS master does not respond: {error}") from error
        proxy = rospy.ServiceProxy(name, service_type)
        try:
            return proxy() if request is None else proxy(request)
        except (rospy.ServiceException, rospy.ROSException, OSError) as error:
            raise CallFailed(f"{name}: {error}") from error

    try:
        return in_threads([ask], patience_s)[0]
    except CallFailed as error:
        text = str(error)
        raise CallFailed(text if text.startswith(name) else f"{name}: {text}") from error


def set_number(node: str, name: str, value: float) -> float:
    """Set a number by dynamic_reconfigure and return the one that is in force then.

    Raises:
        CallFailed: See `call`.
    """
    request = ReconfigureRequest(Config(doubles=[DoubleParameter(name, value)]))
    response = call(f"{node}/set_parameters", Reconfigure, request)
    return next(one.value for one in response.config.doubles if one.name == name)
