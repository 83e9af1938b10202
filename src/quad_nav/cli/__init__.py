"""Command line ``quad``, with one module for each command.

A command's module is imported when the command runs, so none waits for unneeded imports.
"""

from __future__ import annotations

import errno
import importlib
import io
import os
import sys
from contextlib import contextmanager
from typing import Any, Iterator, List, Optional

import click

import quad_nav
from quad_nav.errors import printable

# The exit statuses of every command; 130 after Ctrl-C as from a shell.
EXIT_SUCCESS, EXIT_FAILURE, EXIT_BAD_INPUT, EXIT_INTERRUPTED = 0, 1, 2, 130

# Errors of a write to standard output; the commands handle those of their own files.
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)

COMMANDS = ("barn", "check", "fly", "report", "sweep", "tune")


@contextmanager
def _escaped_messages() -> Iterator[None]:
    """Escape the messages of click's own errors: they repeat arguments and file names."""
    try:
        yield
    except click.ClickException as error:
        error.message = printable(error.message)  # type: ignore[misc]
        if isinstance(error, click.FileError):
            error.ui_filename = printable(error.ui_filename)  # type: ignore[misc]
        raise


class Commands(click.Group):
    """Finds the command ``name`` in the module of that name."""

    def make_context(self, *args: Any, **kwargs: Any) -> click.Context:
        """Parse the arguments before the command's name."""
        with _escaped_messages():
            return super().make_context(*args, **kwargs)

    def invoke(self, ctx: click.Context) -> Any:
        """Parse the arguments behind the command's name, and run the command."""
        with _escaped_messages():
            return super().invoke(ctx)

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

    def list_commands(self, ctx: click.Context) -> List[str]:
        """Return the names of all commands."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> Optional[click.Command]:
        """Import a command; None if it is unknown."""
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f"{__name__}.{cmd_name}")
        command: click.Command = getattr(module, cmd_name)
        return command


def _discard_output() -> None:
    """Let Python's last flush of standard output succeed."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
    os.close(null)


@click.command(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(quad_nav.__version__, prog_name="quad")
def main() -> None:
    """Fly quadcopters with the ROS navigation stack."""
