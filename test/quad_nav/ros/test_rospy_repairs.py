"""What is mended in rospy: one connection to a publisher, one source of the time."""

from __future__ import annotations

import contextlib
import socket
import threading
from types import SimpleNamespace
from unittest import mock
from xmlrpc.server import SimpleXMLRPCServer

import pytest

rospy = pytest.importorskip("rospy")

import rosgraph  # noqa: E402
from ros.fake_ros import FakeRos, FakeSubscriber, FakeWall, subscribed  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from rospy.impl import simtime  # noqa: E402
from rospy.impl.masterslave import ROSHandler  # noqa: E402

from quad_nav.ros.common import rospy_repairs  # noqa: E402
from quad_nav.ros.common.rospy_repairs import ClockSource, publishers_of  # noqa: E402


@pytest.fixture
def ros():
    with FakeRos("/sequencer") as fake:
        yield fake


class Heard:
    """The clock of a node."""

    def __init__(self, wall):
        self._wall = wall
        self._topic = FakeSubscriber("/clock", Clock, ClockSource())

    def after(self, sender, now_s):
        """The time of the node after a message."""
        self._wall.now_s += 1.0
        self._topic.receive(Clock(rospy.Time.from_sec(now_s)), sender)
        return rospy.get_time()


@pytest.fixture
def heard(ros, monkeypatch):
    wall = FakeWall()
    monkeypatch.setattr(rospy_repairs, "time", wall)
    return Heard(wall)


@pytest.mark.parametrize(
    ("registered", "messages"),  # sender, its time, time of the node
    [
        (["/simulator", "/player"], [("/simulator", 5.0, 5.0), ("/player", 1e9, 5.0)]),
        (["/simulator", "/player"], [("/player", 9.0, 9.0), ("/simulator", 5.0, 5.0)]),
        (["/player", "/simulator"], [("/simulator", 5.0, 5.0)]),  # the other one is silent
        (None, [("/simulator", 5.0, 5.0), ("/player", 7.0, 5.0), ("/simulator", 5.5, 5.5)]),
    ],
    ids=["first", "hears the later one first", "silent", "no ROS master"],
)
def test_one_publisher_sets_the_clock(heard, monkeypatch, registered, messages):
    ask = mock.Mock(side_effect=ConnectionRefusedError if registered is None else None)
    ask.return_value = registered
    monkeypatch.setattr(rospy_repairs, "publishers_of", ask)
    for sender, sent_s, now_s in messages:
        assert heard.after(sender, sent_s) == now_s


def test_another_one_is_named_and_counts_when_the_first_is_gone(ros, heard, monkeypatch):
    names = ["/simulator", "/player"]
    monkeypatch.setattr(rospy_repairs, "publishers_of", lambda _: list(names))
    heard.after("/simulator", 5.0)
    for _ in range(2):
        assert heard.after("/player", 7.0) == 5.0
    (line,) = ros.log.lines
    assert line.startswith("/clock: time of /player dropped: /simulator sets the clock")
    del names[0]
    assert heard.after("/player", 7.0) == 7.0


@pytest.mark.parametrize(
    ("use_sim_time", "hears_clock", "heard"),
    [(True, True, ["/clock"]), (True, False, []), (False, True, [])],
)
def test_a_node_hears_the_clock_if_it_has_one(ros, monkeypatch, use_sim_time, hears_clock, heard):
    monkeypatch.setattr(simtime, "init_simtime", simtime.init_simtime)
    monkeypatch.setattr(simtime, "_is_use_simtime", lambda: use_sim_time)
    rospy_repairs.hear_one_clock(hears_clock)
    assert simtime.init_simtime()  # as rospy.init_node does
    assert list(subscribed()) == heard
    assert rospy.get_time() == (0.0 if use_sim_time else 1.0)


