"""Output files of a command: checked before it starts, and what happens if one fails at the end."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Callable, Iterator, List, Mapping, Optional, Sequence

from quad_nav.cli import EXIT_FAILURE
from quad_nav.cli.options import echo, echo_lines
from quad_nav.errors import InputError
from quad_nav.files.output import folder_faults, output_faults, reason, write_text

STDOUT = Path("-")
HTML = (".html", ".htm")
"""Suffixes of a report's name."""
_KINDS = {"--output": "report", "--animate": "animation"}

_Paths = Mapping[str, Optional[Path]]
_NONE: _Paths = {}


class Outputs:
    """Output files by their options; None where an option is not given.

    Args:
        texts: Texts, which may go to standard output, to devices and to pipes.
        files: Files that are read back while they are written.
        folders: Folders for several files.
        quiet: Do not say which files were written.
        suffixes: Those that the name of an option's file may have; devices and pipes have none.

    Attributes:
        has_failed: True after a file could not be written.

    Raises:
        InputError: A file or folder cannot be written, or its name suits another kind of file;
            lists all of them.
    """

    def __init__(
        self,
        texts: _Paths,
        files: _Paths = _NONE,
        folders: _Paths = _NONE,
        quiet: bool = False,
        suffixes: Mapping[str, Sequence[str]] = MappingProxyType({}),
    ) -> None:
        self._paths = {**texts, **files, **folders}
        self._quiet = quiet
        self.has_failed = False
        faults: List[str] = []
        for option, path in self._paths.items():
            if path is None or (path == STDOUT and option in texts):
                continue
            if option in folders:
                faults += folder_faults(path, option)
            else:
                faults += output_faults(path, option, any_kind=option in texts)
                known = suffixes.get(option, ())
                is_file = path.is_file() or not path.exists()
                if known and is_file and path.suffix.lower() not in known:
                    names = " or ".join(known)
                    faults.append(f"{option}: {path}: expected a name that ends in {names}")
        if faults:
            raise InputError(faults)

    @property
    def use_stdout(self) -> bool:
        """True if a text goes to standard output, and everything else to stderr."""
        return STDOUT in self._paths.values()

    def exit_status(self, status: int) -> int:
        """Return the command's exit status: a failed output is a failure."""
        return status or (EXIT_FAILURE if self.has_failed else status)

    def write(self, option: str, text: str) -> None:
        """Write the text of an option, if it is given; print it if that fails."""
        path = self._paths[option]
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

    def announce_file(self, option: str) -> None:
        """Say that the file of an option was written, if it is given."""
        path = self._paths[option]
        if path is not None:
            self.announce(option.lstrip("-"), path)

    def path(self, option: str) -> Optional[Path]:
        """Return the path of an option, None if it is not given."""
        return self._paths[option]

    def save(self, option: str, write: Callable[[Path], None], instead: str = "") -> Iterator[str]:
        """Write the output of an option with a function, if it is given, and yield a line."""
        path = self._paths[option]
        if path is not None:
            with self.attempt(option, path, instead):
                write(path)
                yield f"{_KINDS.get(option, option[2:])}: {path}"

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
