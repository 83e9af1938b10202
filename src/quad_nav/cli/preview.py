"""``quad preview``: show a mission before anything flies, and edit its goals."""

from __future__ import annotations

from typing import Any

import click

from quad_nav.cli import add_ons
from quad_nav.cli.fly import fly
from quad_nav.cli.options import A_FILE, GroupedCommand

_SHARED = ("scene", "goals", "config", "parameters", "robots", "size_m", "seed")
"""Options of ``quad fly`` that set what is flown."""


@click.command(
    cls=GroupedCommand,
    headings={"scene": "Mission", "output": "Output"},
    epilog="\b\nExample:\n  quad preview --scene office.yaml --goals my_goals/ -o mission.html"
    "\n\nMore: docs/preview.md",
)
@click.option(
    "--output",
    "-o",
    type=A_FILE,
    metavar="FILE",
    help="Write a picture (.png, .svg) or a page that can be zoomed (.html)."
    " [default: preview.png; none with --edit]",
)
@click.option("--open", "open_it", is_flag=True, help="Open the result in the browser.")
@click.option(
    "--edit",
    is_flag=True,
    help="Serve the mission on a page in the browser of this machine, where goals are dragged,"
    " added, removed and saved to the goal files. Ctrl-C ends it.",
)
def preview(**given: Any) -> None:
    """Show a mission before anything flies.

    The picture has the scene, the global costmap as after seeing all of the scene, start poses,
    goals, straight lines and global plans between them. Goals that quad fly refuses are red, with
    the reason. A goal that no plan leads to is warned about.

    Exit status: 0 if quad fly takes the mission, 1 if something cannot be written, 2 if quad fly
    refuses it; what can be shown is shown. With --edit 0 after Ctrl-C.
    """
    # Imported here: the engine and matplotlib load slowly, and --help does not need them.
    show_mission = add_ons.load("quad_nav.cli.mission_preview", "quad preview").show_mission

    show_mission(**given)


preview.params = [one for one in fly.params if one.name in _SHARED] + preview.params
