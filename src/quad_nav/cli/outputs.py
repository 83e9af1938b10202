"""Output files of a command: checked before it starts, and what happens if one fails at the end."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import Iterator, List, Mapping, Optional

from quad_nav.cli import EXIT_FAILURE
from quad_nav.cli.options import echo, echo_lines
from quad_nav.errors import InputError
from quad_nav.files.output import folder_faults, output_faults, reason, write_text

STDOUT = Path("-")

_Paths = Mapping[str, Optional[Path]]
_NONE: _Paths = {}


class Outputs:
    """Output files by their options; None where an option is not given.

    Args:
        texts: Texts, which may go to standard output, to devices and to pipes.
        files: Files that are read back while they are written.
        folders: Folders for several files.
        quiet: Do not say which files were written.

    Attributes:
        has_failed: True after a file could not be written.

    Raises:
        InputError: A file or folder cannot be written; lists all of them.
    """

    def __init__(
        self,
        texts: _Paths,
        files: _Paths = _NONE,
        folders: _Paths = _NONE,
        quiet: bool = False,
    ) -> None:
        self._texts, self._files, self._quiet = texts, files, quiet
        self.has_failed = False
        faults: List[str] = []
        for option, path in texts.items():
            faults += output_faults(path, option) if path not in (None, STDOUT) else []
        for option, path in files.items():
            faults += output_faults(path, option, any_kind=False) if path is not None else []
        for option, path in folders.items():
            faults += folder_faults(path, option) if path is not None else []
        if faults:
            raise InputError(faults)

    @property
    def use_stdout(self) -> bool:
        """True if a text goes to standard output, and everything else to stderr."""
        return STDOUT in self._texts.values()

    def exit_status(self, status: int) -> int:
        """Return the command's exit status: a failed output is a failure."""
        return status or (EXIT_FAILURE if self.has_failed else status)

    def write(self, option: str, text: str) -> None:
        """Write the text of an option, if it is given; print it if that fails."""
        path = self._texts[option]
        if path == STDOUT:
            echo_lines(text)
        elif path is not None:
            with self.attempt(option, path, text):
                write_text(path, text + "\n")
                self.announce(option.lstrip("-"), path)

    def announce(self, kind: str, path: Path) -> None:
        """Say that an output was written."""
        if not self._quiet:
            echo(f"{kind}: {path}", err=True)

    def announce_files(self, *options: str) -> None:
        """Say that the files of these options were written, if they are given."""
        for option in options:
            path = self._files.get(option)
            if path is not None:
                self.announce(option.lstrip("-"), path)

    @contextmanager
    def attempt(self, option: str, path: Path, instead: str = "") -> Iterator[None]:
        """Report that writing failed inside, and print ``instead`` to standard output."""
        try:
            yield
        except OSError as error:
            self.has_failed = True
            then = "printing the result instead" if instead else "an earlier file stays as it is"
            echo(f"{option}: {path}: cannot be written: {reason(error)}; {then}", err=True)
            if instead:
                echo_lines(instead)
