"""A parameter is declared once, as a field of the frozen dataclass of its owner.

    @dataclass(frozen=True)
    class TrajectoryPlannerParams:
        acc_lim_x_mps2: float = number("acc_lim_x", 2.5, "m/s^2", 0, 20, "Acceleration limit in x.")
        prune_plan: bool = fixed_flag("prune_plan", True, "Remove the plan behind the robot.")

The arguments are the ROS name, default, unit, range and a sentence. YAML, dynamic_reconfigure,
``quad check`` and ``docs/parameters.md`` derive from them, see ``quad_nav.config``.

A ``fixed_...`` parameter is read once, at the start. The others can change in flight; they stand in
the order of upstream's ``.cfg`` file. ``own=True`` marks a parameter that upstream does not have,
in a namespace of upstream. One that can make the robot behave otherwise than upstream has
``upstream=...`` instead: the value at which it behaves alike, which ``fixes/upstream`` sets.
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import math
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple, TypeVar, Union, cast

_PARAMETER, _UPSTREAM = "parameter", "upstream"  # keys of a field's metadata
_Params = TypeVar("_Params")


class Domain(enum.Enum):
    """Set of numbers that a parameter accepts; others are errors."""

    ANY = "a {number}"
    NOT_NEGATIVE = "a {number}, 0 or more"
    POSITIVE = "a positive {number}"


ANY, NOT_NEGATIVE, POSITIVE = Domain.ANY, Domain.NOT_NEGATIVE, Domain.POSITIVE


@dataclass(frozen=True)
class Choice:
    """Value of an enumeration, as dynamic_reconfigure shows it."""

    name: str
    value: Union[int, str]
    description: str


class InvalidValue(ValueError):
    """A value that a parameter does not accept; the message says what was expected."""


@dataclass(frozen=True)
class Parameter:
    """Declaration of a parameter.

    Attributes:
        name: ROS spelling.
        kind: "double", "int", "bool" or "str", as in dynamic_reconfigure.
        default: Value in force when nothing is set; None for another parameter's value.
        description: One sentence, shown by dynamic_reconfigure and in the reference.
        unit: Unit of a number; for a text, what is expected.
        domain: Numbers that are accepted.
        low: Lower end of the range that dynamic_reconfigure clamps to, None without one.
        high: Upper end of that range.
        initial: Value in force until the first reconfiguration, where it is not ``default``.
        convert: Converts the ROS value to the field's; raises ``ValueError``.
        choices: Values of an enumeration.
        choices_description: Description of the enumeration.
        is_fixed: The parameter is read once, at the start.
        is_own: Upstream does not have it.
        field: Field of the owner's dataclass.
    """

    name: str
    kind: str
    default: Any
    description: str = ""
    unit: str = ""
    domain: Domain = Domain.ANY
    low: Optional[float] = None
    high: Optional[float] = None
    initial: Any = None
    convert: Optional[Callable[[Any], Any]] = None
    choices: Tuple[Choice, ...] = ()
    choices_description: str = ""
    is_fixed: bool = False
    is_own: bool = False
    field: str = ""

    @property
    def expected(self) -> str:
        """Description of the values that are accepted, for messages."""
        if self.kind == "bool":
            return "true or false"
        if self.kind == "str":
            return self.unit or "a string"
        number = f"number of {self.unit}" if self.unit else "number"
        if self.kind == "int" and not self.unit:
            number = "whole number"
        return self.domain.value.format(number=number)

    @property
    def in_force(self) -> Any:
        """Value in force at the start when nothing is set."""
        return self.default if self.initial is None else self.initial

    def field_value(self, value: Any) -> Any:
        """Return the dataclass field's value for a checked ROS value."""
        return value if self.convert is None else self.convert(value)

    def check(self, value: Any) -> Any:
        """Return a value in the parameter's own type, not clamped.

        Raises:
            InvalidValue: The type is wrong, or the number is not finite or not accepted.
        """
        problem = self._problem(value)
        if problem:
            raise InvalidValue(f"{problem}; expected {self.expected}")
        if self.choices and value not in [choice.value for choice in self.choices]:
            names = ", ".join(f"{choice.value} ({choice.name})" for choice in self.choices)
            raise InvalidValue(f"{value} is not a valid choice; expected one of {names}")
        # roscpp rounds a double that is read as an int, halves upwards.
        convert = {"double": float, "int": lambda number: math.floor(number + 0.5)}
        return convert[self.kind](value) if self.kind in convert else value

    def _problem(self, value: Any) -> str:
        """Return what is wrong with a value, "" if nothing is."""
        if self.kind == "bool":
            return "" if isinstance(value, bool) else f"{value!r} is not a boolean"
        if self.kind == "str":
            if not isinstance(value, str):
                return f"{value!r} is not a string"
            try:
                self.field_value(value)
            except ValueError as error:
                return f"{value!r}: {error}"
            return ""
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return f"{value!r} is not a number{_hint(value)}"
        if not math.isfinite(value):
            return f"{value} is not finite"
        is_refused = {NOT_NEGATIVE: value < 0, POSITIVE: value <= 0}.get(self.domain, False)
        return f"{value} is out of range" if is_refused else ""

    def within_range(self, value: Any) -> Any:
        """Return the field's value for a ROS value that is within its range.

        Raises:
            InvalidValue: It is not.
        """
        checked = self.check(value)
        if self.clamp(checked) != checked:
            ends = f"{self.low} to {self.high}" if self.high is not None else f"{self.low} or more"
            raise InvalidValue(f"{value} is out of range; expected {ends} {self.unit}".rstrip())
        return self.field_value(checked)

    def clamp(self, value: Any) -> Any:
        """Clamp a value to dynamic_reconfigure's range."""
        if self.kind in ("bool", "str"):
            return value
        if self.low is not None and value < self.low:
            return type(value)(self.low)
        if self.high is not None and value > self.high:
            return type(value)(self.high)
        return value


