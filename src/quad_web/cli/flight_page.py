"""The page of ``quad fly --web``: its server, and the people on it between two flights."""

from __future__ import annotations

import time
import webbrowser
from pathlib import Path
from typing import Callable, List, Optional

from quad_nav.cli.options import echo
from quad_nav.mission.summary import MissionSummary, to_json
from quad_nav.offline.flight import FlightObserver
from quad_web.offline.actions import STARTED_AGAIN, FlightActions
from quad_web.offline.view import WebView
from quad_web.process import Batch, ServerProcess
from quad_web.server import Urls, WebOptions
from quad_web.view.result import result_item

_HINT = "quad fly --web --report FILE.html"
_LOOKS_EVERY_S = 0.2
_TAKES_WITHIN_S = 5.0


class FlightPage:
    """The page, served until ``close``.

    Raises:
        InputError: NiceGUI is not installed, or the address cannot be listened on.
    """

    def __init__(self, address: str, port: int, rate: float, open_it: bool) -> None:
        self._actions = FlightActions(rate)
        options = WebOptions(address=address, port=port, title="quad fly")
        self._process = ServerProcess(options, FlightActions.available)
        announce(self._process.urls, open_it)

    @property
    def interventions(self) -> List[str]:
        """What people did in the last flight."""
        return self._actions.done

    def observer(self) -> FlightObserver:
        """Return what shows the next flight."""
        return WebView(self._process, self._actions)

    def show_result(self, summary: MissionSummary, report: Optional[Path]) -> None:
        """Show how the last flight has ended, and its report."""
        end_s = time.monotonic() + _TAKES_WITHIN_S
        while self._process.is_alive and not self._process.can_take and time.monotonic() < end_s:
            self._process.wait(_LOOKS_EVERY_S)
        if self._process.can_take:
            self._process.send(Batch([result_item(to_json(summary), _HINT, report)]))

    def wants_flight(self, is_interrupted: Callable[[], bool]) -> bool:
        """Wait until people want another flight; false after Ctrl-C, or if the server has ended."""
        while self._actions.stop_reason != STARTED_AGAIN:
            if not self._process.is_alive:
                echo("page: its server has ended", err=True)
                return False
            if is_interrupted():
                return False
            self._process.wait(_LOOKS_EVERY_S)
            self._process.serve(self._actions)
        return True

    def close(self) -> None:
        """End the server."""
        self._process.close()


def announce(urls: Urls, open_it: bool) -> None:
    """Print where the page is, and open it."""
    if urls.watch == urls.steer:
        echo(f"page: {urls.steer}", err=True)
    else:
        echo(f"page, to steer: {urls.steer}", err=True)
        echo(f"page, to watch: {urls.watch}", err=True)
    if open_it and not webbrowser.open(urls.steer):
        echo(f"--open: no browser found; open {urls.steer}", err=True)
