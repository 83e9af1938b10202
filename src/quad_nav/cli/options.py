"""Option types, parameters and error handling that several commands share."""

from __future__ import annotations

import signal
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, Iterator, List, Mapping, Tuple

import click
import yaml

from quad_nav.cli import EXIT_BAD_INPUT, EXIT_FAILURE
from quad_nav.errors import InputError, QuadError, printable
from quad_nav.files import plain_yaml
from quad_nav.files.document import yaml_fault


class Integer(click.IntRange):
    """A range whose messages say "integer"; click's say "integer range"."""

    name = "integer"


class Number(click.FloatRange):
    """A range whose messages say "number"; click's say "float range"."""

    name = "number"


A_FILE = click.Path(dir_okay=False, path_type=Path)
A_PATH = click.Path(path_type=Path)
A_FOLDER = click.Path(file_okay=False, path_type=Path)
POSITIVE = Number(min=0.0, min_open=True)
AMOUNT = Number(min=0.0)
COUNT = Integer(min=1)
OUTPUT = click.Path(dir_okay=False, allow_dash=True, path_type=Path)
"""Type of an option whose text ``-`` sends to standard output."""
LOOPBACK = "127.0.0.1"
CONFIGURATIONS = (
    "'barn', 'default', 'localized', 'moving', 'people', 'tutorial', a folder, a YAML or launch"
    " file"
)
"""What ``--config`` takes; listing the shipped folder would slow every start of ``quad``."""


class GroupedCommand(click.Command):
    """Lists its options in groups.

    Args:
        headings: Name of the first parameter of each group -> heading of the group.
    """

    def __init__(self, *args: Any, headings: Mapping[str, str], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._headings = headings

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a section for each group."""
        groups: Dict[str, List[Tuple[str, str]]] = {}
        heading = "Options"
        for one in self.get_params(ctx):
            heading = self._headings.get(one.name or "", heading)
            record = one.get_help_record(ctx)
            if record is not None:
                groups.setdefault(heading, []).append(record)
        for heading, rows in groups.items():
            with formatter.section(heading):
                formatter.write_dl(rows)


def web_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options that say where a page is served."""
    for option in (
        click.option(
            "--open", "open_it", is_flag=True, help="Open the page in the browser of this machine."
        ),
        click.option(
            "--address",
            default=LOOPBACK,
            show_default=True,
            metavar="A",
            help="Serve the page on this address. Other machines need a token, which is printed as"
            " part of the page's address: one to steer, another one to watch.",
        ),
        click.option(
            "--port",
            type=Integer(0, 65535),
            default=0,
            metavar="N",
            help="Serve the page on this port. [default: the first free one from 8080 on]",
        ),
    ):
        command = option(command)
    return command


def parameter(text: str) -> Tuple[str, Any]:
    """Parse "global_costmap/width=60" to a path and a YAML value.

    Raises:
        InputError: The text has another form.
    """
    path, equals, value = text.partition("=")
    if not equals or not path.strip("/"):
        raise InputError(
            [f"--set {text}: expected PATH=VALUE, for example global_costmap/width=60"]
        )
    try:
        return path, plain_yaml.load(value)
    except yaml.YAMLError as error:
        raise InputError(
            [
                f"--set {text}: {value!r} is not YAML, expected a value as in a "
                f"parameter file: {yaml_fault(error)}"
            ]
        ) from error


def echo(line: object, err: bool = False) -> None:
    """Print one line; line ends within it are escaped, too."""
    click.echo(printable(line), err=err)


def echo_lines(text: str, err: bool = False) -> None:
    """Print a text of several lines, such as a table."""
    click.echo(printable(text, "\n"), err=err)


@contextmanager
def exit_on_faults(refused: str = "flight not started") -> Iterator[None]:
    """Exit the command with the status for the error, after printing a line per fault.

    Args:
        refused: What invalid input prevents, for the first line.
    """
    try:
        yield
    except InputError as error:
        echo_lines(f"{refused}, invalid input:\n  " + "\n  ".join(error.problems), err=True)
        sys.exit(EXIT_BAD_INPUT)
    except QuadError as error:
        echo_lines(str(error), err=True)
        sys.exit(EXIT_FAILURE)


def show_warnings(warnings: Iterable[str]) -> None:
    """Print the warnings of a set-up, and what a missing cache of the kernels costs."""
    from quad_nav.files.kernel_cache import cache_warnings  # here, because numba loads slowly

    for warning in (*warnings, *cache_warnings()):
        echo(warning, err=True)


def raise_on_signals() -> None:
    """Raise KeyboardInterrupt on SIGINT and SIGTERM.

    Python ignores SIGINT in the background jobs of a shell otherwise.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    signal.signal(signal.SIGINT, signal.default_int_handler)
