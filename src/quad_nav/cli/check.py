"""``quad check``: errors and warnings in move_base's YAML."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import List, Optional, Sequence, Tuple

import click

from quad_nav.cli import EXIT_BAD_INPUT, EXIT_SUCCESS
from quad_nav.cli.options import echo, echo_lines
from quad_nav.config.check import Report, check_files, check_folder, counts, report_text
from quad_nav.config.files import PlacedFile
from quad_nav.errors import InputError

EXIT_WARNINGS = 1
_NARROWEST, _WIDEST = 80, 100  # columns of tables
_COSTMAPS = ("global_costmap", "local_costmap")


@click.command()
@click.argument("paths", nargs=-1, required=True, metavar="FOLDER | [COSTMAP=]FILE...")
@click.option(
    "--robot",
    type=click.IntRange(min=0),
    metavar="N",
    help="Check the configuration of robot N: $(arg i) is N, and files with this number replace"
    " those without. Without the option every robot with its own files is checked.",
)
@click.option("--strict", is_flag=True, help="Exit with status 1 if there are warnings.")
def check(paths: Tuple[str, ...], robot: Optional[int], strict: bool) -> None:
    """Check move_base's YAML without flying.

    A FOLDER has the layout of this package's config/default or any other: names and contents tell
    which files belong together, subfolders included. FILEs are loaded in the order given. Name and
    content of a file decide its namespace; local_costmap=FILE and global_costmap=FILE set it.

    Exit status: 0 without errors, 1 for warnings with --strict, 2 for errors.
    """
    number = None if robot is None else str(robot)
    folders = [Path(path) for path in paths if Path(path).is_dir()]
    files = [_placed(path) for path in paths if not Path(path).is_dir()]
    reports = [check_files(files, number)] if files else []
    unused: List[Path] = []
    empty: List[str] = []
    for folder in folders:
        try:
            found, left = check_folder(folder, number)
        except InputError as error:
            empty += error.problems
        else:
            reports += found
            unused += left
    _show(reports, unused, empty)
    sys.exit(EXIT_BAD_INPUT if empty else _exit_status(reports, strict))


def _show(reports: Sequence[Report], unused: Sequence[Path], empty: Sequence[str]) -> None:
    terminal = shutil.get_terminal_size((_WIDEST, 24)).columns
    width = max(_NARROWEST, min(terminal, _WIDEST))
    echo_lines("\n\n".join(report_text(report, width) for report in reports))
    if unused:
        echo("")
        echo("Not checked, no move_base parameters in: " + ", ".join(map(str, unused)))
    if len(reports) > 1:
        echo_lines(f"\n{len(reports)} configurations: {counts(reports)}")
    for line in empty:
        echo(line, err=True)


def _placed(word: str) -> PlacedFile:
    """A file, or a costmap's name, "=" and a file."""
    namespace, equals, name = word.partition("=")
    if equals and namespace in _COSTMAPS:
        return PlacedFile(Path(name), (namespace,))
    return PlacedFile(Path(word), ())


def _exit_status(reports: Sequence[Report], strict: bool) -> int:
    if any(report.errors for report in reports):
        return EXIT_BAD_INPUT
    if strict and any(report.warnings for report in reports):
        return EXIT_WARNINGS
    return EXIT_SUCCESS
