"""The page without a browser: its controls, and what they may do."""

from __future__ import annotations

import asyncio
import gc
import itertools
import threading
import weakref

from page_without_browser import Recorded, fleet, with_page

from quad_nav.geometry import Pose2D
from quad_web.view.actions import Answer, GoalChange, GoalFileView, Role

POSE = {"x": 3.0, "y": 4.0, "yaw": None}


def test_a_page_that_may_only_watch_steers_with_no_event_of_any_element():
    """A browser can send whatever it likes: every listener of every element is tried."""
    arguments = [{}, None, True, 1, "goal", [], POSE, [{**POSE, "source": None}], {"value": 1}]

    async def scenario(person, actions):
        page = person.page
        page.client.select(0)
        await page.parameters.refresh()
        await page.goals.refresh()
        heard = 0
        for element, args in itertools.product(list(person.client.elements.values()), arguments):
            for listener in list(element._event_listeners.values()):
                if element.is_deleted:
                    continue
                try:
                    element._handle_event({"listener_id": listener.id, "args": args})
                except (TypeError, ValueError, KeyError, AttributeError):
                    pass  # arguments that the listener cannot have
                heard += 1
            page.client.select(0)
        await person.settled()
        assert heard > 300
        assert actions.calls == []
        for testid in ("play", "reset", "rate", "stop-all", "tool-goal", "cancel", "goals-save"):
            assert not person.element(testid).enabled
        assert "watch" in person.element("stop-all").props["title"]

    with_page(scenario, role=Role.WATCH)


def test_the_same_events_steer_for_who_may():
    """Counterpart: the test above can fail."""

    async def scenario(person, actions):
        person.fire(person.page.arena, "goal", {"x": 3.0, "y": 4.0, "yaw": 1.5})
        await person.settled()
        assert actions.calls == [("send_goal", None, Pose2D(3.0, 4.0, 1.5))]

    with_page(scenario)


def test_what_the_source_cannot_do_is_disabled_with_the_reason():
    class Watched(Recorded):
        available = frozenset({"pause", "stop_all"})

    async def scenario(person, actions):
        assert person.element("stop-all").enabled and person.element("play").enabled
        assert not person.element("reset").enabled
        assert person.element("reset").props["title"] == "Not possible here"
        assert not person.element("scrub").visible or not person.page.bar._line.visible

    with_page(scenario, actions=Watched())


def test_a_time_line_that_is_dragged_skips_to_the_last_time():
    class Slow(Recorded):
        may_go_on = threading.Event()

        def seek(self, time_s):
            self.calls.append(time_s)
            assert self.may_go_on.wait(20.0)
            return self.answer

    async def scenario(person, actions):
        scrub = person.element("scrub")
        for time_s in (10.0, 20.0, 30.0):
            assert person.fire(scrub, "update:modelValue", time_s) == 2  # the slider's own, too
            while not actions.calls:  # the first one is at work
                await asyncio.sleep(0)
        actions.may_go_on.set()
        person.fire(scrub, "change", {})
        await person.settled()
        assert actions.calls == [10.0, 30.0]
        assert not person.page.bar._is_held

    state = fleet()
    state.put("flight", {"source": "replay", "state": "paused", "time_s": 0.0, "duration_s": 60.0})
    with_page(scenario, state, Slow())


def test_a_typed_goal_has_the_messages_of_files():
    async def scenario(person, actions):
        for name, text in (("x", "3"), ("y", "north"), ("yaw", "")):
            person.element(f"goal-{name}").value = text
        person.fire(person.element("goal-send"), "click", {})
        await person.settled()
        fault = 'y is "north"; expected a finite number of metres'
        assert person.element("goal-fault").text == fault
        assert actions.calls == []
        person.element("goal-y").value = "4"
        person.fire(person.element("goal-send"), "click", {})
        await person.settled()
        assert actions.calls == [("send_goal", None, Pose2D(3.0, 4.0, 0.0))]

    with_page(scenario)


