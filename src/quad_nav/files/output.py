"""Write output files: checked before the work, complete or not at all.

``output_faults`` is for the time before a flight, ``replacing`` and ``write_text`` are for the time
after it. Missing folders are made, except directly in ``/``: there a missing folder is a
spelling mistake, or a disk that is not mounted.
"""

from __future__ import annotations

import contextlib
import os
import stat
from pathlib import Path
from typing import Iterator, List

from quad_nav.files.system import AT_ONCE, OPEN_FLAGS

_PROBE = bytes(4096)  # a block: on a full disk an empty file can still be made
_LONGEST_STEM = 200  # characters of the name that the partial file's name has


def output_faults(path: Path, source: str, any_kind: bool = True) -> List[str]:
    """Return why a file could not be written, as one line, [] if it can be.

    Nothing is left behind. The content of an existing file stays.

    Args:
        path: The file.
        source: Name of the option or parameter, which starts the line.
        any_kind: Whether the file may also be a device or a pipe.
    """
    try:
        _try(path, any_kind)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        expected = "a file that can be written"
        return [f"{source}: {path}: cannot be written: {reason(error)}; expected {expected}"]
    return []


def folder_faults(path: Path, source: str) -> List[str]:
    """Return why files could not be written into a folder, as one line, [] if they can be.

    A missing folder is not made yet. Arguments as for ``output_faults``.
    """
    try:
        _probe(_existing_folder(path) / f".{os.getpid()}.partial")
    except (OSError, ValueError) as error:
        expected = "a folder that can be written"
        return [f"{source}: {path}: cannot be written: {reason(error)}; expected {expected}"]
    return []


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give the path of a new file beside ``path``, which replaces it at the end.

    If anything is raised inside, the new file is removed and ``path`` stays as it is. A device or a
    pipe is written itself.

    Raises:
        OSError: The file cannot be written.
    """
    target = path.resolve()  # a link stays a link
    if _is_special(target):
        yield target
        return
    make_folder(target.parent)
    partial = _partial(target)
    try:
        yield partial
        _sync(partial)
        os.replace(partial, target)
    finally:
        with contextlib.suppress(FileNotFoundError):
            partial.unlink()


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8; a reader sees all of it or none of it.

    Characters that no UTF-8 has, of names of files that are not UTF-8, become "?".

    Raises:
        OSError: The file cannot be written.
    """
    write_bytes(path, text.encode("utf-8", "replace"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file; a reader sees all of it or none of it.

    Raises:
        OSError: The file cannot be written.
    """
    with replacing(path) as partial:
        partial.write_bytes(content)


def make_folder(folder: Path) -> None:
    """Make a folder and those above it, but none directly in ``/``.

    Raises:
        OSError: It cannot be made.
    """
    _existing_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)


def reason(error: Exception) -> str:
    """Return what the system says about an error, without the path."""
    return getattr(error, "strerror", None) or str(error)


def _try(path: Path, any_kind: bool) -> None:
    target = path.resolve()
    if target.is_dir():
        raise IsADirectoryError(None, "is a folder")
    if _is_special(target):
        if not any_kind:
            raise OSError(None, "is a device or a pipe")
        # Without AT_ONCE, opening a pipe waits for a reader.
        os.close(os.open(target, os.O_WRONLY | AT_ONCE | OPEN_FLAGS))
        return
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError(None, "is write-protected")
    _probe(_existing_folder(target.parent) / _partial(target).name)


def _probe(partial: Path) -> None:
    try:
        partial.write_bytes(_PROBE)
    finally:
        with contextlib.suppress(OSError):
            partial.unlink()


def _existing_folder(folder: Path) -> Path:
    """Return the folder, or the nearest one above it that exists."""
    folder = folder.resolve()
    existing = next(one for one in (folder, *folder.parents) if one.exists())
    if not existing.is_dir():
        raise NotADirectoryError(None, f"{existing} is not a folder")
    if existing != folder and existing == Path(folder.anchor):
        raise FileNotFoundError(None, f"there is no folder {existing / folder.parts[1]}")
    return existing


def _is_special(path: Path) -> bool:
    """True for a device, a pipe or a socket."""
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return False
    return not stat.S_ISREG(mode) and not stat.S_ISDIR(mode)


def _partial(path: Path) -> Path:
    return path.with_name(f"{path.name[:_LONGEST_STEM]}.{os.getpid()}.partial")


def _sync(path: Path) -> None:
    """Wait for the disk: some file systems find only then that it is full."""
    file = os.open(path, os.O_RDWR | OPEN_FLAGS)
    try:
        os.fsync(file)
    finally:
        os.close(file)
