"""Actions of a page: the role, the threads, and what comes of them."""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path

import pytest
from page_without_browser import Recorded, fleet

from quad_web import page_client
from quad_web.page_client import NOT_HERE, WATCHES, PageClient
from quad_web.view.actions import LABELS, Answer, Role

WEB = Path(page_client.__file__).parent


def made(role=Role.STEER, actions=None):
    shown = []
    return PageClient(fleet(), actions or Recorded(), role, shown.append), shown


def test_an_action_is_called_shown_and_logged():
    client, shown = made()
    answer = asyncio.run(client.call("cancel", 1, robot=1))
    assert client._actions.calls == [("cancel", 1)]
    assert shown == [answer] == [Answer(True, "done")]
    (event,) = client.state.events()
    assert (event.time_s, event.level, event.robot, event.text) == (61.5, "info", 1, "done")


def test_a_failed_action_says_what_failed():
    client, shown = made()
    client._actions.answer = Answer(False, "quad1: no goal")
    asyncio.run(client.call("cancel", 1, robot=1))
    (event,) = client.state.events()
    assert (event.level, event.text) == ("warning", "cancel the goal failed: quad1: no goal")
    assert shown == [Answer(False, "quad1: no goal")]


@pytest.mark.parametrize("name", LABELS)
def test_a_page_that_may_only_watch_calls_nothing(name):
    client, shown = made(Role.WATCH)
    answer = asyncio.run(client.call(name))
    assert client._actions.calls == [] and client.state.events() == []
    assert not answer.ok and WATCHES in answer.text and shown == [answer]


def test_what_the_source_cannot_do_is_refused():
    class Nothing(Recorded):
        available = frozenset({"pause"})

    client, _ = made(actions=Nothing())
    assert client.refusal("pause") == "" and client.refusal("reset") == NOT_HERE
    assert not asyncio.run(client.call("reset")).ok
    assert not asyncio.run(client.call("__init__")).ok
    assert client._actions.calls == []


@pytest.mark.parametrize("name", ["stop_all", "__class__", "_actions"])
def test_only_reads_are_read(name):
    client, _ = made(Role.WATCH)
    with pytest.raises(ValueError, match="expected one of parameters"):
        asyncio.run(client.read(name))
    assert asyncio.run(client.read("goal_files"))[0].robot == 0


def test_stopping_does_not_wait_for_actions_that_hang():
    class Hanging(Recorded):
        answered = threading.Event()

        def clear_costmaps(self, robot):
            self.answered.wait(20.0)
            return Answer(True, "late")

    async def stop_while_all_hang(client):
        late = [asyncio.ensure_future(client.call("clear_costmaps", 0)) for _ in range(50)]
        await asyncio.sleep(0)
        answer = await client.call("stop_all")
        assert not any(one.done() for one in late)
        Hanging.answered.set()
        await asyncio.gather(*late)
        return answer

    client, _ = made(actions=Hanging())
    assert asyncio.run(stop_while_all_hang(client)) == Answer(True, "done")
