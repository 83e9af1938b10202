"""Compile kernels: from the library, or with numba.

``njit`` takes numba's place. A kernel in the library is called without numba, whose import takes
longer than all else that a node loads; it is imported when a kernel is called with types that the
library does not hold. Without a library, kernels are numba's own.
"""

from __future__ import annotations

import functools
import os
from typing import Any, Callable, List, Mapping

from quad_nav.kernels import library

COMPILE_S = 30
"""Wall time, about, in which one core compiles the kernels of a flight."""
_LIBRARY, _NO_LIBRARY = library.load_library()
_IS_DISABLED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
_numba_kernels: List[Any] = []
_missing: List[str] = []  # kernels that were called with types that the library does not hold


def njit(cache: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function at its first call, as ``numba.njit`` does.

    Args:
        cache: Keep the result for later processes, if there is a place for it.
        options: Options of ``numba.njit``.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        if _IS_DISABLED:
            return function
        if _LIBRARY is not None:
            name = f"{function.__module__}.{function.__qualname__}"
            return _LIBRARY.kernel(name, _LazyKernel(function, cache, options))
        kernel = _with_numba(function, cache, options)
        _numba_kernels.append(kernel)
        return kernel

    return decorate


def numba_kernels() -> List[Any]:
    """Return the kernels that numba compiles, in the order of their definition."""
    return [*_numba_kernels]


def cache_warnings() -> List[str]:
    """Return a line that says what it costs that nothing is cached, [] if kernels are cached."""
    if library.FOLDER is not None or _LIBRARY is not None:
        return []
    return [
        "kernels: no folder for compiled kernels can be written "
        f"({'; '.join(library.PROBLEMS)}); each process compiles them anew, which takes about "
        f"{COMPILE_S} s; expected one of these, or NUMBA_CACHE_DIR with a folder of your own"
    ]


def library_remarks() -> List[str]:
    """Return lines that say why numba is loaded, [] if all kernels are the library's."""
    if _IS_DISABLED:
        return []
    if _LIBRARY is None:
        return [
            f"kernels: no library of compiled kernels: {_NO_LIBRARY}; numba loads them, which "
            "takes about 1 s and 70 MB for each process"
        ]
    if not _missing:
        return []
    return [
        f"kernels: numba loads {', '.join(_missing)}: called with types that are not in the "
        "library of compiled kernels"
    ]


def _with_numba(function: Callable[..., Any], cache: bool, options: Mapping[str, Any]) -> Any:
    from quad_nav.kernels.numba_cache import compile_with_numba  # here: numba loads slowly

    return compile_with_numba(function, cache, options)


class _LazyKernel:
    """numba's kernel, made when it is called, or when numba compiles a kernel that calls it."""

    def __init__(
        self, function: Callable[..., Any], cache: bool, options: Mapping[str, Any]
    ) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self._options = (cache, options)

    def __call__(self, *args: Any, **keywords: Any) -> Any:
        name = self.py_func.__name__
        if name not in _missing:
            _missing.append(name)
        return self._kernel(*args, **keywords)

    @functools.cached_property
    def _kernel(self) -> Any:
        return _with_numba(self.py_func, *self._options)

    @property
    def _numba_type_(self) -> Any:
        """Numba's type of this kernel, for kernels that call it."""
        return self._kernel._numba_type_
