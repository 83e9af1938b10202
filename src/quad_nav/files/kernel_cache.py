"""Compile kernels with numba, and keep the result for later processes.

numba's own check of a cached kernel covers the file of the kernel alone, but the compiled code also
holds the kernels and constants of other modules that it uses. So each state of a module, together
with the modules that it imports, has a folder of its own in the cache.

Source: numba, "Notes on Caching", cache sharing and limitations.
"""

from __future__ import annotations

import functools
import hashlib
import os
import re
import shutil
import tempfile
import threading
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Callable, Iterator, List, Optional, Set, Tuple

import numba

from quad_nav.files.cache_folder import require_writable, user_cache_folder

COMPILE_S = 60
"""Wall time, about, in which one core compiles the kernels of a flight."""
COMPILING = f"loading kernels; after an installation numba compiles them, {COMPILE_S} s on one core"
_LONG_S = 3.0  # loading the cache takes less on a machine that does nothing else
_THIS = Path(__file__).resolve()  # no part of a kernel
SOURCES = _THIS.parents[2]
_PACKAGE = SOURCES / "quad_nav"
_IMPORT = re.compile(r"^(?:from|import) (quad_[\w.]*)(?: import (\w+))?", re.MULTILINE)


def find_cache_folder() -> Tuple[Optional[Path], List[str]]:
    """Return the folder for compiled kernels, None if none can be written, and why not others.

    The first of: ``NUMBA_CACHE_DIR``; ``__pycache__`` beside the sources, with the trust that the
    sources have; a folder of this user, with a copy of what is compiled beside the sources.
    """
    given = os.environ.get("NUMBA_CACHE_DIR", "")
    problems = []
    beside = _PACKAGE / "__pycache__" / "kernels"
    for folder in ([Path(given)] if given else []) + [beside]:
        try:
            os.makedirs(folder, exist_ok=True)
            require_writable(folder)
        except OSError as error:
            problems.append(f"{folder}: {error.strerror or error}")
        else:
            return folder, problems
    name = hashlib.sha256(os.fsencode(_PACKAGE)).hexdigest()[:12]  # of this installation
    own, others = user_cache_folder(name)
    if own is not None and not given:
        _copy_kernels(beside, own)
    return own, problems + others


def _copy_kernels(source: Path, target: Path) -> None:
    """Copy each folder of kernels that is not there yet; other processes may do the same."""
    for folder in source.glob("*"):
        if not (target / folder.name).exists():
            with suppress(OSError), tempfile.TemporaryDirectory(dir=target) as part:
                copy = shutil.copytree(folder, Path(part) / folder.name)
                os.rename(copy, target / folder.name)


FOLDER, PROBLEMS = find_cache_folder()


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function at its first call, as ``numba.njit`` does with these options.

    ``cache=True`` is left out if no folder can be written.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        if FOLDER is None:
            return numba.njit(**{**options, "cache": False})(function)
        # catkin's development space imports the sources by a link, and numba's cache tells paths
        # apart.
        file = os.path.realpath(function.__code__.co_filename)
        function.__code__ = function.__code__.replace(co_filename=file)
        config: Any = numba.config
        given = config.CACHE_DIR
        config.CACHE_DIR = str(FOLDER / folder_name(Path(file)))
        try:
            return numba.njit(**options)(function)
        finally:
            config.CACHE_DIR = given

    return decorate


def folder_name(module: Path) -> str:
    """Return the name of the cache folder for the present sources of a module."""
    digest = hashlib.sha256()
    for path in sorted(sources_of(module)):
        digest.update(_content(path))
    return f"{module.stem}-{digest.hexdigest()[:16]}"


def sources_of(module: Path) -> Set[Path]:
    """Return the file of a module and of each module of ours that it imports at its top."""
    found: Set[Path] = set()
    left = [module]
    while left:
        path = left.pop()
        if path not in found:
            found.add(path)
            left += _imported(path)
    return found


@functools.lru_cache(maxsize=None)
def _content(path: Path) -> bytes:
    return path.read_bytes()


@functools.lru_cache(maxsize=None)
def _imported(path: Path) -> List[Path]:
    """Return the modules that a module imports; of a package, the first that it names."""
    found = []
    for module, name in _IMPORT.findall(_content(path).decode()):
        at = SOURCES.joinpath(*module.split("."))
        files = (at.with_suffix(".py"), at / f"{name}.py")
        found += [file for file in files if file.is_file() and file != _THIS]
    return found


@contextmanager
def announced(say: Callable[[], None]) -> Iterator[None]:
    """Call a function, such as one that prints ``COMPILING``, if the block takes long."""
    timer = threading.Timer(_LONG_S, say)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()


def cache_warnings() -> List[str]:
    """Return a line that says what it costs that nothing is cached, [] if kernels are cached."""
    if FOLDER is not None:
        return []
    return [
        f"kernels: no folder for compiled kernels can be written ({'; '.join(PROBLEMS)}); each "
        f"process compiles them anew, which takes about {COMPILE_S} s; expected one of these, or "
        "NUMBA_CACHE_DIR with a folder of your own"
    ]
