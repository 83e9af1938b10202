"""What rospy gets wrong or offers no public way for, mended in one place.

* It connects twice to a publisher of which it hears twice at the same time. The connection that it
  drops is a warning in the publisher's log: "Inbound TCP/IP connection failed".
* It lets five connections wait. Linux drops further ones, and their nodes try again after 1 s:
  until then a navigator that has just started does not hear the clock.
* It takes the time from every publisher of `/clock`: with two the time jumps to and fro. It tells
  sleeping threads by a name that Python 3.10 has deprecated, and each call makes a warning.
* It registers once. A ROS master that is started again does not know the node: nobody finds its
  services, and new nodes do not connect to its topics. Those that are connected stay so.
* Each log call reads a parameter, and asks the master for it as long as it is not set.
* Its services always say something when they refuse; those of roscpp send an empty text.
* It connects a subscriber to publishers of its own process too, through a socket.
* It has no public way to set the time, to add a callback to a subscriber, to ask whether a
  publisher reaches a node, to send bytes, to read from which node and topic a message came, and to
  end a sleep.

No other file touches what is private in rospy.
"""

from __future__ import annotations

import contextlib
import socket
import sys
import threading
import time
from http.client import HTTPException
from typing import Any, Callable, Dict, List, Tuple
from xmlrpc.client import Error as XmlRpcError
from xmlrpc.client import ServerProxy, Transport

import rosgraph
import rosgraph.names
import rosgraph.network
import rospy
from rosgraph_msgs.msg import Clock
from rospy.impl import simtime
from rospy.impl.masterslave import ROSHandler
from rospy.impl.paramserver import get_param_server_cache
from rospy.impl.registration import get_service_manager, get_topic_manager
from rospy.impl.tcpros_base import init_tcpros_server
from rospy.topics import _SubscriberImpl

from quad_nav.errors import excerpt, printable
from quad_nav.ros.common.diagnostics import ThrottledWarnings

_WAITING_CONNECTIONS = 128
_ANSWERS_WITHIN_S = 1.0  # wall time, as the following ones
_ASK_AGAIN_S = 1.0
_SHUTDOWN_S = 2.0
_POLL_S = 0.1
_WATCH_S = 2.0
_REFUSED_WITHOUT_TEXT = "service cannot process request: "
_START_SERVICE = "/simulation/start"
_ROSOUT_PARAMETER = "/rosout_disable_topics_generation"
_connect_topic: Callable[..., Tuple[int, str, int]] = ROSHandler._connect_topic


def connect_once() -> None:
    """Let no two threads connect to the same topic of a publisher at the same time.

    Call it before `rospy.init_node`, which subscribes to `/clock`.
    """
    locks: Dict[Tuple[str, str], threading.Lock] = {}

    def connect(handler: Any, topic: str, publisher: str) -> Tuple[int, str, int]:
        with locks.setdefault((topic, publisher), threading.Lock()):
            return _connect_topic(handler, topic, publisher)

    ROSHandler._connect_topic = connect


def ignore_publishers(is_ignored: Callable[[str, str], bool]) -> None:
    """Let no subscriber of this process connect to some publishers.

    Args:
        is_ignored: Called with the name of a topic and the address of a node that publishes it.
    """
    is_connected = _SubscriberImpl.has_connection

    def has_connection(subscriber: Any, address: str) -> bool:
        return is_connected(subscriber, address) or is_ignored(subscriber.resolved_name, address)

    _SubscriberImpl.has_connection = has_connection


def ignore_own_publisher(subscriber: rospy.Subscriber) -> None:
    """Let a subscriber not connect to a publisher of this process that is made after it."""
    is_connected = subscriber.impl.has_connection
    own = rospy.get_node_uri()
    subscriber.impl.has_connection = lambda address: address == own or is_connected(address)


def sender_of(message: Any) -> str:
    """Return the name of the node that sent a message; "" if its connection does not say."""
    return str(message._connection_header.get("callerid", ""))


def topic_of(message: Any) -> str:
    """Return the name of the topic from which a message came; "" if it is not known."""
    return str(message._connection_header.get("topic", ""))


def serialised(data: bytes) -> rospy.AnyMsg:
    """Return a message that is sent as these bytes."""
    message = rospy.AnyMsg()
    message._buff = data
    return message


def is_registered(subscriber: rospy.Subscriber) -> bool:
    """Return whether a subscriber has not unregistered."""
    return subscriber.impl is not None


