"""A page of NiceGUI without a server and without a browser: its elements, and what they do."""

from __future__ import annotations

import asyncio
import contextlib
from typing import Any, Iterator, List

from nicegui import Client, background_tasks, core, ui
from nicegui.app.app import State
from nicegui.page import page as nicegui_page

from quad_web.page import Page
from quad_web.view.actions import LABELS, READS, Actions, Answer, GoalFileView, ParameterView, Role
from quad_web.view.state import FleetState

PARAMETERS = (
    ParameterView("", "planner_frequency", "double", 0.0, 0.0, 0.0, 100.0, doc="Hz"),
    ParameterView("DWA", "max_vel_x", "double", 0.9, 0.55, 0.0, 5.0, doc="Speed ahead"),
    ParameterView("DWA", "vx_samples", "int", 10, 10, 1, 100),
    ParameterView("DWA", "stop", "bool", True, True),
    ParameterView("DWA", "method", "int", 1, 1, 0, 2, (("Overwrite", 0), ("Maximum", 1))),
)


class Recorded(Actions):
    """Does nothing, and keeps each call that would change something."""

    available = frozenset({*LABELS, *READS})

    def __init__(self) -> None:
        self.calls: List[Any] = []
        self.answer = Answer(True, "done")
        self.files = [GoalFileView(0, "/goals/quad0_goals.json", "v1", [(1.0, 2.0, None)])]
        self.faults: List[str] = []

    def parameters(self, robot):
        return PARAMETERS

    def goal_files(self):
        return self.files

    def check_goals(self, robot, version, goals):
        return ["is outside" if goal.x_m > 10.0 else "" for goal in goals]


def _recorded(name):
    def call(self, *args):
        self.calls.append((name, *args))
        return self.answer

    return call


for _name in LABELS:
    setattr(Recorded, _name, _recorded(_name))


def fleet() -> FleetState:
    """Return the state of two robots that fly."""
    state = FleetState()
    state.put("flight", {"source": "ros", "title": "hall", "state": "running", "time_s": 61.5})
    state.put("robots", {"names": ["quad0", "quad1"], "colours": ["#2078dc", "#e06010"]})
    rows = [
        {
            "robot": robot,
            "state": "flying",
            "goal": 1,
            "goals": 3,
            "goal_distance": 1.234,
            "speed_mps": 0.5,
            "gap_m": None,
            "recoveries": [1, 4],
            "age_s": 0.1,
            "lidar": True,
            "reason": "",
        }
        for robot in (0, 1)
    ]
    state.put("status", {"rows": rows})
    return state


class Person:
    """Who uses a page: fires the events that a browser would send."""

    def __init__(self, page: Page, client: Client) -> None:
        self.page, self.client = page, client

    def element(self, testid: str) -> Any:
        (found,) = (
            one for one in self.client.elements.values() if one.props.get("data-testid") == testid
        )
        return found

    def fire(self, element: Any, kind: str, args: Any) -> int:
        """Send an event to an element as the browser does, and return how many listeners heard."""
        heard = [one for one in element._event_listeners.values() if one.type == kind]
        for listener in heard:
            element._handle_event({"listener_id": listener.id, "args": args})
        return len(heard)

    async def settled(self) -> None:
        """Return when no handler is at work."""
        while True:
            busy = [
                task
                for task in background_tasks.running_tasks
                if not task.done() and "loop" not in task.get_name()
            ]
            if not busy:
                return
            await asyncio.wait(busy)


@contextlib.contextmanager
def _started() -> Iterator[None]:
    """Make NiceGUI believe that it serves, in the running loop."""
    before = core.app._state, core.loop
    core.app._state, core.loop = State.STARTED, asyncio.get_running_loop()
    try:
        yield
    finally:
        core.app._state, core.loop = before


def with_page(scenario, state=None, actions=None, role=Role.STEER) -> None:
    """Run ``scenario(person, actions)``, a coroutine, with a page."""
    actions = actions or Recorded()
    state = state or fleet()

    async def run() -> None:
        with _started():
            client = Client(nicegui_page("/test"), request=None)
            try:
                with client:
                    page = Page(state, actions, role)
                    for timer in [e for e in client.elements.values() if isinstance(e, ui.timer)]:
                        timer.cancel()
                    await asyncio.wait_for(scenario(Person(page, client), actions), 20.0)
            finally:
                client.delete()
                tasks = list(background_tasks.running_tasks)
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(run())