def test_a_parameter_is_changed_refused_and_put_back():
    async def scenario(person, actions):
        page = person.page
        page.client.select(0)
        await page.parameters.refresh()
        page.parameters._search.value = "vel"
        number = person.element("number-DWA/max_vel_x")
        assert "changed" in person.element("p-DWA/max_vel_x").classes
        actions.answer = Answer(False, "max_vel_x: 7: expected 5 at most")
        number.value = "7"
        person.fire(number, "keydown.enter", {})
        await person.settled()
        assert actions.calls == [("set_parameters", 0, "DWA", {"max_vel_x": 7.0})]
        assert number.value == "0.9"
        person.fire(person.element("reset-DWA/max_vel_x"), "click", {})
        await person.settled()
        assert actions.calls[1:] == [("set_parameters", 0, "DWA", {"max_vel_x": 0.55})]

    with_page(scenario)


def test_goals_are_edited_checked_and_saved():
    async def scenario(person, actions):
        editor = person.page.goals
        await editor.refresh()
        person.element("g-x-0").value = "12"
        person.fire(person.element("g-x-0"), "blur", {})
        await person.settled()
        assert person.element("g-fault-0").text == "is outside"
        assert not person.element("goals-save").enabled
        person.element("g-x-0").value = "3.5"
        person.fire(person.element("g-x-0"), "blur", {})
        person.fire(person.element("goals-add"), "click", {})
        await person.settled()
        assert person.element("goals-save").enabled
        person.fire(person.element("goals-save"), "click", {})
        await person.settled()
        goals = [GoalChange(0, 3.5, 2.0, None), GoalChange(None, 4.5, 2.0, None)]
        assert actions.calls == [("save_goals", 0, "v1", goals)]

    with_page(scenario)


def test_an_edited_file_that_changes_on_the_disk_is_not_saved_and_can_be_loaded_again():
    async def scenario(person, actions):
        editor = person.page.goals
        await editor.refresh()
        editor.take([GoalChange(0, 2.0, 2.0, None)])
        actions.files = [GoalFileView(0, "/goals/quad0_goals.json", "v2", [(5.0, 5.0, 1.0)])]
        await editor.refresh()
        await person.settled()
        assert person.element("goals-notice").visible
        assert not person.element("goals-save").enabled
        assert editor.draft.goals[0]["x"] == 2.0  # nothing is lost before the person says so
        person.fire(person.element("goals-reload"), "click", {})
        await person.settled()
        assert not person.element("goals-notice").visible
        assert editor.draft.goals == [{"source": 0, "x": 5.0, "y": 5.0, "yaw": 1.0}]

    with_page(scenario)


def test_nothing_is_left_of_a_page_that_was_closed():
    left = []

    async def scenario(person, actions):
        page = person.page
        page.client.select(1)
        await page.parameters.refresh()
        await page.goals.refresh()
        await person.settled()
        left.extend(map(weakref.ref, (page, page.client, page.goals, page.parameters)))

    state, actions = fleet(), Recorded()
    with_page(scenario, state, actions)
    gc.collect()
    assert [one() for one in left] == [None] * 4
    assert state.wanted() == ()


def test_events_and_rows_are_sent_once():
    sent = []

    async def scenario(person, actions):
        page = person.page
        for table in (page.table._table, page.events._table):
            table.run_method = lambda *args, table=table: sent.append((table, args))
        page.client.state.add_event(1.0, "one")
        page.refresh()
        page.refresh()
        assert [args[0] for _, args in sent] == ["patch"]
        ((_, (_, rows, _)),) = sent
        assert [row["text"] for row in rows] == ["one"]
        sent.clear()
        page.client.state.clear()
        page.client.state.add_event(0.0, "two")
        page.refresh()
        calls = [args for table, args in sent if table is page.events._table]
        assert [call[0] for call in calls] == ["clear", "patch"]

    with_page(scenario, state=fleet())
