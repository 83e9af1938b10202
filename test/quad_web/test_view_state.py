"""State of the page: versions, what a client wants, samples, events, threads."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from quad_web.view import state as view_state
from quad_web.view.state import FleetState, Item, Wanted, robots_by_layer

NOTHING = {}


@pytest.fixture
def state():
    return FleetState()


def keys(items):
    return [item.key for item in items]


def test_new_client_gets_everything_then_what_changes(state):
    state.put("flight", {"time_s": 0.0})
    state.put("robots", {})
    first = state.changes(Wanted(), NOTHING)
    assert keys(first.items) == ["flight", "robots"]
    assert state.changes(Wanted(), first.versions).items == ()
    for time_s in (0.1, 0.2):  # it skips the first
        state.put("flight", {"time_s": time_s})
    second = state.changes(Wanted(), first.versions)
    assert [item.data for item in second.items] == [{"time_s": 0.2}]
    assert second.removed == ()


def test_layers_are_sent_to_those_who_want_them(state):
    state.put_all([Item("plan/0"), Item("plan/1"), Item("scan/0"), Item("poses")])
    assert keys(state.changes(Wanted(), NOTHING).items) == ["poses"]
    plans = state.changes(Wanted(frozenset({"plan"})), NOTHING)
    assert keys(plans.items) == ["plan/0", "plan/1", "poses"]


def test_costmaps_are_sent_of_the_selected_robot_alone(state):
    state.put_all([Item("local_costmap/0"), Item("local_costmap/1")])
    layers = frozenset({"local_costmap"})
    assert keys(state.changes(Wanted(layers), NOTHING).items) == []
    first = state.changes(Wanted(layers, 0), NOTHING)
    assert keys(first.items) == ["local_costmap/0"]
    second = state.changes(Wanted(layers, 1), first.versions)
    assert (keys(second.items), second.removed) == (["local_costmap/1"], ("local_costmap/0",))


def test_removed_and_unwanted_items_are_named_once(state):
    state.put_all([Item("plan/0"), Item("goals")])
    plans = Wanted(frozenset({"plan"}))
    first = state.changes(plans, NOTHING)
    state.put_all([], ("goals", "never there"))
    second = state.changes(plans, first.versions)
    assert (second.items, second.removed) == ((), ("goals",))
    third = state.changes(Wanted(), second.versions)
    assert third.removed == ("plan/0",)
    assert state.changes(Wanted(), third.versions).removed == ()


def test_cleared_state_sends_what_comes_next(state):
    state.put("goals", 1)
    state.add_event(0.0, "sent")
    first = state.changes(Wanted(), NOTHING)
    state.clear()
    state.put("goals", 2)
    second = state.changes(Wanted(), first.versions)
    assert [item.data for item in second.items] == [2]
    assert (second.removed, state.events()) == ((), [])


def test_work_is_asked_for_by_clients_alone(state):
    client = state.add_client(Wanted())
    assert state.wanted() == (Wanted(),)
    state.set_wanted(client, Wanted(frozenset({"scan", "global_costmap"}), 2))
    shown = robots_by_layer(state.wanted(), (0, 2))
    assert (shown["scan"], shown["plan"], shown["global_costmap"]) == ({0, 2}, set(), {2})
    state.remove_client(client)
    assert state.wanted() == ()


def test_a_large_fleets_costly_layers_are_those_of_the_selected_robot(state):
    wanted = Wanted(frozenset({"scan", "plan"}), 2, every=False)
    state.put_all([Item(f"{layer}/{robot}") for layer in ("scan", "plan") for robot in (0, 2)])
    items = state.changes(wanted, NOTHING).items
    assert {item.key for item in items} == {"scan/2", "plan/0", "plan/2"}
    shown = robots_by_layer([wanted, Wanted(frozenset({"local_plan"}), 9)], range(3))
    assert (shown["scan"], shown["plan"], shown["cell"]) == ({2}, {0, 1, 2}, set())
    assert shown["local_plan"] == {0, 1, 2}


def put_sample(state, time_s, *gaps):
    values = np.array([[gap, 0, 0, 0] for gap in gaps], np.float32)
    state.put("samples", {"time_s": time_s}, {"values": values})


def test_new_client_gets_the_samples_before(state):
    for k in range(3):
        put_sample(state, 0.1 * k, k, 10 + k)
    first = state.changes(Wanted(), NOTHING)
    (item,) = first.items
    assert item.arrays["values"][:, 0].tolist() == [2.0, 12.0]
    assert item.arrays["times"].tolist() == [0.0, 0.1]
    assert item.arrays["history"].shape == (2, 2, 4)
    assert item.arrays["history"][:, :, 0].tolist() == [[0.0, 10.0], [1.0, 11.0]]
    put_sample(state, 0.3, 3, 13)
    (item,) = state.changes(Wanted(), first.versions).items
    assert set(item.arrays) == {"values"}


@pytest.mark.parametrize(
    "samples, times_s",
    [
        ([(1.0, 1), (2.0, 2), (3.0, 3), (1.5, 4)], [1.0]),  # a jump back in time
        ([(1.0, 1, 2), (2.0, 1)], None),  # another number of robots
    ],
)
def test_samples_that_do_not_fit_are_forgotten(state, samples, times_s):
    for sample in samples:
        put_sample(state, *sample)
    (item,) = state.changes(Wanted(), NOTHING).items
    assert item.data["time_s"] == samples[-1][0]
    times = item.arrays.get("times")
    assert times_s is None if times is None else times.tolist() == times_s


def test_a_client_gets_all_samples_since_the_last_that_it_has(state):
    put_sample(state, 1.0, 1)
    versions = state.changes(Wanted(), NOTHING).versions
    for k in (2, 3, 4):
        put_sample(state, float(k), k)
    (item,) = state.changes(Wanted(), versions).items
    assert item.arrays["times"].tolist() == [2.0, 3.0] and item.data["time_s"] == 4.0
    assert item.arrays["history"].shape == (2, 1, 4)


def test_samples_and_events_are_bounded(state, monkeypatch):
    for k in range(view_state.MAX_SAMPLES + 5):
        put_sample(state, float(k), k)
    (item,) = state.changes(Wanted(), NOTHING).items
    assert item.arrays["times"][[0, -1]].tolist() == [5.0, view_state.MAX_SAMPLES + 3.0]
    for k in range(view_state.MAX_EVENTS + 5):
        state.add_event(float(k), "text", robot=k % 2)
    assert [event.number for event in state.events()][:2] == [5, 6]
    assert state.events()[-1].time_s == view_state.MAX_EVENTS + 4


def test_items_put_together_are_seen_together(state):
    """While a thread puts pairs of equal numbers, a reader never sees two that differ."""
    begun, ended = threading.Event(), threading.Event()

    def write():
        for k in range(2000):
            state.put_all([Item("a", k), Item("b", k)])
            begun.set()
        ended.set()

    thread = threading.Thread(target=write)
    thread.start()
    begun.wait()
    versions, last, reads = NOTHING, -1, 0
    while not ended.is_set() or reads == 0:
        changes = state.changes(Wanted(), versions)
        versions = changes.versions
        assert len({item.data for item in changes.items}) <= 1
        assert len(changes.items) in (0, 2)
        for item in changes.items:
            assert item.data >= last
            last = item.data
        reads += 1
    thread.join()
    assert state.item("a").data == 1999
