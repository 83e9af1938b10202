"""Show a flight on a page while it flies, and let people steer it.

The page's server has a process of its own. The flight never waits for it: ten times per second of
wall time, and only if a page is open, the flight hands over what the pages show, unless the last
batch is still on its way. Without a person's doing the flight is the same as without a page, bit
for bit.
"""

from __future__ import annotations

import collections
import time
from typing import Callable, Deque, Optional, Tuple

from quad_nav.mission.actions import Action, GoalEnded
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.sim.contacts import Contact
from quad_nav.sim.pacing import RateMeter
from quad_web.offline.actions import FlightActions
from quad_web.offline.items import FlightItems
from quad_web.process import Batch, ServerProcess
from quad_web.view.state import MAX_EVENTS

PERIOD_S = 0.1
FULL_SPEED_PERIOD_S = 0.35
"""Least time between samples at full speed, when the flight and the browser share the processor and
seconds of simulated time pass from one sample to the next."""
SHARE = 0.04
"""Largest part of the wall time that is spent on samples, unless there is one per second."""
_LONGEST_REST_S = 1.0
_MAX_LAG_S = 0.1
_END_WITHIN_S = 5.0


class WebView(FlightObserver):
    """Shows a flight on pages; it begins when the first page is open."""

    def __init__(
        self,
        page: ServerProcess,
        actions: FlightActions,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Show a flight; ``clock`` is the wall clock."""
        self.actions = actions
        self._page, self._clock = page, clock
        self._next_look_s = self._next_sample_s = -float("inf")
        self._pace: Optional[Tuple[float, float, float]] = None  # rate, wall time, simulated time
        self._events: Deque[Tuple[float, str, str, Optional[int]]] = collections.deque(
            maxlen=MAX_EVENTS
        )
        self._meter = RateMeter()
        self._is_new = True
        self._sampled: object = None  # what the last sample was of

    @property
    def stop_reason(self) -> str:
        """Reason to end the flight: a person wants that."""
        return self.actions.stop_reason

    def on_start(self, flight: Flight) -> None:
        """Show the scene, and wait until a page is open."""
        self._flight = flight
        self._items = FlightItems(flight)
        self.actions.begin(flight)
        self._look()
        while self._page.is_alive and not self._page.wanted and not flight.stop_reasons:
            self._idle(PERIOD_S)
        self._meter.start(self._clock(), flight.now_s)

    def on_contact(self, contact: Contact) -> None:
        """Show a contact."""
        self._items.add_contact(contact)
        self._note(contact.time_s, str(contact), "warning", None)

    def on_action(self, robot: int, now_s: float, action: Action) -> None:
        """Show that a goal was sent or has ended."""
        failed = action.index if isinstance(action, GoalEnded) and not action.reached else None
        self._items.note_goals(robot, failed)
        self._note(now_s, action.text, action.level.name.lower(), robot)

    def on_move(self, flight: Flight) -> None:
        """Carry out what people do, show the flight, and keep its pace."""
        self._items.track(flight)
        if self._clock() >= self._next_look_s:
            self._look()
        while self.actions.is_paused and not flight.stop_reasons and self._page.is_alive:
            self._idle(PERIOD_S)
        self._keep_pace(flight)

    def on_end(self, flight: Flight) -> None:
        """Show how the flight ended."""
        self.actions.end()
        text = f"the flight has ended: {flight.reason}".rstrip(": ")
        self._note(flight.now_s, text, "info", None)
        end_s = self._clock() + _END_WITHIN_S
        while self._page.is_alive and not self._page.can_take and self._clock() < end_s:
            self._page.wait(PERIOD_S)
        if self._page.can_take:
            self._send(everything=True)

    def _note(self, time_s: float, text: str, level: str, robot: Optional[int]) -> None:
        self._events.append((time_s, text, level, robot))

    # -- the page ------------------------------------------------------------------------

    def _look(self) -> None:
        """Answer people, and send a sample if one is due."""
        self._next_look_s = self._clock() + PERIOD_S
        self._page.serve(self.actions)
        start_s = self._clock()
        subject = (self._flight.now_s, self._page.wanted, self.actions.version)
        is_due = start_s >= self._next_sample_s and subject != self._sampled
        if is_due and (self._page.wanted or self._is_new) and self._page.can_take:
            self._sampled = subject
            self._send()
            end_s = self._clock()
            rest_s = min((end_s - start_s) / SHARE, _LONGEST_REST_S)
            period_s = PERIOD_S if self.actions.rate > 0.0 else FULL_SPEED_PERIOD_S
            self._next_sample_s = max(start_s + period_s, end_s + rest_s)

    def _send(self, everything: bool = False) -> None:
        now_s = self._flight.now_s
        achieved = self._meter.read(self._clock(), now_s)
        wanted = None if everything else self._page.wanted
        items, removed = self._items.sample(wanted, self.actions, achieved)
        events = list(self._events)
        self._events.clear()
        self._page.send(Batch(items, removed, events, self._is_new))
        self._is_new = False

    def _idle(self, timeout_s: float) -> None:
        """Wait for people while the flight stands."""
        self._page.wait(timeout_s)
        self._look()

    # -- pace ----------------------------------------------------------------------------

    @property
    def _rate(self) -> float:
        """The pace; hovering quadcopters need none but the real one."""
        return 1.0 if self.actions.is_stopped else self.actions.rate

    def _keep_pace(self, flight: Flight) -> None:
        """Wait until the flight is due; one that is late does not catch up."""
        rate = self._rate
        if rate <= 0.0 or not self._page.is_alive:  # nobody watches any more
            self._pace = None
            return
        wall_s = self._clock()
        if self._pace is None or self._pace[0] != rate:
            self._pace = (rate, wall_s, flight.now_s)
        due_s = self._pace[1] + (flight.now_s - self._pace[2]) / rate
        if wall_s - due_s > _MAX_LAG_S:
            self._pace = (rate, wall_s, flight.now_s)
        while wall_s < due_s and self._rate == rate and not self.actions.is_paused:
            self._page.wait(min(due_s - wall_s, PERIOD_S))
            wall_s = self._clock()
            if wall_s >= self._next_look_s:
                self._look()
        if self.actions.is_paused:
            self._pace = None
