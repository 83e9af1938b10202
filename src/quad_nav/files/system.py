"""What Windows lacks, in one place: file locks, user numbers, and flags for opening files.

macOS has no ``/proc``. Whoever reads there asks first whether it exists.
"""

from __future__ import annotations

import os
from typing import Optional

try:
    import fcntl
except ImportError:
    fcntl = None  # type: ignore[assignment]

OPEN_FLAGS = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
AT_ONCE = getattr(os, "O_NONBLOCK", 0)
"""Opening a pipe does not wait for the other end."""


def lock(file: int) -> None:
    """Lock an open file for this process; Windows has no such lock.

    Raises:
        BlockingIOError: Another process has locked it.
    """
    if fcntl is not None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def user_number() -> Optional[int]:
    """Return the number of this user; on Windows None."""
    return os.geteuid() if hasattr(os, "geteuid") else None
