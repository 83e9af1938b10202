"""Plugins: planners, costmap layers, recoveries and filters of users.

Where move_base expects the name of a plugin, a dotted Python name such as
``my_package.my_module.MyPlanner`` loads a class. An ``Interface`` says what the class needs;
``docs/plugins.md`` has a working example of each.
"""

from __future__ import annotations

import importlib
import inspect
import traceback
from dataclasses import dataclass, field
from typing import Any, Dict, Iterator, Mapping, Tuple, Type, TypeVar, cast

from quad_nav.config.plugin_calls import call_constructor
from quad_nav.control.controller import LocalPlanner
from quad_nav.costmap.layer import Layer, LayerParams
from quad_nav.costmap.scan_filter import ScanFilter
from quad_nav.errors import InputError
from quad_nav.grid import GridSpec
from quad_nav.navigator.command_filter import CommandFilter
from quad_nav.parameter import checked
from quad_nav.plan.planner import GlobalPlanner
from quad_nav.recovery import Recovery

_Params = TypeVar("_Params")


@dataclass(frozen=True)
class Interface:
    """Requirements on the class of a plugin.

    Attributes:
        kind: Name of the kind, for messages.
        methods_of: Class whose public methods and annotated attributes are required.
        arguments: Arguments of the constructor.
        derived: True if the plugin has to be derived from ``methods_of``.
    """

    kind: str
    methods_of: type
    arguments: Tuple[str, ...]
    derived: bool = False


GLOBAL_PLANNER = Interface("a global planner", GlobalPlanner, ("params", "footprint"))
LOCAL_PLANNER = Interface(
    "a local planner", LocalPlanner, ("params", "footprint", "control_period_s")
)
LAYER = Interface(
    "a costmap layer", Layer, ("params", "spec", "rolling_window", "default_cost"), derived=True
)
RECOVERY = Interface("a recovery behaviour", Recovery, ("params",))
SCAN_FILTER = Interface("a scan filter", ScanFilter, ("params",), derived=True)
COMMAND_FILTER = Interface("a command filter", CommandFilter, ("params",), derived=True)


class Parameters(Dict[str, Any]):
    """Parameters in a plugin's namespace, unchecked.

    ``parameters["radius"]`` raises an InputError with its place if the parameter is not set;
    ``parameters.get("radius", 1.0)`` has a default.
    """

    def __init__(self, written: Mapping[str, Any], place: str) -> None:
        super().__init__(written)
        self.place = place

    def __missing__(self, name: str) -> Any:
        raise InputError([f"{self.place}/{name}: missing; expected a value"])

    def read(self, owner: Type[_Params]) -> _Params:
        """Make a dataclass of the parameters that it declares, see ``quad_nav.parameter``.

        Raises:
            InputError: One line for each parameter that is unknown or out of its range.
        """
        values, faults = checked(cast(type, owner), self)
        if faults:
            raise InputError([f"{self.place}/{name}: {fault}" for name, fault in faults])
        return owner(**values)


@dataclass(frozen=True)
class Plugin:
    """Class of a plugin, its parameters, and the class with the methods that it has to have."""

    plugin_class: Any
    parameters: Parameters
    methods_of: type

    def make(self, *arguments: Any) -> Any:
        """Make an object of the class; ``arguments`` follow the parameters.

        Raises:
            InputError: The class refuses its parameters.
            PluginError: The constructor fails otherwise. All methods raise it, too.
        """
        return call_constructor(self.plugin_class, self.methods_of, self.parameters, *arguments)


def plugin_of(kind: str, interface: Interface, namespace: Mapping[str, Any], place: str) -> Plugin:
    """Return the plugin of a dotted name, with the parameters of its namespace."""
    parameters = Parameters(namespace, place)
    return Plugin(load_class(kind, interface), parameters, interface.methods_of)


@dataclass(frozen=True)
class PluginLayerParams(LayerParams):
    """Parameters of a plugin that is a layer; it reads them as it reads ``Parameters``."""

    plugin_class: Any = Layer
    parameters: Parameters = field(default_factory=lambda: Parameters({}, ""))

    def make_layer(self, spec: GridSpec, rolling_window: bool, default_cost: int) -> Layer:
        """Make the layer; raises as ``Plugin.make``."""
        arguments = (self, spec, rolling_window, default_cost)
        layer: Layer = call_constructor(self.plugin_class, Layer, *arguments)
        return layer

    def __getitem__(self, name: str) -> Any:
        return self.parameters[name]

    def __contains__(self, name: str) -> bool:
        return name in self.parameters

    def get(self, name: str, default: Any = None) -> Any:
        """Return a parameter, or the default if it is not set."""
        return self.parameters.get(name, default)


