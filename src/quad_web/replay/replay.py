"""Play a recorded flight on a page: play, pause, seek, and a speed."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any, Callable, Dict, FrozenSet, Hashable, List, Optional

import numpy as np

from quad_nav.errors import InputError
from quad_web.replay.recorded_flight import RecordedFlight
from quad_web.view.actions import Actions, Answer
from quad_web.view.rows import SAMPLE_PERIOD_S, flight_item
from quad_web.view.state import (
    LAYERS,
    OF_ONE_ROBOT,
    FleetState,
    Item,
    robots_by_layer,
)

PERIOD_S = 0.1
FASTEST = 50.0
"""Rate of "as fast as it goes", recorded seconds per second: nothing faster is readable."""
_HISTORY_S, _HISTORY_PERIOD_S = 60.0, 1.0
_SHOW_WITHIN_S = 0.08
_PROGRESS_PERIOD_S = 0.25
SLOWEST, MAX_RATE = 0.01, 1000.0


class Replay(Actions):
    """Puts a recorded flight into a state, as time passes.

    While the file is read, the pages show how far it is. It plays from when the first page is open.
    ``run`` is for a thread of its own.

    Attributes:
        is_read: Set when the file is read, or cannot be read.
        faults: Why it cannot be read, or not any more.
    """

    available = frozenset({"start", "pause", "reset", "set_rate", "seek"})

    def __init__(
        self, path: Path, state: FleetState, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Read nothing yet; ``clock`` is the wall clock."""
        self._path, self._state, self._clock = path, state, clock
        self.is_read = threading.Event()
        self.faults: List[str] = []
        self._changed = threading.Condition()
        self._rate, self._is_playing = 1.0, True
        self._has_jumped = True
        self._is_closed = False
        self._last_wall_s: Optional[float] = None
        self._shown: Dict[str, Hashable] = {}  # item -> what identifies its state
        self._told = 0  # events
        self._subject: object = None
        self._shown_s = 0.0
        self._lacks_history = False
        self._next_told_s = -float("inf")
        self._progress(0.0)

    def _progress(self, share: float) -> None:
        now_s = time.monotonic()
        if now_s >= self._next_told_s:
            self._next_told_s = now_s + _PROGRESS_PERIOD_S
            title = f"reading {self._path.name}, {share:.0%}"
            self._state.put_all([flight_item("replay", title, "starting", 0.0)])

    # -- actions, in the pages' threads --------------------------------------------------

    def call(self, name: str, *arguments: Any) -> Any:
        """Return what comes of an action."""
        if name in self.available and (self.faults or not self.is_read.is_set()):
            return Answer(False, f"{name}: the recording is still being read")
        with self._changed:
            answer = super().call(name, *arguments)
            self._changed.notify()
            return answer

    def start(self) -> Answer:
        """Play; from the start if the recording has ended."""
        if self._time_s >= self._flight.end_s:
            self._jump(self._flight.start_s)
        self._is_playing = True
        return Answer(True, "playing")

    def pause(self) -> Answer:
        """Stand still."""
        self._is_playing = False
        return Answer(True, f"stands at {self._time_s:.1f} s")

    def reset(self) -> Answer:
        """Go to the start of the recording."""
        return self.seek(self._flight.start_s)

    def set_rate(self, rate: float) -> Answer:
        """Set seconds of the recording per second; 0 is as fast as it goes."""
        if rate != 0.0 and not SLOWEST <= rate <= MAX_RATE:
            return Answer(False, f"rate: {rate:g}; expected 0, or {SLOWEST:g} to {MAX_RATE:g}")
        self._rate = rate
        return Answer(True, f"rate: {rate:g}" if rate else f"rate: {FASTEST:g}, the fastest")

    def seek(self, time_s: float) -> Answer:
        """Go to a time of the flight; it plays on if it did."""
        if not time_s == time_s:
            return Answer(False, f"time: {time_s}; expected seconds")
        self._jump(min(max(time_s, self._flight.start_s), self._flight.end_s))
        return Answer(True, f"at {self._time_s:.1f} s")

    def _jump(self, time_s: float) -> None:
        self._time_s = time_s
        self._has_jumped = True

    # -- the player's thread -------------------------------------------------------------

    def run(self) -> None:
        """Read the file and play until ``close``, or until there are faults."""
        try:
            self.read()
            while not self._is_closed:
                self.step()
                with self._changed:
                    if not self._has_jumped and not self._is_closed:
                        self._changed.wait(PERIOD_S)
        except InputError as error:
            self.faults = error.problems
        else:
            self.release()
        finally:
            self.is_read.set()

    def read(self) -> None:
        """Read the file, and stand at the start of its flight.

        Raises:
            InputError: The file cannot be read as a flight.
        """
        self._flight = RecordedFlight(self._path, self._progress)
        self._time_s = self._flight.start_s
        self._state.put_all([*self._flight.static_items, self._flight_item()])
        self.is_read.set()

    def release(self) -> None:
        """Close the file that ``read`` has opened; ``run`` does so at its end."""
        self._flight.close()

    def close(self) -> None:
        """End ``run``."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()

    def step(self) -> None:
        """Let time pass, and show what is wanted then."""
        wanted = self._state.wanted()
        with self._changed:
            time_s, has_jumped = self._pass_time(bool(wanted)), self._has_jumped
            self._has_jumped = False
            subject = (time_s, wanted, self._is_playing, self._rate)
            flight_item = self._flight_item()
        if subject == self._subject or not (wanted or has_jumped):
            return
        self._subject = None if has_jumped else subject
        self._tell_events(time_s)
        robots_of = robots_by_layer(wanted, range(len(self._flight.names)))
        fast = {layer: robots_of[layer] for layer in LAYERS if layer not in OF_ONE_ROBOT}
        slow = {layer: robots_of[layer] for layer in OF_ONE_ROBOT}
        passed = [] if has_jumped else self._samples(self._shown_s, time_s, SAMPLE_PERIOD_S)
        self._shown_s = time_s
        self._show([flight_item, *passed, *self._flight.present_items(time_s)], fast, time_s)
        self._show_result(time_s >= self._flight.end_s)
        self._show([], slow, time_s)
        if self._lacks_history and not has_jumped:  # not while somebody drags the bar
            before_s = max(self._flight.start_s, time_s - _HISTORY_S)
            self._state.put_all(self._samples(before_s, time_s, _HISTORY_PERIOD_S))
        self._lacks_history = has_jumped

    def _pass_time(self, is_seen: bool) -> float:
        """Return the time after what has passed since the last call."""
        wall_s = self._clock()
        if self._last_wall_s is not None and self._is_playing and is_seen and not self._has_jumped:
            rate = self._rate or FASTEST
            self._time_s += (wall_s - self._last_wall_s) * rate
        self._last_wall_s = wall_s
        if self._time_s >= self._flight.end_s:
            self._time_s, self._is_playing = self._flight.end_s, False
        return self._time_s

    def _show(self, items: List[Item], robots_of: Dict[str, FrozenSet[int]], time_s: float) -> None:
        """Put items, and the layers that have changed."""
        end_s = self._clock() + _SHOW_WITHIN_S
        parts = self._flight.parts(time_s, robots_of, lambda: self._clock() < end_s)
        here = {key for key in self._shown if key.partition("/")[0] in robots_of}
        removed = [key for key in here if key not in parts]
        for key, (identity, make) in parts.items():
            if self._shown.get(key) != identity:
                item = make()
                if item is None:  # also a costmap for which there was no time
                    removed.append(key)
                    self._subject = None
                else:
                    items.append(item)
                    self._shown[key] = identity
        for key in removed:
            self._shown.pop(key, None)
        if items or removed:
            self._state.put_all(items, tuple(removed))

    def _show_result(self, has_ended: bool) -> None:
        if has_ended is not (self._state.item("result") is not None):
            items = [self._flight.result] if has_ended else []
            self._state.put_all(items, () if has_ended else ("result",))

    def _samples(self, after_s: float, time_s: float, period_s: float) -> List[Item]:
        """Return the samples after a time, up to another one, so far apart."""
        times_s = np.arange(time_s, max(after_s, time_s - _HISTORY_S), -period_s)[::-1]
        return [self._flight.sample(float(at_s)) for at_s in times_s]

    def _tell_events(self, time_s: float) -> None:
        """Append the events up to a time to the log, each once."""
        events = self._flight.events
        while self._told < len(events) and events[self._told][0] <= time_s:
            self._state.add_event(*events[self._told])
            self._told += 1

    def _flight_item(self) -> Item:
        flight = self._flight
        has_ended = self._time_s >= flight.end_s
        state = "ended" if has_ended else "running" if self._is_playing else "paused"
        rate = (self._rate or FASTEST) if state == "running" else None
        return flight_item(
            "replay",
            flight.title,
            state,
            self._time_s,
            rate=rate,
            wanted_rate=self._rate,
            duration_s=flight.end_s,
            reason=flight.end_reason if has_ended else "",
        )
