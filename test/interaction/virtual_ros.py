"""ROS in one process on a virtual clock: nodes run unchanged, and may be killed and started again.

A message reaches its subscribers before `publish` returns. A service runs as a task of the node
that offers it. Nothing that a node has sent is lost when it is killed, and parameters stay.
"""

from __future__ import annotations

import collections
import contextlib
import io
import logging
import math
from unittest import mock

import rospy
from interaction.virtual_threads import Condition, VirtualThreads
from rosgraph import masterapi
from rospy.msg import args_kwds_to_message

from quad_nav.ros.common import readiness

PACKAGES = ("quad_nav", "quad_localization", "quad_vehicles", "actionlib", "dynamic_reconfigure")


class Node:
    """A process: what it has registered, and whether it lives."""

    def __init__(self, name):
        self.name, self.is_alive, self.is_shutdown = name, True, False
        self.ends = []  # its publishers, subscribers and services


class Graph:
    """Topics, services and parameters of all nodes.

    Attributes:
        threads: What runs the nodes.
        nodes: Those that live.
        parameters: Values by name.
        log: (time, node, level, text) of all lines; the time is that of `threads`.
        failures: Exceptions of callbacks, which rospy only logs.
    """

    def __init__(self, clock):
        """Start without nodes.

        Args:
            clock: Returns ROS's time, a `rospy.Time`.
        """
        self.threads = VirtualThreads()
        self.nodes, self.parameters, self.log, self.failures = [], {}, [], []
        self._clock = clock
        self.topics = collections.defaultdict(lambda: ([], []))  # publishers, subscribers
        self.services = {}
        self._test = self.threads.node = Node("/test")

    @property
    def node(self):
        """The node whose code runs."""
        return self.threads.node

    @contextlib.contextmanager
    def running(self):
        """Put this graph in rospy's place; at the end its nodes are killed."""
        with contextlib.ExitStack() as stack:
            stack.enter_context(self.threads.patch(*PACKAGES))
            for owner, patches in self._patches():
                for name, value in patches.items():
                    stack.enter_context(mock.patch.object(owner, name, value))
            stack.enter_context(self._logging())
            try:
                yield self
            finally:
                for node in list(self.nodes):
                    self.kill(node)

    def _patches(self):
        kinds = (Publisher, Subscriber, Service, ServiceProxy)
        of_rospy = {kind.__name__: type(kind.__name__, (kind,), {"graph": self}) for kind in kinds}
        of_rospy.update(
            sleep=self._sleep,
            wait_for_service=self._wait_for_service,
            get_param=self.parameters.get,
            has_param=self.parameters.__contains__,
            search_param=lambda _: None,
            set_param=self.parameters.__setitem__,
            is_shutdown=lambda: self.node.is_shutdown,
            on_shutdown=lambda _: None,
            signal_shutdown=lambda _: setattr(self.node, "is_shutdown", True),
            get_name=lambda: self.node.name,
            resolve_name=self.resolve,
            remap_name=str,
            get_published_topics=lambda: [],
            get_rostime=self._clock,
            get_time=lambda: self._clock().to_sec(),
            Timer=mock.MagicMock(),
        )
        yield rospy, of_rospy
        condition = type("Condition", (Condition,), {"threads": self.threads})()
        yield (
            rospy.rostime,
            {
                "wallsleep": self.threads.sleep,
                "get_rostime": self._clock,
                "get_rostime_cond": lambda: condition,
            },
        )
        yield (
            masterapi.Master,
            {
                "lookupService": mock.Mock(side_effect=masterapi.Error),
                "getSystemState": lambda _: self._system_state(),
            },
        )

    @contextlib.contextmanager
    def _logging(self):
        logger = logging.getLogger("rosout")
        before = logger.handlers, logger.propagate, list(logger.filters), logger.level
        logger.handlers, logger.propagate = [_Lines(self)], False
        readiness.escape_log_messages()
        logger.setLevel(logging.INFO)
        yield
        logger.handlers, logger.propagate, logger.filters = before[:3]
        logger.setLevel(before[3])

    # Nodes.

    def start(self, name, main):
        """Start a node, which runs a function; return it."""
        node = Node(name)
        self.nodes.append(node)
        self.threads.start(main, node)
        return node

    def kill(self, node):
        """Kill a node at once, as SIGKILL does."""
        node.is_alive, node.is_shutdown = False, True
        self.nodes.remove(node)
        for end in list(node.ends):
            end.close()
        self.threads.kill(node)

    @contextlib.contextmanager
    def acting(self, node):
        """Let code run as that of a node."""
        before, self.threads.node = self.threads.node, node
        try:
            yield
        finally:
            self.threads.node = before

    def run(self, seconds, until=lambda: False):
        """Let the nodes run for a time, or until something becomes true."""
        return self.threads.wait(until, seconds)

    def _system_state(self):
        """Return what the ROS master tells: published and subscribed topics, and services."""
        kinds = [{name: ends[kind] for name, ends in self.topics.items()} for kind in (0, 1)]
        kinds.append({name: [service] for name, service in self.services.items()})
        return [
            [(name, [end.node.name for end in ends]) for name, ends in found.items() if ends]
            for found in kinds
        ]

    def _sleep(self, duration):
        seconds = duration.to_sec() if isinstance(duration, rospy.Duration) else duration
        begin_s = rospy.get_time()
        self.threads.wait(lambda: not 0.0 <= rospy.get_time() - begin_s < seconds - 1e-9)
        if rospy.get_time() < begin_s:
            raise rospy.exceptions.ROSTimeMovedBackwardsException(begin_s - rospy.get_time())

    def resolve(self, name, _=None):
        """Return the whole name of a topic, service or parameter."""
        if name.startswith("~"):
            return f"{self.node.name}/{name[1:]}"
        return name if name.startswith("/") else f"/{name}"

    # Topics and services.

    def publish(self, topic, message, node=None):
        """Send a message, by default from the test."""
        for subscriber in list(self.topics[topic][1]):
            types = {subscriber.data_class._md5sum, message._md5sum}
            if len(types) == 1 or "*" in types:  # costmaps have two topics of one name
                subscriber.receive(message, (node or self._test).name)

    def call(self, name, request=None):
        """Call a service and wait for its response.

        Raises:
            ServiceException: No node offers it, or its node dies or fails.
        """
        if name not in self.services:
            raise rospy.ServiceException(f"service [{name}] unavailable")
        service, response = self.services[name], []

        def handle():
            response.append(service.handler(request or service.service_class._request_class()))

        task = self.threads.start(handle, service.node)
        self.threads.wait(lambda: task.dead or not service.node.is_alive)
        if not response:
            raise rospy.ServiceException(f"service [{name}] responded with an error")
        return response[0]

    def _wait_for_service(self, name, timeout=None):
        name, patience_s = self.resolve(name), math.inf if timeout is None else timeout
        if not self.threads.wait(lambda: name in self.services, patience_s):
            raise rospy.ROSException(f"timeout exceeded while waiting for service {name}")