def is_dotted(name: str) -> bool:
    """Tell if a plugin's name is that of a Python class, not one of pluginlib."""
    return "." in name and "/" not in name and ":" not in name


def plugin_name(plugin: str) -> str:
    """Return the namespace of a plugin's parameters and topics.

    It is ``NavfnROS`` for ``navfn/NavfnROS``, ``MyPlanner`` for ``my_package.MyPlanner``.
    """
    return plugin.replace("::", "/").replace(".", "/").split("/")[-1]


def load_class(name: str, interface: Interface) -> Any:
    """Load the class of a dotted name.

    Raises:
        InputError: The module or class does not exist, or one line for everything that the class
            lacks of the interface.
    """
    module_name, _, class_name = name.rpartition(".")
    module = _imported(module_name)
    found = getattr(module, class_name, None)
    if not isinstance(found, type):
        has = f"has no class {class_name}" if found is None else f"has {class_name}, not a class"
        raise InputError(
            [
                f"{module_name} ({getattr(module, '__file__', 'built in')}) {has};"
                f" expected {interface.kind} as package.module.Class"
            ]
        )
    problems = list(_misfits(found, interface))
    if problems:
        raise InputError([f"{name} is not {interface.kind}: {problem}" for problem in problems])
    return found


def _imported(module_name: str) -> Any:
    try:
        return importlib.import_module(module_name)
    except Exception as error:  # an import runs arbitrary code
        missing = getattr(error, "name", None) if isinstance(error, ModuleNotFoundError) else None
        if missing and f"{module_name}.".startswith(f"{missing}."):
            expected = "expected package.module.Class with the package's folder in PYTHONPATH"
            raise InputError([f"no module {missing}; {expected}"]) from error
        last = traceback.extract_tb(error.__traceback__)[-1]
        file, line, text = last.filename, last.lineno, str(error)
        if isinstance(error, SyntaxError) and error.filename:
            file, line, text = error.filename, error.lineno, error.msg
        problem = (
            f"cannot import {module_name}: {type(error).__name__}: {text}"
            f" ({file}:{line}); expected a module that imports without errors"
        )
        raise InputError([problem]) from error


def _misfits(plugin_class: Any, interface: Interface) -> Iterator[str]:
    """Yield everything that the class lacks."""
    wanted = interface.methods_of
    if interface.derived and not issubclass(plugin_class, wanted):
        yield (
            f"it is not derived from {wanted.__name__}; expected class"
            f" {plugin_class.__name__}({wanted.__module__}.{wanted.__name__})"
        )
        return
    if not _takes(plugin_class, interface.arguments):
        yield _expectation("__init__", plugin_class.__init__, interface.arguments)
    for name in getattr(wanted, "__annotations__", {}):
        if not hasattr(plugin_class, name):
            yield f"it has no {name}; expected a class attribute or a property of that name"
    for name, function in vars(wanted).items():
        if name.startswith("_") or not inspect.isfunction(function):
            continue
        arguments = tuple(inspect.signature(function).parameters)[1:]
        own = getattr(plugin_class, name, None)
        if own is None or (own is function and not interface.derived):
            yield f"it has no method {name}; expected {_call(name, arguments)}"
            continue
        written = inspect.getattr_static(plugin_class, name)
        is_bound = isinstance(written, (staticmethod, classmethod))
        if not _takes(own, arguments if is_bound else ("self", *arguments)):
            yield _expectation(name, own, arguments)


def _takes(function: Any, arguments: Tuple[str, ...]) -> bool:
    try:
        inspect.signature(function).bind(*arguments)
    except TypeError:
        return False
    except ValueError:  # compiled functions may lack a signature
        return True
    return True


def _expectation(name: str, own: Any, arguments: Tuple[str, ...]) -> str:
    written = inspect.signature(own).parameters.values()
    names = ", ".join(str(parameter).split(":")[0] for parameter in written)
    return f"{name}({names}) cannot take its arguments; expected {_call(name, arguments)}"


def _call(name: str, arguments: Tuple[str, ...]) -> str:
    return f"{name}({', '.join(('self', *arguments))})"