def hear_first(subscriber: rospy.Subscriber, on_first: Callable[[], object]) -> None:
    """Call a function with the first message of a subscriber, beside its own callback."""

    def on_message(_: Any) -> None:
        # The threads of two publishers can both have a first message.
        with contextlib.suppress(KeyError):
            if is_registered(subscriber):
                subscriber.impl.remove_callback(on_message, None)
        on_first()

    subscriber.impl.add_callback(on_message, None)


def reaches(publisher: rospy.Publisher, node: str) -> bool:
    """Return whether a node has connected to a publisher."""
    return bool(publisher.impl.has_connection(node))


def refuse_without_text(service: rospy.Service) -> None:
    """Let a service that raises ``rospy.ServiceException("")`` refuse as roscpp's do."""

    def write(transport: Any, text: str) -> None:
        if text == _REFUSED_WITHOUT_TEXT:
            text = ""
        type(service)._write_service_error(service, transport, text)

    service._write_service_error = write


def accept_many_connections() -> None:
    """Let more nodes connect to this one at the same time."""
    server = init_tcpros_server()
    server.start_server()
    server.tcp_ros_server.server_sock.listen(_WAITING_CONNECTIONS)


def log_without_master() -> None:
    """Let log calls return at once while the ROS master hangs.

    rospy does not cache that the parameter is missing. This puts its default into the cache.
    """
    if rospy.get_param_cached(_ROSOUT_PARAMETER, None) is None:
        get_param_server_cache().set(_ROSOUT_PARAMETER, False)


def register_again() -> None:
    """Watch the ROS master, and register this node with another one that has taken its place."""
    threading.Thread(target=_watch_master, name="master", daemon=True).start()


def _watch_master() -> None:
    while not rospy.core.is_shutdown_requested():
        master = rosgraph.Master(rospy.get_name())
        try:
            _register_if_unknown(master)
        except (OSError, HTTPException, rosgraph.MasterException):
            pass  # it has died; another one may come
        time.sleep(_WATCH_S)


def _register_if_unknown(master: rosgraph.Master) -> None:
    try:
        master.lookupNode(rospy.get_name())
        return
    except rosgraph.MasterError:
        if rospy.core.is_shutdown_requested():
            return
    node, topics = rospy.get_node_uri(), get_topic_manager()
    for topic, kind in topics.get_publications():
        master.registerPublisher(topic, kind, node)
    for service, address in get_service_manager().get_services():
        master.registerService(service, address, node)
    for topic, kind in topics.get_subscriptions():
        publishers = master.registerSubscriber(topic, kind, node)
        ServerProxy(node).publisherUpdate("/master", topic, publishers)
    rospy.logwarn("%s: registered again: the ROS master was restarted", rospy.get_name())


class Alarm:
    """A sleep by ROS's time that another thread may end."""

    def __init__(self) -> None:
        self._is_set = threading.Event()

    def set(self) -> None:
        """End the sleep that goes on, or else the next one."""
        self._is_set.set()
        condition = rospy.rostime.get_rostime_cond()
        with condition:
            condition.notify_all()

    def sleep(self, seconds: float) -> None:
        """Sleep until the time is over, the alarm is set, the clock jumps back or ROS ends."""
        begin_s, condition = rospy.get_time(), rospy.rostime.get_rostime_cond()
        patience_s = seconds if rospy.rostime.is_wallclock() else _POLL_S

        def is_over() -> bool:
            slept_s = rospy.get_time() - begin_s
            return self._is_set.is_set() or not 0.0 <= slept_s < seconds

        with condition:
            while not rospy.is_shutdown() and not condition.wait_for(is_over, patience_s):
                pass
        self._is_set.clear()


def set_time(now: rospy.Time) -> None:
    """Set the time of this node, unless it has the time of the system."""
    if rospy.rostime.is_wallclock():
        return
    condition = rospy.rostime.get_rostime_cond()
    with condition:
        rospy.rostime._rostime_current = rospy.Time(now.secs, now.nsecs)
        condition.notify_all()


def hear_one_clock(hears_clock: bool) -> None:
    """Let this node take the time from one publisher of `/clock`, or set its time itself.

    Call it before `rospy.init_node`. A node that subscribes to the clock and leaves it at once is a
    warning in the simulator's log, like a connection that is dropped.

    Args:
        hears_clock: False if the node sets its time itself.
    """

    def init_simtime() -> bool:
        if simtime._is_use_simtime():
            rospy.rostime._set_rostime(rospy.Time())
            if hears_clock:
                source = ClockSource(rospy.resolve_name("/clock"))
                rospy.Subscriber("/clock", Clock, source, queue_size=1)
        rospy.rostime.set_rostime_initialized(True)
        return True

    simtime.init_simtime = init_simtime


