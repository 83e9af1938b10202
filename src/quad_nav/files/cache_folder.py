"""Find a folder for files that are programs to whoever reads them, such as compiled kernels.

Who can write there runs code as the reader, so the folder belongs to the user alone. A folder
below a shared one, such as ``/tmp``, has a name that others can guess and make first: it is used
only if it belongs to this user, is closed to all others, and cannot be replaced by them.
"""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path
from typing import Iterator, List, Optional, Tuple

from quad_nav.files.system import user_number

_OPEN_TO_OTHERS = 0o077
_NAME = "quad-nav"


def user_cache_folder(name: str) -> Tuple[Optional[Path], List[str]]:
    """Make the folder ``name`` of this user for cached files.

    It is below ``$XDG_CACHE_HOME`` or ``~/.cache``, or otherwise below the folder of temporary
    files.

    Returns:
        The folder, None if there is none; and why each other place cannot be used.
    """
    problems = []
    for place in _places():
        try:
            _make_private(place)
            folder = place / name
            folder.mkdir(mode=0o700, exist_ok=True)
            require_writable(folder)
        except OSError as error:
            problems.append(f"{place}: {error.strerror or error}")
        else:
            return folder, problems
    return None, problems


def require_writable(folder: Path) -> None:
    """Write a file without a name into a folder.

    Raises:
        OSError: The folder does not exist or cannot be written.
    """
    tempfile.TemporaryFile(dir=folder).close()


def _places() -> Iterator[Path]:
    """The user's own cache folder, if there is a home, and one for temporary files."""
    given = os.environ.get("XDG_CACHE_HOME", "")
    home = Path(os.path.expanduser("~"))
    if os.path.isabs(given):  # the specification ignores relative paths
        yield Path(given) / _NAME
    elif home.is_absolute():
        yield home / ".cache" / _NAME
    try:
        yield Path(tempfile.gettempdir()) / f"{_NAME}-{user_number()}"
    except FileNotFoundError:
        return  # no folder for temporary files can be written


def _make_private(folder: Path) -> None:
    """Make a folder that only this user can open, or check one that exists.

    A missing home is not made: it is a service user's ``/nonexistent``.

    Raises:
        OSError: It cannot be made, or others could put files into it.
    """
    parent = folder.parent
    if not parent.exists() and parent.parent != Path(parent.anchor):
        parent.mkdir(mode=0o700)
    try:
        folder.mkdir(mode=0o700)
    except FileExistsError:
        pass
    user = user_number()
    if user is None:  # Windows, where the folders of a user are private
        return
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode):
        raise OSError(None, "is no folder")
    if found.st_uid != user:
        raise OSError(None, f"belongs to user {found.st_uid}, not to this user")
    if found.st_mode & _OPEN_TO_OTHERS:
        raise OSError(None, "is open to other users; expected the mode 0700")
    for above in folder.resolve().parents:
        if _is_replaceable(above.stat(), user):
            raise OSError(None, f"is below {above}, where other users can replace it")


def _is_replaceable(above: os.stat_result, user: int) -> bool:
    """True if others than this user and root can rename what is in a folder."""
    if above.st_uid not in (0, user):
        return True
    return bool(above.st_mode & stat.S_IWOTH) and not above.st_mode & stat.S_ISVTX
