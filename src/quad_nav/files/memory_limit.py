"""An end to the memory that a file can ask for."""

from __future__ import annotations

import contextlib
import resource
from pathlib import Path
from typing import Iterator

_STATM = Path("/proc/self/statm")


@contextlib.contextmanager
def at_most_more(size_bytes: int) -> Iterator[None]:
    """Inside, whoever asks for that much more than there is gets a ``MemoryError``.

    It counts address space, and only where the system tells how much there is, on Linux.
    """
    if not _STATM.exists():
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    used = int(_STATM.read_text(encoding="ascii").split()[0]) * resource.getpagesize()
    limits = [used + size_bytes, *(one for one in (soft, hard) if one != resource.RLIM_INFINITY)]
    resource.setrlimit(resource.RLIMIT_AS, (min(limits), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
