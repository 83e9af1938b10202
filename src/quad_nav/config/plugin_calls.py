"""Calls of plugins: an error, or a result of the wrong kind, is a ``PluginError`` with its line.

Otherwise a mistake in a user's class would end in a traceback of this package, or much later where
a wrong result is used.
"""

from __future__ import annotations

import functools
import math
import sys
import traceback
from pathlib import Path
from typing import Any, Callable, Dict, Optional, Tuple, Type

import numpy as np

from quad_nav.control.controller import Control
from quad_nav.costmap.cost_grid import Bounds
from quad_nav.costmap.scan_filter import FilteredScan
from quad_nav.errors import ControlError, InputError, PlanningError, PluginError
from quad_nav.geometry import Twist2D
from quad_nav.navigator.command_filter import Command
from quad_nav.recovery import Step

_ALLOWED: Dict[str, Tuple[Type[Exception], ...]] = {
    "__init__": (InputError,),
    "make_plan": (PlanningError,),
    "compute_velocity": (ControlError,),
}
"""Errors that a plugin raises on purpose, by method."""


def call_constructor(plugin_class: Any, methods_of: type, *arguments: Any) -> Any:
    """Make an object of a plugin's class whose methods are guarded.

    ``methods_of`` is the class or protocol with the methods that this package calls.

    Raises:
        InputError: The constructor refuses its parameters.
        PluginError: The constructor fails otherwise.
    """
    make = _guarded(plugin_class, "__init__", _guarded_class(plugin_class, methods_of))
    return make(*arguments)


@functools.lru_cache(maxsize=None)
def _guarded_class(plugin_class: Any, methods_of: type) -> Any:
    """Derive a class of the same name whose methods are guarded."""
    guarded: Dict[str, Any] = {}
    for name in {*vars(methods_of), *getattr(methods_of, "__annotations__", {})}:
        own = getattr(plugin_class, name, None)
        if name.startswith("_") or own is None or own is getattr(methods_of, name, None):
            continue
        if isinstance(own, property) and own.fget is not None:
            guarded[name] = property(_guarded(plugin_class, name, own.fget))
        elif isinstance(own, type) or hasattr(own, "__self__"):  # of the class, not of objects
            continue
        elif callable(own):
            guarded[name] = _guarded(plugin_class, name, own)
    names = {key: getattr(plugin_class, key) for key in ("__module__", "__qualname__", "__doc__")}
    return type(plugin_class.__name__, (plugin_class,), {**guarded, **names})


def _guarded(plugin_class: Any, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    what = f"{plugin_class.__module__}.{plugin_class.__qualname__}.{name}"
    wrong = _WRONG.get(name)
    allowed: Tuple[Type[Exception], ...] = (PluginError, *_ALLOWED.get(name, ()))

    @functools.wraps(function, updated=())
    def call(*arguments: Any, **named: Any) -> Any:
        try:
            result = function(*arguments, **named)
        except allowed:
            raise
        except Exception as error:  # a user's code raises whatever it likes
            place = _place(error, plugin_class, name)
            raise PluginError(f"{what}: {type(error).__name__}: {error} ({place})") from error
        problem = wrong(result) if wrong else ""
        if problem:
            place = _place(None, plugin_class, name)
            raise PluginError(f"{what} returned {problem} ({place})")
        return result

    return call


def _place(error: Optional[Exception], plugin_class: Any, name: str) -> str:
    """Return file and line of the last call in the plugin's own files, or else of the method."""
    package = sys.modules.get(plugin_class.__module__.split(".")[0])
    file = getattr(package, "__file__", None) or ""
    folder = str(Path(file).parent) + "/" if hasattr(package, "__path__") and file else file
    frames = traceback.extract_tb(error.__traceback__) if error is not None else []
    for frame in reversed(frames):
        if folder and frame.filename.startswith(folder):
            return f"{frame.filename}:{frame.lineno}"
    method = getattr(plugin_class, name, None)
    code = getattr(getattr(method, "fget", method), "__code__", None)
    return f"{code.co_filename}:{code.co_firstlineno}" if code else file


def _wrong_array(value: Any, columns: int, least: int = 0) -> str:
    expected = f"expected an array float64[n, {columns}]" + (f", n >= {least}" if least else "")
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "fiu":
        return f"{_described(value)}; {expected}"
    if value.ndim != 2 or value.shape[1] != columns or len(value) < least:
        return f"an array of shape {value.shape}; {expected}"
    return "" if np.isfinite(value).all() else f"an array that is not finite; {expected}"


def _wrong_twist(value: Any) -> str:
    if not isinstance(value, Twist2D):
        return f"the command {_described(value)}; expected a Twist2D"
    speeds = (value.vx_mps, value.vy_mps, value.vyaw_radps)
    try:
        is_finite = all(map(math.isfinite, speeds))
    except TypeError:
        is_finite = False
    return "" if is_finite else f"the command {value}; expected finite numbers"


def _wrong_control(value: Any) -> str:
    if not isinstance(value, Control):
        return f"{_described(value)}; expected a Control"
    return (
        _wrong_twist(value.command)
        or _wrong_array(value.local_plan, 3)
        or _wrong_array(value.global_plan, 3)
    )


def _wrong_step(value: Any) -> str:
    if not isinstance(value, Step):
        return f"{_described(value)}; expected a Step"
    return "" if value.command is None else _wrong_twist(value.command)


def _wrong_filtered(value: Any) -> str:
    if isinstance(value, Command):
        return _wrong_twist(value.velocity)
    if isinstance(value, FilteredScan):
        return ""
    return f"{_described(value)}; expected the Command or the FilteredScan, changed or not"


def _wrong_kind(*kinds: type) -> Callable[[Any], str]:
    name = kinds[0].__name__
    return lambda value: "" if isinstance(value, kinds) else f"{_described(value)}; expected {name}"


def _described(value: Any) -> str:
    return "None" if value is None else f"{type(value).__name__} {str(value)[:60]}"


_WRONG: Dict[str, Callable[[Any], str]] = {
    "make_plan": lambda value: _wrong_array(value, 3, least=1),
    "compute_velocity": _wrong_control,
    "is_goal_reached": _wrong_kind(bool, np.bool_),
    "cost_cloud": lambda value: _wrong_array(value, 7),
    "update_bounds": _wrong_kind(Bounds),
    "step": _wrong_step,
    "filter": _wrong_filtered,
    "period_s": _wrong_kind(float, int, np.floating),
}
"""Checks of results by method; each returns the fault, "" without one."""
