"""Node `web`: serve a page that shows and steers the flight.

It needs NiceGUI, which is an extra. It is not required for the flight: without it, or after a
fault, the other nodes fly on.
"""

from __future__ import annotations

import sys
import threading
from pathlib import Path
from typing import Any, Dict, Mapping
from urllib.parse import urlsplit

import rospy

from quad_nav.errors import InputError, printable
from quad_nav.files.values import Rule, is_whole, value_faults
from quad_nav.ros.common.readiness import init_node, server_parameters
from quad_web.ros.actions import FlightActions
from quad_web.ros.source import FlightSource
from quad_web.server import Server, Urls, WebOptions
from quad_web.view.state import FleetState

EXIT_BAD_INPUT = 2
DEFAULTS: Dict[str, Any] = {
    "robots": 2,
    "port": 0,
    "address": "",  # loopback
    "steer_token": "",  # one is made up if the address is not loopback, as the next
    "watch_token": "",
}
_MAX_ROBOTS, _MAX_PORT = 1000, 65535
_TEXT = Rule(lambda value: isinstance(value, str), "a text")
_RULES = {
    "robots": Rule(
        lambda value: is_whole(value) and 1 <= value <= _MAX_ROBOTS,
        f"a whole number from 1 to {_MAX_ROBOTS}",
    ),
    "port": Rule(
        lambda value: is_whole(value) and 0 <= value <= _MAX_PORT,
        f"a whole number from 0 (any free port) to {_MAX_PORT}",
    ),
    **dict.fromkeys(("address", "steer_token", "watch_token"), _TEXT),
}
LOOPBACK = "127.0.0.1"


def main() -> int:
    """Run the node.

    Returns:
        0 after a shutdown, 2 if the parameters are not valid or NiceGUI is not installed.
    """
    init_node("web", hears_clock=False)
    values = {**DEFAULTS, **rospy.get_param("~", {})}
    try:
        faults = value_faults(values, _RULES, rospy.get_name().lstrip("/"))
        if faults:
            raise InputError(faults)
        _serve(values, server_parameters())
    except InputError as error:
        print(printable("\n".join(error.problems), "\n"), file=sys.stderr, flush=True)
        return EXIT_BAD_INPUT
    return 0


def _serve(values: Mapping[str, Any], tree: Mapping[str, Any]) -> None:
    """Show the flight until ROS shuts down.

    Raises:
        InputError: If NiceGUI is not installed, or the address cannot be listened on.
    """
    robots, state = values["robots"], FleetState()
    title = flight_title(tree, robots)
    source = FlightSource(state, robots, title)
    options = WebOptions(
        address=values["address"] or LOOPBACK,
        port=values["port"],
        steer_token=values["steer_token"],
        watch_token=values["watch_token"],
        title=title,
        on_ready=_announce,
    )
    server = Server(state, FlightActions(source, robots, goals_folder(tree)), options)
    # A node that is restarted after a fault has the same address; tools find it here.
    rospy.set_param("~port", urlsplit(server.urls.steer).port)
    source.start()
    rospy.on_shutdown(lambda: threading.Thread(target=server.stop, daemon=True).start())
    if not rospy.is_shutdown():
        server.start()
        server.wait()


def flight_title(tree: Mapping[str, Any], robots: int) -> str:
    """Return the name of the flight: its scene, and the number of robots."""
    simulator = tree.get("simulator")
    scene = simulator.get("scene") if isinstance(simulator, Mapping) else None
    name = Path(scene).stem if isinstance(scene, str) and scene else "flight"
    return f"{name}, {robots} quadcopter{'s' * (robots != 1)}"


def goals_folder(tree: Mapping[str, Any]) -> Path:
    """Return the folder of the mission's goal files; one that does not exist if there is none."""
    sequencer = tree.get("sequencer")
    folder = sequencer.get("goals") if isinstance(sequencer, Mapping) else None
    named = isinstance(folder, str) and folder not in ("", "random")
    return Path(str(folder)).expanduser() if named else Path("/nonexistent")


def _announce(urls: Urls) -> None:
    """Print the addresses, which may contain tokens: not into the log that all nodes hear."""
    lines = [f"quad: the page is at {urls.steer}"]
    if urls.watch != urls.steer:
        lines = [f"quad: page to steer: {urls.steer}", f"quad: page to watch: {urls.watch}"]
    print(printable("\n".join(lines), "\n"), flush=True)