class Publisher:
    """`rospy.Publisher`."""

    graph = None

    def __init__(self, name, data_class, subscriber_listener=None, latch=False, **_):
        self.resolved_name, self.data_class = self.graph.resolve(name), data_class
        self.type, self.impl = data_class._type, self
        self.node, self._listener = self.graph.node, subscriber_listener
        self._is_latched, self._last = latch, None
        self._publishers, self._subscribers = self.graph.topics[self.resolved_name]
        self._publishers.append(self)
        self.node.ends.append(self)
        for subscriber in self._subscribers:
            self.connect(subscriber)

    def connect(self, subscriber):
        """Serve a subscriber that has just connected."""

        def send(message):
            subscriber.receive(message, self.node.name)

        if self._last is not None:
            self.graph.threads.start(lambda: send(self._last), subscriber.node)
        if self._listener is not None:
            with self.graph.acting(self.node):
                self._listener.peer_subscribe(self.resolved_name, self.publish, send)

    def publish(self, *args, **kwds):
        if self._subscribers or self._is_latched:
            message = args_kwds_to_message(self.data_class, args, kwds)
            self._last = message if self._is_latched else None
            self.graph.publish(self.resolved_name, message, self.node)

    def get_num_connections(self):
        return len(self._subscribers)

    def has_connection(self, _):
        return True

    def close(self):
        self._publishers.remove(self)
        self.node.ends.remove(self)

    unregister = close


class Subscriber:
    """`rospy.Subscriber`."""

    graph = None

    def __init__(self, name, data_class, callback=None, callback_args=None, **_):
        self.resolved_name = self.graph.resolve(name)
        self.data_class, self.type = data_class, data_class._type
        self.node, self.impl = self.graph.node, self
        self._callbacks = [] if callback is None else [(callback, callback_args)]
        self._publishers, self._subscribers = self.graph.topics[self.resolved_name]
        self._subscribers.append(self)
        self.node.ends.append(self)
        for publisher in self._publishers:
            publisher.connect(self)

    def get_num_connections(self):
        return len(self._publishers)

    def has_connection(self, _):
        return True

    def add_callback(self, callback, args):
        self._callbacks.append((callback, args))

    def remove_callback(self, callback, args):
        self._callbacks.remove((callback, args))

    def receive(self, message, sender):
        """Call the callbacks with a message of the subscriber's own type."""
        if self.impl is None:
            return
        if not isinstance(message, self.data_class):
            buffer = io.BytesIO()
            message.serialize(buffer)
            message = self.data_class().deserialize(buffer.getvalue())
        message._connection_header = {"callerid": sender}
        with self.graph.acting(self.node):
            for callback, args in list(self._callbacks):
                try:
                    callback(message) if args is None else callback(message, args)
                except Exception as error:
                    self.graph.failures.append(f"{self.resolved_name}: {error!r}")

    def close(self):
        self._subscribers.remove(self)
        self.node.ends.remove(self)
        self.impl = None

    unregister = close


class Service:
    """`rospy.Service`."""

    graph = None

    def __init__(self, name, service_class, handler, **_):
        self.resolved_name, self.node = self.graph.resolve(name), self.graph.node
        self.service_class, self.handler = service_class, handler
        self.graph.services[self.resolved_name] = self
        self.node.ends.append(self)

    def close(self):
        if self.graph.services.get(self.resolved_name) is self:
            del self.graph.services[self.resolved_name]
        self.node.ends.remove(self)

    def shutdown(self, _=""):
        self.close()


class ServiceProxy:
    """`rospy.ServiceProxy`."""

    graph = None

    def __init__(self, name, service_class, **_):
        self._name, self._class = self.graph.resolve(name), service_class

    def __call__(self, *args, **kwds):
        request = args_kwds_to_message(self._class._request_class, args, kwds)
        return self.graph.call(self._name, request)


class _Lines(logging.Handler):
    """Keeps the lines that are logged, with the node that logs them."""

    def __init__(self, graph):
        super().__init__()
        self._graph = graph

    def emit(self, record):
        threads = self._graph.threads
        line = threads.now_s, threads.node.name, record.levelname, record.getMessage()
        self._graph.log.append(line)
