"""Mission of ``quad preview``: read, draw, write, or serve for editing."""

from __future__ import annotations

import sys
import webbrowser
from pathlib import Path
from typing import Any, List, Optional

from quad_nav.cli import EXIT_BAD_INPUT, EXIT_SUCCESS, add_ons
from quad_nav.cli.offline_flight import mission_options
from quad_nav.cli.options import echo, echo_lines, exit_on_faults, show_warnings
from quad_nav.cli.outputs import Outputs
from quad_nav.report.preview_page import page_data, preview_page
from quad_nav.report.preview_picture import SUFFIXES, write_picture
from quad_nav.scenario.preview import MissionPreview, RobotPreview

_DEFAULT_OUTPUT = Path("preview.png")


def show_mission(output: Optional[Path], open_it: bool, edit: bool, **given: Any) -> None:
    """Show a mission with the options of ``quad preview`` and exit with its status."""
    if output is None and not edit:
        output = _DEFAULT_OUTPUT
    with exit_on_faults("preview not made"):
        outputs = Outputs({}, {"--output": output}, suffixes={"--output": SUFFIXES})
        options = mission_options(**given)
        preview = MissionPreview(options)
        heading = title(preview, options.config)
        page: Any = None
        if edit:
            add_on = add_ons.load("quad_web.cli.goal_page", "--edit")
            page = add_on.GoalPage(options, preview, heading)
    robots = [preview.robot(number) for number in preview.numbers]
    _report(preview, robots)
    if output is not None and (preview.scene is not None or robots):
        with outputs.attempt("--output", output):
            _write(preview, robots, heading, output)
            echo(f"preview: {output}")
            if open_it and page is None:
                _open(output.resolve().as_uri())
    if page is not None:
        with exit_on_faults("preview not made"):
            page.serve(open_it)
        sys.exit(EXIT_SUCCESS)
    sys.exit(outputs.exit_status(EXIT_BAD_INPUT if preview.problems else EXIT_SUCCESS))


def title(preview: MissionPreview, config: str) -> str:
    """Return the heading of a mission's picture."""
    count = len(preview.numbers)
    scene = preview.scene.name if preview.scene else "no scene"
    return f"{scene}, {count} quadcopter{'s' * (count != 1)}, {Path(config).name}"


def _report(preview: MissionPreview, robots: List[RobotPreview]) -> None:
    """Print what ``quad fly`` refuses and warns about, and goals without a plan."""
    if preview.problems:
        echo_lines("quad fly refuses this mission:\n  " + "\n  ".join(preview.problems), err=True)
    show_warnings([*preview.warnings, *(line for one in robots for line in one.warnings)])


def _write(preview: MissionPreview, robots: List[RobotPreview], heading: str, output: Path) -> None:
    if output.suffix.lower() == ".html":
        from quad_nav.files.output import write_text

        write_text(output, preview_page(page_data(preview, robots, heading)))
    else:
        write_picture(preview, robots, heading, output)


def _open(address: str) -> None:
    if not webbrowser.open(address):
        echo(f"preview: no browser found; open {address}", err=True)
