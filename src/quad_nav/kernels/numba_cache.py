"""Cache what numba compiles where this user can write it.

numba's own cache raises where neither the sources nor the home can be written, when the disk is
full, and when a cached file is damaged or refers to types of an earlier version; and it does not
notice that a kernel calls a changed kernel of another module.
"""

from __future__ import annotations

from typing import Any, Callable, List, Mapping

import numba
from numba.core import caching
from numba.core.dispatcher import Dispatcher

from quad_nav.kernels import library


def compile_with_numba(
    function: Callable[..., Any], cache: bool, options: Mapping[str, Any]
) -> Dispatcher:
    """Return numba's kernel of a function, which compiles at the first call with some types.

    Args:
        function: The kernel as Python.
        cache: Keep the result for later processes, if there is a place for it.
        options: Options of ``numba.njit``.
    """
    kernel: Any = numba.njit(**options)(function)
    if cache and library.FOLDER is not None:
        kernel._cache = KernelCache(function)
    return kernel


def compiled_overloads(kernel: Any) -> List[Any]:
    """Return numba's compile results of a kernel, in this process and in the cache.

    A kernel that only other kernels call is in the cache alone once those are.
    """
    found = {one.signature.args: one for one in kernel.overloads.values()}
    if isinstance(kernel._cache, KernelCache):
        for one in kernel._cache.load_all(kernel.targetctx):
            found.setdefault(one.signature.args, one)
    return list(found.values())


class _Locator(caching._SourceFileBackedLocatorMixin, caching._CacheLocator):
    """Location of a function's cached files, valid for the present sources of all kernels."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        self._py_file, self._lineno = py_file, py_func.__code__.co_firstlineno

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> _Locator:
        """Return the location without writing to it: ``find_cache_folder`` has."""
        return cls(py_func, py_file)

    def get_cache_path(self) -> str:
        return str(library.FOLDER)

    def get_source_stamp(self) -> str:
        return library.DIGEST


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

    def load_all(self, target_context: Any) -> List[Any]:
        """Return the results for all signatures that are cached."""
        signatures = {key[0] for key in self._cache_file._load_index()}
        found = (self.load_overload(one, target_context) for one in sorted(signatures, key=str))
        return [one for one in found if one is not None]

    def _forget(self) -> None:
        """Empty the index, or do without the cache if it cannot be written."""
        try:
            self.flush()
        except OSError:
            self.disable()
