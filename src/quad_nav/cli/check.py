"""``quad check``: errors and warnings in move_base's YAML."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import List, Optional, Sequence, Tuple

import click

from quad_nav.cli import EXIT_BAD_INPUT, EXIT_SUCCESS
from quad_nav.cli.options import Integer, echo, echo_lines
from quad_nav.config.check import Report, check_files, check_source, counts, report_text
from quad_nav.config.files import COSTMAPS
from quad_nav.config.launch_file import is_launch_file
from quad_nav.config.sources import label, placed_file, split_source
from quad_nav.errors import InputError

EXIT_WARNINGS = 1
_NARROWEST, _WIDEST = 80, 100  # columns of tables


@click.command()
@click.argument("paths", nargs=-1, required=True, metavar="SOURCE | [COSTMAP=]FILE...")
@click.option(
    "--robot",
    type=Integer(min=0),
    metavar="N",
    help="Check the configuration of robot N: $(arg i) is N, and files with this number replace"
    " those without. Without the option every robot with its own files is checked.",
)
@click.option("--strict", is_flag=True, help="Exit with status 1 if there are warnings.")
def check(paths: Tuple[str, ...], robot: Optional[int], strict: bool) -> None:
    """Check move_base's YAML without flying: what `quad fly --config SOURCE` will do with it.

    A SOURCE is the name of a shipped configuration, a folder, a launch file, or FOLDER:NAME for one
    of the alternatives in a folder. Names and contents of a folder's files tell which belong
    together, subfolders included. FILEs are loaded in the order given. Name and content of a file
    decide its namespace; local_costmap=FILE and global_costmap=FILE set it.

    Exit status: 0 without errors, 1 for warnings with --strict, 2 for errors.
    """
    number = None if robot is None else str(robot)
    sources = [path for path in paths if _is_source(path)]
    files = [placed_file(path) for path in paths if not _is_source(path)]
    reports = [check_files(files, number)] if files else []
    unused: List[Path] = []
    empty: List[str] = []
    choices: List[str] = []
    for source in sources:
        try:
            found, left = check_source(source, number)
        except InputError as error:
            empty += error.problems
        else:
            reports += found
            unused += left
            choices += _choices(source, found)
    _show(reports, unused, choices, empty)
    sys.exit(EXIT_BAD_INPUT if empty else _exit_status(reports, strict))


def _is_source(word: str) -> bool:
    """False for a single file, which is loaded after the files before it."""
    path = Path(word).expanduser()
    if path.is_file():
        return is_launch_file(path)
    if path.is_dir():
        return True
    if word.partition("=")[0] in COSTMAPS:
        return False
    try:
        split_source(word)
    except InputError:  # a file that does not exist, or a misspelled name
        return not path.suffix and path.name == word
    return True


def _choices(source: str, reports: Sequence[Report]) -> List[str]:
    """Return what to write after --config for each of several sets."""
    path, _ = split_source(source)
    labels = dict.fromkeys(label(one.files, path) for one in reports)
    robots = {one.files.folder for one in reports if one.files.name.startswith("robot ")}
    if len(labels) < 2 or robots == {path} or is_launch_file(path):
        return []
    return [f"{path}:{one}" if one else str(path) for one in labels]


def _show(
    reports: Sequence[Report], unused: Sequence[Path], choices: Sequence[str], empty: Sequence[str]
) -> None:
    terminal = shutil.get_terminal_size((_WIDEST, 24)).columns
    width = max(_NARROWEST, min(terminal, _WIDEST))
    if reports:
        echo_lines("\n\n".join(report_text(report, width) for report in reports))
    if unused:
        echo("")
        echo("Not checked, no move_base parameters in: " + ", ".join(map(str, unused)))
    if len(reports) > 1:
        echo_lines(f"\n{len(reports)} configurations: {counts(reports)}")
    if choices:
        echo("To fly, choose one: --config " + " or --config ".join(choices))
    for line in empty:
        echo(line, err=True)


def _exit_status(reports: Sequence[Report], strict: bool) -> int:
    if any(report.errors for report in reports):
        return EXIT_BAD_INPUT
    if strict and any(report.warnings for report in reports):
        return EXIT_WARNINGS
    return EXIT_SUCCESS