class ClockSource:
    """Take the time from one publisher of a clock, and name the others.

    All nodes choose the same one: the simulator, else the one that has registered first. Another
    one counts when that is gone.
    """

    def __init__(self, topic: str = "/clock") -> None:
        """Wait for the first message; `topic` is the resolved name."""
        self._topic, self._warnings = topic, ThrottledWarnings()
        self._node = ""  # that sets the time
        self._ask_s: Dict[str, float] = {}  # wall time of the next question about each sender

    def __call__(self, message: Clock) -> None:
        """Set the time of this node, if the message is one of the publisher that counts."""
        sender = sender_of(message)
        if sender != self._node and time.monotonic() >= self._ask_s.get(sender, 0.0):
            self._choose(sender)
        if sender == self._node:
            set_time(message.clock)

    def _choose(self, sender: str) -> None:
        self._ask_s[sender] = time.monotonic() + _ASK_AGAIN_S
        try:
            names = [name for name in publishers_of(self._topic) if name in self._ask_s]
        except (OSError, rosgraph.MasterException):  # the ROS master has died
            names = []
        self._node = next(iter(names), self._node or sender)
        if sender != self._node:
            self._warnings.warn(
                f"{self._topic}: time of {excerpt(sender)} dropped: {self._node} sets the clock,"
                " expected one publisher; stop one of them"
            )


def publishers_of(topic: str) -> List[str]:
    """Return the nodes that publish a topic and are alive: a simulator, then as they registered.

    Raises:
        OSError: The ROS master cannot be reached.
        MasterException: It refuses to answer.
    """
    master = rosgraph.Master(rospy.get_name())
    publishers, _, services = master.getSystemState()
    simulators = dict(services).get(_START_SERVICE, [])
    names = sorted(dict(publishers).get(topic, []), key=lambda name: name not in simulators)
    return [name for name in names if _is_alive(master, name)]


def refuse_second(name: str, is_simulator: bool = False) -> None:
    """End this process with exit status 2 if the node that it would be runs already.

    To register would end the other one, which may fly. It has a while to shut down.

    Args:
        name: Name of the node, unless the command line has another one.
        is_simulator: Whether there can be one such node only, whatever its name.
    """
    mappings = rosgraph.names.load_mappings(sys.argv)
    namespace = rosgraph.names.get_ros_namespace(argv=sys.argv)
    node = rosgraph.names.ns_join(namespace, mappings.get("__name", name))
    service = mappings.get(_START_SERVICE, _START_SERVICE) if is_simulator else ""
    end_s = time.monotonic() + _SHUTDOWN_S
    while True:
        others = _others(node, service)
        if not others:
            return
        if time.monotonic() >= end_s:
            break
        time.sleep(_POLL_S)
    print(
        f"{printable(node)}: not started: {printable(others[0])} runs already; stop it, or start"
        " this flight with a ROS master of its own: roslaunch -p PORT",
        file=sys.stderr,
    )
    raise SystemExit(2)


def _others(node: str, service: str) -> List[str]:
    master = rosgraph.Master(rospy.get_name())
    try:
        providers = dict(master.getSystemState()[2]).get(service, [])
    except (OSError, rosgraph.MasterException):  # rospy waits for the ROS master
        return []
    return [name for name in (node, *providers) if _is_alive(master, name)]


class _Transport(Transport):
    """Connections to nodes, which may hang."""

    def make_connection(self, host: Any) -> Any:
        """Return a connection that waits for an answer for a limited time."""
        connection = super().make_connection(host)
        connection.timeout = _ANSWERS_WITHIN_S
        return connection


def _is_alive(master: rosgraph.Master, node: str) -> bool:
    """Return whether a registered node lives, perhaps stopped; a killed one stays registered."""
    try:
        uri = master.lookupNode(node)
        address = rosgraph.network.parse_http_host_and_port(uri)
        socket.create_connection(address, _ANSWERS_WITHIN_S).close()
    except (OSError, ValueError, rosgraph.MasterException):
        return False  # nor is one on a machine that does not respond
    try:
        ServerProxy(uri, _Transport()).getPid(rospy.get_name())
    except socket.timeout:
        return True
    except (OSError, HTTPException, XmlRpcError):
        return False
    return True
