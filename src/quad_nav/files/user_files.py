"""Open files of unknown origin so that none of them can do harm.

A name may stand for a pipe that never ends, a device or a folder; a file may be larger than the
memory; a name that is written in a file may lead anywhere. ``docs/limits.md`` lists every limit.
"""

from __future__ import annotations

import contextlib
import os
import stat
from pathlib import Path
from typing import Any, BinaryIO, Callable, Iterator, List, Optional, Sequence, TypeVar

from quad_nav.errors import InputError
from quad_nav.files.system import AT_ONCE, OPEN_FLAGS

ALLOWED_FOLDERS = "QUAD_FILES_PATH"
"""Environment variable: folders that scene files may name files in, besides their own."""
Result = TypeVar("Result")
_STATM = Path("/proc/self/statm")


def open_file(path: Path, max_bytes: Optional[int] = None) -> BinaryIO:
    """Open a regular file of at most ``max_bytes`` for reading.

    Anything that is not a regular file is refused at once, without waiting for it.

    Raises:
        InputError: The file cannot be read, is no regular file, or is too large.
    """
    try:
        # Without AT_ONCE, opening a pipe waits for a writer.
        descriptor = os.open(path, os.O_RDONLY | AT_ONCE | OPEN_FLAGS)
    except (OSError, ValueError) as error:  # ValueError: a name with a NUL in it
        why = getattr(error, "strerror", None) or error
        raise InputError([f"{path}: cannot be read: {why}; expected a file"]) from error
    status = os.fstat(descriptor)
    problem = ""
    if not stat.S_ISREG(status.st_mode):
        problem = f"is {_file_type(status.st_mode)}; expected a file"
    elif max_bytes is not None and status.st_size > max_bytes:
        problem = f"has {status.st_size} bytes; expected {max_bytes} at most"
    if problem:
        os.close(descriptor)
        raise InputError([f"{path}: {problem}"])
    return os.fdopen(descriptor, "rb")


def read_bytes(path: Path, max_bytes: int) -> bytes:
    """Read a file of at most ``max_bytes``.

    Raises:
        InputError: As ``open_file``.
    """
    try:
        with open_file(path, max_bytes) as file:
            content = file.read(max_bytes + 1)
    except OSError as error:
        raise InputError([f"{path}: cannot be read: {error.strerror}"]) from error
    if len(content) > max_bytes:  # it has grown since, or reports no size, as files in /proc
        raise InputError([f"{path}: has more than {max_bytes} bytes; expected {max_bytes} at most"])
    return content


def read_text(path: Path, max_bytes: int) -> str:
    """Read a text in UTF-8, with or without a byte order mark, of at most ``max_bytes``.

    Raises:
        InputError: As ``open_file``, or the text is not UTF-8.
    """
    try:
        return read_bytes(path, max_bytes).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError([f"{path}: byte {error.start} is not UTF-8; expected a text"]) from error


def referenced_file(folder: Path, name: str, also: Sequence[Path] = ()) -> Path:
    """Path of the file that a file in ``folder`` refers to as ``name``.

    Args:
        folder: Folder of the file that refers to it.
        name: Relative or absolute path.
        also: Further folders in which the file may be.

    Raises:
        InputError: The file, links followed, is neither below ``folder`` nor below one of
            ``also`` or of the environment variable ``QUAD_FILES_PATH``.
    """
    path = folder / name
    try:
        target = path.resolve()
        roots = [root.resolve() for root in (folder, *also, *_allowed_folders())]
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


@contextlib.contextmanager
def outside_current_folder() -> Iterator[None]:
    """Start Python processes inside that must not run the files of the current folder.

    A new interpreter has the folder in which it starts on its path, and would import a ``yaml.py``
    there. multiprocessing and joblib then give it the path of this process; with ``in_folder`` it
    comes back.
    """
    folder = os.getcwd()
    os.chdir(os.sep)
    try:
        yield
    finally:
        os.chdir(folder)


def in_folder(folder: str, function: Callable[..., Result], *arguments: Any) -> Result:
    """Call a function in a folder, in a process that was started elsewhere."""
    os.chdir(folder)
    return function(*arguments)


@contextlib.contextmanager
def limit_memory(size_bytes: int) -> Iterator[None]:
    """Raise ``MemoryError`` inside when more than ``size_bytes`` are allocated on top.

    The limit counts address space. It applies only where the system reports its use, on Linux.
    """
    if not _STATM.exists():
        yield
        return
    import resource  # not on Windows

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    used = int(_STATM.read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    limits = [used + size_bytes, *(one for one in (soft, hard) if one != resource.RLIM_INFINITY)]
    resource.setrlimit(resource.RLIMIT_AS, (min(limits), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _allowed_folders() -> List[Path]:
    return [
        Path(folder) for folder in os.environ.get(ALLOWED_FOLDERS, "").split(os.pathsep) if folder
    ]


def _file_type(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "a folder"
    return "a pipe" if stat.S_ISFIFO(mode) else "a device or socket"