@pytest.fixture
def master(monkeypatch):
    """A ROS master that knows of publishers of `/clock` that live, were killed or have gone."""
    with contextlib.ExitStack() as stack:
        ports = {}
        for name in ("/player", "/simulator"):
            server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
            server.register_function(lambda _: (1, "", 42), "getPid")
            threading.Thread(target=server.serve_forever, args=(0.05,)).start()
            stack.callback(server.server_close)
            stack.callback(server.shutdown)
            ports[name] = server.server_address[1]
        for name in ("/killed", "/stopped"):
            waiting = stack.enter_context(socket.socket())
            waiting.bind(("127.0.0.1", 0))
            ports[name] = waiting.getsockname()[1]
            if name == "/stopped":
                waiting.listen()
        state = [
            [["/clock", ["/killed", "/player", "/gone", "/simulator"]], ["/tf", ["/other"]]],
            [],
            [["/simulation/start", ["/simulator"]], ["/a/start", ["/killed"]]],
        ]
        monkeypatch.setattr(rosgraph.Master, "getSystemState", lambda _: state)

        def look_up(_, name):
            if name not in ports:
                raise rosgraph.MasterError("unknown node")
            return f"http://127.0.0.1:{ports[name]}/"

        monkeypatch.setattr(rosgraph.Master, "lookupNode", look_up)
        yield


def test_publishers_are_alive_and_simulators_come_first(master):
    assert publishers_of("/clock") == ["/simulator", "/player"]
    assert publishers_of("/odom0") == []


@pytest.mark.parametrize(
    ("name", "is_simulator", "argv", "other"),
    [
        ("player", False, [], "/player"),
        ("sequencer", False, ["__name:=player"], "/player"),
        ("stopped", False, [], "/stopped"),
        ("player", False, ["__ns:=/lab"], ""),
        ("killed", False, [], ""),
        ("gone", False, [], ""),
        ("sequencer", True, [], "/simulator"),
        ("sequencer", True, ["/simulation/start:=/a/start"], ""),
    ],
)
def test_a_node_that_runs_already_is_not_started_again(
    master, monkeypatch, capsys, name, is_simulator, argv, other
):
    monkeypatch.setattr(rospy_repairs, "_SHUTDOWN_S", 0.0)
    monkeypatch.setattr("sys.argv", ["node", *argv])
    with pytest.raises(SystemExit) if other else contextlib.nullcontext():
        rospy_repairs.refuse_second(name, is_simulator)
    assert capsys.readouterr().err.count(f"not started: {other} runs already") == bool(other)


def test_two_threads_do_not_connect_to_one_publisher_at_the_same_time(monkeypatch):
    entered, go_on = [], threading.Event()

    def connect(_, topic, publisher):
        entered.append((topic, publisher))
        if topic == "/tf":
            assert go_on.wait(30.0)
        return 1, "", 0

    monkeypatch.setattr(rospy_repairs, "_connect_topic", connect)
    monkeypatch.setattr(ROSHandler, "_connect_topic", connect)
    rospy_repairs.connect_once()
    threads = [
        threading.Thread(target=ROSHandler._connect_topic, args=(None, "/tf", "http://a/"))
        for _ in range(2)
    ]
    for thread in threads:
        thread.start()
    threads[1].join(0.2)  # it ends in no case
    assert entered == [("/tf", "http://a/")]
    assert ROSHandler._connect_topic(None, "/clock", "http://a/") == (1, "", 0)
    go_on.set()
    for thread in threads:
        thread.join()
    assert entered.count(("/tf", "http://a/")) == 2


def test_fifty_nodes_connect_while_one_accepts_none(monkeypatch):
    with contextlib.ExitStack() as opened:
        waiting = opened.enter_context(socket.socket())
        waiting.bind(("127.0.0.1", 0))
        waiting.listen(5)  # as rospy
        server = SimpleNamespace(
            start_server=lambda: None, tcp_ros_server=SimpleNamespace(server_sock=waiting)
        )
        monkeypatch.setattr(rospy_repairs, "init_tcpros_server", lambda: server)
        rospy_repairs.accept_many_connections()
        for _ in range(50):
            address = waiting.getsockname()
            opened.enter_context(socket.create_connection(address, timeout=0.9))


def test_an_alarm_ends_a_sleep(ros):
    """The sleep of a stopped clock; the next one is over with its time."""
    alarm = rospy_repairs.Alarm()
    sleeper = threading.Thread(target=alarm.sleep, args=(1000.0,))
    sleeper.start()
    alarm.set()
    sleeper.join(10.0)
    assert not sleeper.is_alive()
    alarm.set()
    alarm.sleep(1000.0)  # it was set before
    sleeper = threading.Thread(target=alarm.sleep, args=(0.5,))
    sleeper.start()
    now_s = 1.0
    while sleeper.is_alive():
        now_s += 0.1
        ros.set_time(now_s)
        sleeper.join(0.01)
