"""Messages between a source and the server in a process of its own."""

from __future__ import annotations

import multiprocessing
import threading

import numpy as np
import pytest
from test_current_folder import mission, run_script  # noqa: F401

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_web.process import Batch, Call, Channel, ServedSource, require_nicegui
from quad_web.view.actions import Answer
from quad_web.view.state import Item, Wanted

PAGE = """
from quad_nav.errors import InputError
from quad_web import process
from quad_web.server import WebOptions

process.require_nicegui = lambda: None
if __name__ == "__main__":
    try:
        process.ServerProcess(WebOptions(), frozenset()).close()
    except InputError as error:
        print(error)
"""


def received(channel: Channel, count: int) -> list:
    """Wait for so many messages."""
    found = []
    while len(found) < count:
        found += channel.receive(5.0)
    return found


def test_messages_arrive_in_order_and_a_closed_end_is_seen_after_the_last_one():
    here, there = map(Channel, multiprocessing.Pipe())
    big = np.arange(4_000_000)  # 32 MB, more than any pipe's buffer: nobody waits for it
    for message in ({"one": 1}, big, [2] * 1000):
        here.send(message)
    first, second, third = received(there, 3)
    assert (first, third) == ({"one": 1}, [2] * 1000) and np.array_equal(second, big)
    there.send("last")
    here.receive(5.0)
    there.close()
    with pytest.raises(EOFError, match="closed"):
        here.receive(5.0)
    here.send("to nobody")


@pytest.fixture
def served():
    here, there = multiprocessing.Pipe()
    source, here = ServedSource(there, frozenset({"send_goal", "parameters"})), Channel(here)

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
    here.send(Batch([Item("flight", {})], ("poses",)))
    assert received(here, 2) == [True, True]
    assert source.state.item("poses") is None and source.state.item("flight") is not None
    assert [event.text for event in source.state.events()] == ["sent"]
    here.send(Batch([Item("scene", {})], clears=True))
    assert received(here, 1) == [True]
    assert source.state.item("flight") is None and source.state.events() == []


def test_the_source_learns_what_the_pages_show_and_carries_out_actions(served):
    source, here = served
    shown = Wanted(frozenset({"scan"}), 1)
    client = source.state.add_client(shown)
    assert received(here, 1) == [(shown,)]
    source.state.remove_client(client)
    assert received(here, 1) == [()]
    answers, pose = [], Pose2D(1.0, 2.0, 0.5)
    person = threading.Thread(target=lambda: answers.append(source.call("send_goal", 3, pose)))
    person.start()
    (call,) = received(here, 1)
    assert call == Call(0, "send_goal", (3, pose))
    here.send((call.number, Answer(True, "sent")))
    person.join(5.0)
    assert answers == [Answer(True, "sent")]


def test_without_nicegui_the_message_says_how_to_install_it(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"NiceGUI is not installed; .* 'quad-nav\[web\]'"):
        require_nicegui()


def test_files_of_the_current_folder_are_not_run(mission):  # noqa: F811
    run_script(mission, PAGE)
