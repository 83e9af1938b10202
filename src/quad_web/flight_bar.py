"""Top bar: the flight, its clock and its rate; and the button that stops every robot.

``data-testid``: ``title``, ``source``, ``flight-state``, ``time``, ``role``, ``play``, ``reset``,
``rate``, ``rate-shown``, ``scrub``, ``scrub-time``, ``stop-all``.
"""

from __future__ import annotations

import math
from typing import Any, Dict, Mapping, Optional

from nicegui import ui
from nicegui.events import KeyEventArguments

from quad_nav.errors import printable
from quad_web.page_client import PageClient
from quad_web.view.actions import Role

STOP_KEY = "."
RATES = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 0.0)
"""Steps of the slider; the last one, 0, is as fast as it goes."""
_MARKS = {0.1: "0.1×", 1.0: "real time", 0.0: "max"}
SOURCES = {
    "preview": "before the flight",
    "ros": "live, ROS",
    "offline": "live, offline",
    "replay": "recording",
}


def rate_step(rate: Optional[float]) -> int:
    """Return the step of the slider that is nearest to a rate (in ratio)."""
    if rate is None:
        return RATES.index(1.0)
    if rate <= 0.0:
        return len(RATES) - 1
    ratios = [max(rate / step, step / rate) if step else math.inf for step in RATES]
    return ratios.index(min(ratios))


def rate_text(rate: Optional[float]) -> str:
    """Return an achieved rate for people, as "0.98×"."""
    if rate is None:
        return "–"
    return f"{rate:.2f}×" if rate < 10.0 else f"{rate:.0f}×"


def clock_text(time_s: Optional[float]) -> str:
    """Return a time as minutes and seconds, with hours from one hour on."""
    if time_s is None:
        return "–:––"
    tenths = max(0, int(time_s * 10 + 1e-6))
    minutes, tenths = divmod(tenths, 600)
    hours, minutes = divmod(minutes, 60)
    start = f"{hours}:{minutes:02d}" if hours else f"{minutes}"
    return f"{start}:{tenths // 10:02d}.{tenths % 10}"


def why_idle(client: PageClient, name: str) -> str:
    """Return the tooltip of a control that cannot be used, "" for one that can."""
    reason = client.refusal(name)
    return reason[:1].upper() + reason[1:]


def enable(element: Any, client: PageClient, name: str) -> Any:
    """Disable a control that this page cannot use, with the reason as a tooltip."""
    reason = why_idle(client, name)
    element.set_enabled(not reason)
    if reason:
        element.props["title"] = reason
    return element


