"""The page of ``quad preview --edit``."""

from __future__ import annotations

from quad_nav.cli.options import echo, raise_on_signals
from quad_nav.errors import InputError
from quad_nav.files.output import output_faults
from quad_nav.scenario.flight_setup import FlightOptions
from quad_nav.scenario.preview import MissionPreview
from quad_web.cli.flight_page import announce
from quad_web.offline.waiting_mission import WaitingMission
from quad_web.server import Server, WebOptions, require_nicegui
from quad_web.view.state import FleetState


class GoalPage:
    """Serves a mission whose goals are edited, to this machine alone.

    Raises:
        InputError: NiceGUI is not installed, or there are no goal files that can be edited.
    """

    def __init__(self, options: FlightOptions, preview: MissionPreview, title: str) -> None:
        """Check that there is something to edit; ``preview`` is what the options say, read."""
        require_nicegui()
        if not preview.files:
            raise InputError(
                ["--edit: this mission has no goal files; expected --goals FOLDER with some"]
            )
        paths = [preview.files[number] for number in preview.numbers if number in preview.files]
        faults = [fault for path in paths for fault in output_faults(path, "--edit", False)]
        if not paths or faults:
            raise InputError(faults or list(preview.problems))
        self._options, self._title = options, title

    def serve(self, open_it: bool) -> None:
        """Serve the page until Ctrl-C or SIGTERM; ``open_it`` opens it in the browser.

        Raises:
            InputError: It cannot be served.
        """
        raise_on_signals()
        state = FleetState()
        mission = WaitingMission(self._options, self._title, state)
        server = Server(state, mission, WebOptions(title=f"quad preview: {self._title}"))
        try:
            server.start()
            announce(server.urls, open_it)
            server.wait()
        except KeyboardInterrupt:
            echo("page: ended", err=True)
        finally:
            server.stop()
