"""Command line ``quad``, with one module for each command.

A command's module is imported when the command runs, so none waits for unneeded imports. The list
of commands needs none of them.
"""

from __future__ import annotations

import difflib
import errno
import io
import os
import sys
from contextlib import contextmanager
from typing import Any, Dict, Iterator, List, Optional, Tuple

import click

import quad_nav
from quad_nav.cli import add_ons
from quad_nav.errors import printable

# The exit statuses of every command; 130 after Ctrl-C as from a shell.
EXIT_SUCCESS, EXIT_FAILURE, EXIT_BAD_INPUT, EXIT_INTERRUPTED = 0, 1, 2, 130

# Errors of a write to standard output; the commands handle those of their own files.
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)

COMMANDS: Dict[str, Tuple[str, str]] = {
    "fly": ("quad_nav", "Fly a mission without ROS, as fast as the machine allows."),
    "goals": ("quad_nav", "Convert other people's lists of waypoints to goal files."),
    "preview": ("quad_nav", "Show a mission before anything flies, and edit its goals."),
    "replay": ("quad_web", "Play a recorded flight on a page in the browser."),
    "report": ("quad_nav", "Write a report of a recorded flight, or compare several."),
    "check": ("quad_nav", "Check move_base's YAML without flying."),
    "sweep": ("quad_tune", "Compare flights over the values of some parameters."),
    "tune": ("quad_tune", "Search for parameters that fly better, without ROS."),
    "barn": ("quad_bench", "Fly through the worlds of the BARN benchmark without ROS."),
    "circle": ("quad_bench", "Let robots on a circle swap sides, beside ORCA."),
    "dynabarn": ("quad_bench", "Fly among the moving obstacles of DynaBARN without ROS."),
}
"""Name -> its package and its line in the list of commands. The module is `package.cli.name`."""
_HEADINGS = {
    "fly": "Mission",
    "replay": "Recorded flights",
    "check": "Parameters",
    "barn": "Benchmarks",
}
"""First command of each group -> heading of the group."""


@contextmanager
def _escaped_messages() -> Iterator[None]:
    """Escape the messages of click's own errors: they repeat arguments and file names."""
    try:
        yield
    except click.ClickException as error:
        shown: Any = error  # not every version of click lets its messages be set
        shown.message = printable(error.message)
        if isinstance(error, click.FileError):
            shown.ui_filename = printable(error.ui_filename)
        raise


class Commands(click.Group):
    """Finds the command ``name`` in the module of that name."""

    def make_context(self, *args: Any, **kwargs: Any) -> click.Context:
        """Parse the arguments before the command's name."""
        with _escaped_messages():
            return super().make_context(*args, **kwargs)

    def invoke(self, ctx: click.Context) -> Any:
        """Parse the arguments behind the command's name, and run the command.

        Ctrl-C during an import or a set-up, which the command does not handle, ends with 130.
        """
        try:
            with _escaped_messages():
                return super().invoke(ctx)
        except KeyboardInterrupt:
            print(printable("interrupted"), file=sys.stderr)
            ctx.exit(EXIT_INTERRUPTED)

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run the command line; end with a message if standard output is full.

        Characters that the terminal cannot show become "?".
        """
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="replace")
        try:
            return super().main(*args, **kwargs)
        except OSError as error:
            if error.filename is not None or error.errno not in _NO_SPACE:
                raise
            _discard_output()
            message = f"standard output: cannot be written: {error.strerror}"
            print(printable(message), file=sys.stderr)
            sys.exit(EXIT_FAILURE)

    def parse_args(self, ctx: click.Context, args: List[str]) -> List[str]:
        """Parse the arguments; without any, show the help as ``--help`` does."""
        return super().parse_args(ctx, args or ["--help"])

    def resolve_command(
        self, ctx: click.Context, args: List[str]
    ) -> Tuple[Optional[str], Optional[click.Command], List[str]]:
        """Find the command; name the nearest ones if it is unknown."""
        if args[0] not in COMMANDS and not args[0].startswith("-"):
            nearest = difflib.get_close_matches(args[0], COMMANDS, n=2)
            hint = (
                f"did you mean {' or '.join(map(repr, nearest))}?" if nearest else "see quad --help"
            )
            ctx.fail(f"no command {args[0]!r}; {hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands without importing their modules."""
        groups: Dict[str, List[Tuple[str, str]]] = {}
        heading, width = "", max(map(len, COMMANDS))
        for name, (_, line) in COMMANDS.items():
            heading = _HEADINGS.get(name, heading)
            groups.setdefault(heading, []).append((f"{name:{width}}", line))
        for heading, rows in groups.items():
            with formatter.section(heading):
                formatter.write_dl(rows)

    def list_commands(self, ctx: click.Context) -> List[str]:
        """Return the names of all commands."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> Optional[click.Command]:
        """Import a command; None if it is unknown.

        Raises:
            ClickException: Its add-on is not installed.
        """
        if cmd_name not in COMMANDS:
            return None
        package, _ = COMMANDS[cmd_name]
        module = add_ons.load(f"{package}.cli.{cmd_name}", f"quad {cmd_name}")
        command: click.Command = getattr(module, cmd_name)
        return command


def _discard_output() -> None:
    """Let Python's last flush of standard output succeed."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
    os.close(null)


@click.command(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="\b\nExample:\n  quad fly --report flight.html\n\nMore: README.md, docs/first_hour.md",
)
@click.version_option(quad_nav.__version__, prog_name="quad")
def main() -> None:
    """Fly quadcopters with the ROS navigation stack."""