def number(
    name: str,
    default: float,
    unit: str,
    low: Any,
    high: Any,
    sentence: str,
    domain: Domain = NOT_NEGATIVE,
    kind: str = "double",
    **more: Any,
) -> Any:
    """Declare a number, 0 or more; None for a range without that end.

    ``positive`` declares one above 0, and ``signed`` one that may be negative. ``whole`` declares a
    whole number. Below its range, a number of the last two is clamped.
    """
    return _declared(Parameter(name, kind, default, sentence, unit, domain, low, high), **more)


positive = functools.partial(number, domain=POSITIVE)
signed = functools.partial(number, domain=ANY)
whole = functools.partial(number, domain=ANY, kind="int")


def choice(name: str, default: int, choices: Tuple[Choice, ...], sentence: str, **more: Any) -> Any:
    """Declare one of several whole numbers, each with a name."""
    more = {"choices_description": sentence, **more}
    return _declared(Parameter(name, "int", default, sentence, choices=choices), **more)


def flag(name: str, default: Optional[bool], sentence: str, **more: Any) -> Any:
    """Declare what is true or false."""
    return _declared(Parameter(name, "bool", default, sentence), **more)


def text(name: str, default: str, expected: str, sentence: str, **more: Any) -> Any:
    """Declare a string; ``expected`` describes it in messages."""
    return _declared(Parameter(name, "str", default, sentence, expected), **more)


def fixed_number(
    name: str,
    default: Optional[float],
    unit: str,
    sentence: str,
    domain: Domain = NOT_NEGATIVE,
    **more: Any,
) -> Any:
    """Declare a number that is read once; None for the value of another parameter."""
    parameter = Parameter(name, "double", default, sentence, unit, domain, is_fixed=True)
    return _declared(parameter, **more)


def fixed_whole(name: str, default: int, sentence: str, **more: Any) -> Any:
    """Declare a whole number that is read once."""
    return _declared(Parameter(name, "int", default, sentence), is_fixed=True, **more)


fixed_flag = functools.partial(flag, is_fixed=True)
"""Declare what is true or false and read once; None for the value of another parameter."""
fixed_text = functools.partial(text, is_fixed=True)
"""Declare a string that is read once."""


def deviation() -> Any:
    """Declare a deviation from upstream: true, and false with ``fixes/upstream``."""
    return dataclasses.field(default=True, metadata={_UPSTREAM: False})


@functools.lru_cache(maxsize=None)
def parameters_of(owner: type) -> Tuple[Parameter, ...]:
    """Return the parameters of a dataclass in their order.

    A field that a subclass declares again stands where the subclass has it.
    """
    own = owner.__dict__.get("__annotations__", {})
    fields = {one.name: one for one in dataclasses.fields(cast(Any, owner))}
    names = [
        *(name for name in fields if name not in own),
        *(name for name in own if name in fields),
    ]
    return tuple(
        dataclasses.replace(fields[name].metadata[_PARAMETER], field=name)
        for name in names
        if _PARAMETER in fields[name].metadata
    )


def checked(owner: type, values: Mapping[str, Any]) -> Tuple[Dict[str, Any], List[Tuple[str, str]]]:
    """Check the values of a plugin's namespace against its declarations.

    Returns:
        Field -> value of what is right, and (name, fault) of what is unknown or out of its range.
    """
    declared = {one.name: one for one in parameters_of(owner)}
    right: Dict[str, Any] = {}
    faults: List[Tuple[str, str]] = []
    for name, value in values.items():
        if name not in declared:
            faults.append((name, f"unknown; expected one of {', '.join(declared)}"))
            continue
        try:
            right[declared[name].field] = declared[name].within_range(value)
        except InvalidValue as fault:
            faults.append((name, str(fault)))
    return right, faults


def as_upstream(params: _Params) -> _Params:
    """Return parameters without any deviation from upstream, those of parts included."""
    changed = {}
    for one in dataclasses.fields(cast(Any, params)):
        value = getattr(params, one.name)
        if _UPSTREAM in one.metadata:
            changed[one.name] = one.metadata[_UPSTREAM]
        elif dataclasses.is_dataclass(value) and not isinstance(value, type):
            changed[one.name] = as_upstream(value)
    replaced: _Params = dataclasses.replace(cast(Any, params), **changed)
    return replaced


def _declared(parameter: Parameter, own: bool = False, **more: Any) -> Any:
    """Return the field of a dataclass with the parameter in its metadata."""
    metadata = {_UPSTREAM: more.pop(_UPSTREAM)} if _UPSTREAM in more else {}
    parameter = dataclasses.replace(parameter, is_own=own or bool(metadata), **more)
    default = parameter.in_force
    if default is not None:
        default = parameter.field_value(default)
    return dataclasses.field(default=default, metadata={**metadata, _PARAMETER: parameter})


def _hint(value: Any) -> str:
    """Explain a string that looks like a number: YAML 1.1 reads 1e-3 as a string."""
    if not isinstance(value, str):
        return ""
    try:
        return f" but a string (write {float(value)})"
    except ValueError:
        return ""
