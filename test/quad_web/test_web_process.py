"""Messages between a source and the server in a process of its own."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_web.process import Batch, Call, ServedSource, require_nicegui
from quad_web.view.actions import Actions, Answer
from quad_web.view.message_socket import MessageSocket
from quad_web.view.state import Item, Wanted


def pair():
    here, there = MessageSocket.pair()
    return here, MessageSocket(there)


def received(messages: MessageSocket, count: int) -> list:
    """Wait for so many messages."""
    found = []
    while len(found) < count:
        messages.wait(5.0)
        messages.flush()
        found += messages.receive()
    return found


def test_messages_arrive_whole_and_in_order():
    here, there = pair()
    here.send({"one": 1})
    here.send([2] * 1000)
    assert received(there, 2) == [{"one": 1}, [2] * 1000]


def test_a_message_that_the_system_does_not_take_at_once_does_not_block():
    here, there = pair()
    big = np.arange(4_000_000)  # 32 MB, more than any socket's buffer
    here.send(big)
    assert not here.is_flushed

    def read():
        there.wait(5.0)
        return there.receive()

    arrived = []
    while not arrived:
        here.flush()
        arrived = read()
    assert here.is_flushed
    assert np.array_equal(arrived[0], big)


def test_a_closed_end_is_seen_after_the_last_message():
    here, there = pair()
    here.send("last")
    here.close()
    assert received(there, 1) == ["last"]
    with pytest.raises(EOFError, match="closed"):
        there.receive()
    there.send("to nobody")
    assert there.is_flushed


@pytest.fixture
def served():
    here, there = pair()
    source = ServedSource(there, frozenset({"send_goal", "parameters"}))

    def run():
        with pytest.raises(EOFError):
            source.take_all()

    thread = threading.Thread(target=run)
    thread.start()
    yield source, here
    here.close()
    thread.join(5.0)
    assert not thread.is_alive()


def test_batches_change_the_state_and_are_confirmed(served):
    source, here = served
    here.send(Batch([Item("poses", {"stamp_s": 1.0})], (), [(1.0, "sent", "info", 0)]))
    assert received(here, 1) == [True]
    here.send(Batch([Item("flight", {})], ("poses",), clears=False))
    assert received(here, 1) == [True]
    assert source.state.item("poses") is None and source.state.item("flight") is not None
    assert [event.text for event in source.state.events()] == ["sent"]
    here.send(Batch([Item("scene", {})], clears=True))
    assert received(here, 1) == [True]
    assert source.state.item("flight") is None and source.state.events() == []


def test_the_source_learns_what_the_pages_show(served):
    source, here = served
    shown = Wanted(frozenset({"scan"}), 1)
    client = source.state.add_client(shown)
    assert received(here, 1) == [(shown,)]
    source.state.remove_client(client)
    assert received(here, 1) == [()]


def test_actions_are_carried_out_by_the_source(served):
    source, here = served
    answers = []
    pose = Pose2D(1.0, 2.0, 0.5)
    person = threading.Thread(
        target=lambda: answers.append(source.send_goal(3, pose=pose)), daemon=True
    )
    person.start()
    (call,) = received(here, 1)
    assert call == Call(0, "send_goal", {"robot": 3, "pose": pose})
    here.send((call.number, Answer(True, "sent")))
    person.join(5.0)
    assert answers == [Answer(True, "sent")]


def test_all_actions_are_forwarded():
    names = {name for name in vars(Actions) if not name.startswith("_")} - {"available"}
    assert names <= set(vars(ServedSource))


def test_without_nicegui_the_message_says_how_to_install_it(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"NiceGUI is not installed; .* 'quad-nav\[web\]'"):
        require_nicegui()
