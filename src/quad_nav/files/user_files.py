"""Files that somebody else may have written: opened so that none of them can do harm.

A name may stand for a pipe that never ends, a device or a folder; a file may be larger
than the memory; a name that is written in one file may lead anywhere. ``docs/limits.md``
lists every limit.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO, List, Optional, Sequence

from quad_nav.errors import InputError

ALLOWED_FOLDERS = "QUAD_FILES_PATH"
"""Environment variable: folders that scene files may name files in, besides their own."""


def open_file(path: Path, most_bytes: Optional[int] = None) -> BinaryIO:
    """Opens a regular file of at most so many bytes for reading; what else it is, is refused
    at once, without waiting for it. Raises ``InputError``."""
    try:
        # Without O_NONBLOCK, opening a pipe waits for somebody to write to it.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except (OSError, ValueError) as error:  # ValueError: a name with a NUL in it
        why = getattr(error, "strerror", None) or error
        raise InputError([f"{path}: cannot be read: {why}; expected a file"]) from error
    status = os.fstat(descriptor)
    problem = ""
    if not stat.S_ISREG(status.st_mode):
        problem = f"is {_kind(status.st_mode)}; expected a file"
    elif most_bytes is not None and status.st_size > most_bytes:
        problem = f"has {status.st_size} bytes; expected {most_bytes} at most"
    if problem:
        os.close(descriptor)
        raise InputError([f"{path}: {problem}"])
    return os.fdopen(descriptor, "rb")


def read_bytes(path: Path, most_bytes: int) -> bytes:
    """The content of such a file, as ``open_file`` opens it. Raises ``InputError``."""
    try:
        with open_file(path, most_bytes) as file:
            content = file.read(most_bytes + 1)
    except OSError as error:
        raise InputError([f"{path}: cannot be read: {error.strerror}"]) from error
    if len(content) > most_bytes:  # it has grown since, or its size is not told, as in /proc
        raise InputError(
            [f"{path}: has more than {most_bytes} bytes; expected {most_bytes} at most"]
        )
    return content


def read_text(path: Path, most_bytes: int) -> str:
    """The same of a text in UTF-8, with or without a byte order mark."""
    try:
        return read_bytes(path, most_bytes).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError([f"{path}: byte {error.start} is not UTF-8; expected a text"]) from error


def named_in(folder: Path, name: str, also: Sequence[Path] = ()) -> Path:
    """The file that a file in ``folder`` calls ``name``.

    It has to be in that folder or below it, links followed, or in one that the user allows,
    in ``also`` or by the environment variable ``QUAD_FILES_PATH``. Raises ``InputError``.
    """
    path = folder / name
    try:
        target = path.resolve()
        roots = [root.resolve() for root in (folder, *also, *_allowed())]
    except (OSError, ValueError, RuntimeError) as error:  # a NUL, or links in a circle
        raise InputError([f"{path}: cannot be a file: {error}"]) from error
    if not any(root == target or root in target.parents for root in roots):
        raise InputError(
            [
                f"{path}: leads out of {folder}, to {target}; expected a file in that "
                f"folder, or its folder in {ALLOWED_FOLDERS}"
            ]
        )
    return path


def _allowed() -> List[Path]:
    return [
        Path(folder) for folder in os.environ.get(ALLOWED_FOLDERS, "").split(os.pathsep) if folder
    ]


def _kind(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "a folder"
    return "a pipe" if stat.S_ISFIFO(mode) else "a device or socket"
