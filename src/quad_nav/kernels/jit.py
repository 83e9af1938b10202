"""Compile kernels with numba, and cache the result where this user can write it.

``njit`` is numba's, with another cache. numba's own raises where neither the sources nor the home
can be written, when the disk is full, and when a cached file is damaged or refers to types of an
earlier version; and it does not notice that a kernel calls a changed kernel of another module.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Any, Callable, List, Optional, Tuple

import numba
from numba.core import caching
from numba.core.dispatcher import Dispatcher

import quad_nav
from quad_nav.files.cache_folder import require_writable, user_cache_folder

COMPILE_S = 30
"""Wall time, about, in which one core compiles the kernels of a flight."""
_SOURCES = Path(__file__).resolve().parent


def njit(cache: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function at its first call, as ``numba.njit`` does.

    Args:
        cache: Keep the result for later processes, if there is a place for it.
        options: Options of ``numba.njit``.
    """
    compiled = numba.njit(**options)

    def decorate(function: Callable[..., Any]) -> Any:
        kernel: Any = compiled(function)
        is_compiled = isinstance(kernel, Dispatcher)  # else NUMBA_DISABLE_JIT=1 is set
        if cache and FOLDER is not None and is_compiled:
            kernel._cache = KernelCache(function)
        return kernel

    return decorate


def cache_warnings() -> List[str]:
    """Return a line that says what it costs that nothing is cached, [] if kernels are cached."""
    if FOLDER is not None:
        return []
    return [
        f"kernels: no folder for compiled kernels can be written ({'; '.join(_PROBLEMS)}); each "
        f"process compiles them anew, which takes about {COMPILE_S} s; expected one of these, or "
        "NUMBA_CACHE_DIR with a folder of your own"
    ]


class _Locator(caching._SourceFileBackedLocatorMixin, caching._CacheLocator):
    """Location of a function's cached files, valid for the present sources of all kernels."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        self._py_file, self._lineno = py_file, py_func.__code__.co_firstlineno

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> _Locator:
        """Return the location without writing to it: ``_cache_folder`` has."""
        return cls(py_func, py_file)

    def get_cache_path(self) -> str:
        return str(FOLDER)

    def get_source_stamp(self) -> str:
        return _DIGEST


class _Results(caching.CompileResultCacheImpl):
    _locator_classes = [_Locator]


class KernelCache(caching.FunctionCache):
    """Cache of one kernel, of which no fault ends a flight: the kernel is compiled instead."""

    _impl_class = _Results

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the cached result for a signature, None without a usable one."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # pickle raises whatever a damaged file or a missing type leads to
            self._forget()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Cache a result, if the disk has space for it."""
        try:
            super().save_overload(sig, data)
        except OSError:
            self.disable()

    def _forget(self) -> None:
        """Empty the index, or do without the cache if it cannot be written."""
        try:
            self.flush()
        except OSError:
            self.disable()


def _cache_folder() -> Tuple[Optional[Path], List[str]]:
    """Return the folder of the cache, None if none can be written, and what is wrong with others.

    The first of: ``NUMBA_CACHE_DIR``; ``__pycache__`` beside the kernels, with the trust that the
    sources have; a folder of this user.
    """
    given = getattr(numba.config, "CACHE_DIR", "")
    problems = []
    for folder in ([Path(given)] if given else []) + [_SOURCES / "__pycache__"]:
        try:
            os.makedirs(folder, exist_ok=True)
            require_writable(folder)
        except OSError as error:
            problems.append(f"{folder}: {error.strerror or error}")
        else:
            return folder, problems
    name = hashlib.sha256(os.fsencode(_SOURCES)).hexdigest()[:12]  # of this installation
    own, others = user_cache_folder(name)
    return own, problems + others


def _digest() -> str:
    """Return a hash of everything that compiled kernels hold: they call each other."""
    digest = hashlib.sha256(quad_nav.__version__.encode())
    for path in [*sorted(_SOURCES.glob("*.py")), _SOURCES.parent / "grid.py"]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


FOLDER, _PROBLEMS = _cache_folder()
_DIGEST = _digest()