class FlightBar:
    """Title, state, time and role; start, pause, reset, rate; time line of a recording."""

    def __init__(self, client: PageClient) -> None:
        self._client = client
        self._shown: Dict[str, Any] = {}
        self._is_held = False  # the time line is being dragged
        self._is_seeking = False
        self._wanted_s: Optional[float] = None
        with ui.element("header").classes("flight-bar"):
            self._make_title()
            self._make_controls()
            ui.space()
            text = "Steering" if client.role is Role.STEER else "Watching only"
            role = ui.label(text).classes("chip role").props("data-testid=role")
            role.classes(f"role-{client.role.value}")
            is_recording = not client.refusal("seek")
            role.set_visibility(client.role is not Role.STEER or not is_recording)
            role.props["title"] = (
                "This page may steer" if client.role is Role.STEER else why_idle(client, "start")
            )
            self._make_time_line()
        self.refresh()

    def _make_title(self) -> None:
        with ui.element("div").classes("title-box"):
            self._title = ui.label("waiting for data").classes("title").props("data-testid=title")
            self._title.tag = "h1"
            self._source_chip = ui.label().classes("muted text-caption").props("data-testid=source")
        self._state = ui.label().classes("chip flight-state").props("data-testid=flight-state")
        self._time = ui.label("–:––").classes("time").props("data-testid=time")

    def _make_controls(self) -> None:
        client = self._client
        with ui.element("div").classes("controls"):
            self._play = ui.button(icon="play_arrow", on_click=self._toggle)
            self._play.props("flat dense no-caps data-testid=play")
            reset = ui.button(icon="restart_alt", on_click=lambda: client.call("reset"))
            reset.props("flat dense data-testid=reset aria-label=reset")
            reset.props["title"] = "Every robot back to its start pose"
            enable(reset, client, "reset")
            with ui.element("div").classes("rate"):
                self._make_rate()

    def _make_rate(self) -> None:
        self._rate = ui.slider(min=0, max=len(RATES) - 1, step=1, value=RATES.index(1.0))
        self._rate.props("markers snap dense data-testid=rate aria-label='simulation rate'")
        self._rate.props["marker-labels"] = [
            {"value": RATES.index(rate), "label": label} for rate, label in _MARKS.items()
        ]
        self._rate.on("change", self._set_rate)
        enable(self._rate, self._client, "set_rate")
        self._rate_shown = ui.label("–").classes("rate-shown").props("data-testid=rate-shown")
        self._rate_shown.props["title"] = "Simulated seconds per second, as achieved"

    def _make_time_line(self) -> None:
        with ui.element("div").classes("time-line") as self._line:
            self._scrub = ui.slider(min=0.0, max=1.0, step=0.1, value=0.0)
            self._scrub.props("dense data-testid=scrub aria-label='time of the recording'")
            # A trailing event would come after the thumb was let go, and hold the time line.
            drag = "update:model-value"
            self._scrub.on(drag, self._drag, throttle=0.15, trailing_events=False)
            self._scrub.on("change", self._drop)
            self._scrub_time = ui.label().classes("time").props("data-testid=scrub-time")
        self._line.set_visibility(not self._client.refusal("seek"))

    # -- what it shows ---------------------------------------------------------------

    def refresh(self) -> None:
        """Show the item ``flight`` as it is now."""
        flight = self._client.data("flight")
        state = str(flight.get("state", "waiting"))
        self._title.text = printable(flight.get("title", "waiting for data"))
        source = str(flight.get("source", ""))
        self._source_chip.text = SOURCES.get(source, source)
        self._state.props["data-state"] = state
        self._state.props["title"] = printable(flight.get("reason", ""))
        self._state.text = state  # sends the properties, too
        time_s, duration_s = flight.get("time_s"), flight.get("duration_s")
        self._time.text = clock_text(time_s)
        self._rate_shown.text = "" if state == "ended" else rate_text(flight.get("rate"))
        self._show_play(state)
        self._show_rate(flight)
        if duration_s and not self._is_held:
            self._scrub.props["max"] = duration_s
            self._scrub.value = min(float(time_s or 0.0), duration_s)
            self._scrub_time.text = f"{clock_text(time_s)} / {clock_text(duration_s)}"

    def _show_play(self, state: str) -> None:
        """Show the one thing that the button does: pause, start, or resume after a stop."""
        name = "pause" if state in ("starting", "running") else "start"
        text = "Resume" if state == "stopped" else name.capitalize()
        if self._shown.get("play") != text:
            self._shown["play"] = text
            self._play.text = text if state == "stopped" else ""
            self._play.props["icon"] = "pause" if name == "pause" else "play_arrow"
            self._play.props["title"] = why_idle(self._client, name) or text
            self._play.props["aria-label"] = text
            self._play.set_enabled(not self._client.refusal(name))
            self._play.update()

    def _show_rate(self, flight: Mapping[str, Any]) -> None:
        wanted = flight.get("wanted_rate")
        if self._shown.get("rate", "") != wanted:
            self._shown["rate"] = wanted
            self._rate.value = rate_step(wanted)

    # -- what it does ----------------------------------------------------------------

    async def _toggle(self) -> None:
        name = "pause" if self._shown.get("play") == "Pause" else "start"
        is_recording = not self._client.refusal("seek")  # its time line shows what came of it
        await self._client.call(name, is_quiet=is_recording)
        self.refresh()

    async def _set_rate(self) -> None:
        await self._client.call("set_rate", RATES[int(self._rate.value)])

    async def _drag(self) -> None:
        self._is_held = True
        self._scrub_time.text = clock_text(self._scrub.value)
        await self._seek()

    async def _drop(self) -> None:
        await self._seek()
        self._is_held = False

    async def _seek(self) -> None:
        """Go to the time under the thumb; while one seek is at work only the last one waits."""
        self._wanted_s = float(self._scrub.value)
        if self._is_seeking:
            return
        self._is_seeking = True
        try:
            while self._wanted_s is not None:
                wanted_s, self._wanted_s = self._wanted_s, None
                await self._client.call("seek", wanted_s, is_quiet=True)
        finally:
            self._is_seeking = False


class StopButton:
    """STOP ALL: cancels all goals and ends all missions, by click or by key."""

    def __init__(self, client: PageClient) -> None:
        self._client = client
        with ui.element("div").classes("stop-box"):
            button = ui.button(on_click=self._stop).classes("stop-all")
            button.props("unelevated no-caps data-testid=stop-all color=negative")
            with button:
                ui.icon("dangerous")
                ui.label("STOP ALL")
                ui.label(f"key {STOP_KEY}").classes("key")
            enable(button, client, "stop_all")
            if not client.refusal("stop_all"):
                button.props["title"] = "Cancel all goals: every robot hovers (key: full stop)"
        if not client.refusal("stop_all"):
            ui.keyboard(self._key, repeating=False, ignore=["input", "textarea"])

    async def _key(self, event: KeyEventArguments) -> None:
        keys = event.modifiers
        if event.action.keydown and event.key == STOP_KEY and not (keys.ctrl or keys.meta):
            await self._stop()

    async def _stop(self) -> None:
        await self._client.call("stop_all")
