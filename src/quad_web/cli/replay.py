"""``quad replay``: play a recorded flight on a page in the browser."""

from __future__ import annotations

import sys
import threading
from pathlib import Path

import click

from quad_nav.cli import EXIT_BAD_INPUT
from quad_nav.cli.options import echo, echo_lines, raise_on_signals, web_options
from quad_nav.errors import InputError

_SOON_S = 0.5  # a file that is no flight is mostly refused within, and needs no page


@click.command()
@click.argument("flight", type=click.Path(path_type=Path))
@web_options
def replay(flight: Path, address: str, port: int, open_it: bool) -> None:
    """Play a recorded flight on a page in the browser.

    FLIGHT is a bag from quad fly --record or rosbag record. The page
    plays, pauses, and jumps to any time; it plays as soon as it is open. Ctrl-C ends it.

    Exit status: 0 after Ctrl-C, 2 for a file that cannot be read as a flight.
    """
    raise_on_signals()
    try:
        _play(flight, address, port, open_it)
    except InputError as error:
        echo_lines("no replay:\n  " + "\n  ".join(error.problems), err=True)
        sys.exit(EXIT_BAD_INPUT)
    except KeyboardInterrupt:
        pass


def _play(path: Path, address: str, port: int, open_it: bool) -> None:
    """Serve a recorded flight until a signal.

    Raises:
        InputError: The file cannot be read as a flight, or the page cannot be served.
    """
    # Imported here, because the readers load slowly, and --help does not need them.
    from quad_web.cli.flight_page import announce
    from quad_web.replay.replay import Replay
    from quad_web.server import Server, WebOptions, require_nicegui
    from quad_web.view.state import FleetState

    require_nicegui()
    echo(f"reading {path}", err=True)
    state = FleetState()
    player = Replay(path, state)
    server = Server(state, player, WebOptions(address=address, port=port, title=path.name))

    def run() -> None:
        player.run()
        server.stop()  # the file cannot be read, or not any more

    threading.Thread(target=run, name="player", daemon=True).start()
    try:
        player.is_read.wait(_SOON_S)
        if not player.faults:
            server.start()
            announce(server.urls, open_it)
            server.wait()
    except InputError:
        if not player.faults:  # else the server was stopped before it had started
            raise
    finally:
        player.close()
        server.stop()
    if player.faults:
        raise InputError(player.faults)
