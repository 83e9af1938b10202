"""Card over the arena with the result of a flight that has ended.

``data-testid``: ``result``, ``result-report``, ``result-json``, ``result-again``, ``result-close``.
"""

from __future__ import annotations

from typing import Any, List, Mapping, Optional, Tuple

from nicegui import ui

from quad_nav.errors import printable
from quad_web.page_client import PageClient
from quad_web.robot_panels import with_unit
from quad_web.view.result import REPORT, SUMMARY
from quad_web.view.state import Item


class ResultCard:
    """Success, goals, times and closest moments, with links; it can be closed."""

    def __init__(self, client: PageClient) -> None:
        self._client = client
        self._shown: Optional[Item] = None
        self._card = ui.element("section").classes("result").props("data-testid=result")
        self._card.props["aria-label"] = "Result of the flight"
        self._card.set_visibility(False)

    def refresh(self) -> None:
        """Show the item ``result`` if it is new, and nothing without one."""
        item = self._client.state.item("result")
        if item is self._shown:
            return
        self._shown = item
        self._card.clear()
        self._card.set_visibility(item is not None)
        if item is not None:
            with self._card:
                self._fill(item.data)

    def _fill(self, result: Mapping[str, Any]) -> None:
        is_success = result["is_success"]
        with ui.element("div").classes("card-head"):
            with ui.element("h2").classes("good" if is_success else "bad"):
                ui.label(f"Mission {'succeeded' if is_success else 'failed'}")
            ui.space()
            close = ui.button(icon="close", on_click=lambda: self._card.set_visibility(False))
            close.props("flat dense round size=sm data-testid=result-close aria-label=Close")
        if result["reason"]:
            ui.label(f"It ended early: {printable(result['reason'])}.")
        with ui.element("dl").classes("facts"):
            for name, text in _facts(result):
                with ui.element("div"):
                    with ui.element("dt"):
                        ui.label(name)
                    with ui.element("dd"):
                        ui.label(text)
        with ui.element("div").classes("actions"):
            self._make_links(result)

    def _make_links(self, result: Mapping[str, Any]) -> None:
        if result["report"]:
            ui.link("Report", REPORT, new_tab=True).props("data-testid=result-report")
        if result["summary"]:
            ui.link("Summary (JSON)", SUMMARY, new_tab=True).props("data-testid=result-json")
        if not result["report"]:
            ui.label(f"{result['hint']} writes a report").classes("muted")
        if not self._client.refusal("reset"):
            ui.space()
            is_recording = not self._client.refusal("seek")
            text = "Play again" if is_recording else "Fly again"
            again = ui.button(text, icon="restart_alt")
            again.on_click(lambda: self._client.call("reset"))
            again.props("outline dense no-caps data-testid=result-again")


def _facts(result: Mapping[str, Any]) -> List[Tuple[str, str]]:
    contacts, wall_s = result["contacts"], result["wall_time_s"]
    return [
        ("goals reached", f"{result['reached']} of {result['goals']}"),
        ("contacts", "–" if contacts is None else str(contacts)),
        ("time", f"{result['sim_time_s']:.1f} s"),
        ("least separation", with_unit(result["min_separation_m"], "m")),
        ("least clearance", with_unit(result["min_clearance_m"], "m")),
        ("wall time", "–" if wall_s is None else f"{wall_s:.1f} s"),
    ]
