"""What a parameter is: its ROS spelling, its type, its range and the field that it fills."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any, Callable, Optional, Tuple


class Domain(enum.Enum):
    """Which numbers make sense at all; the others are errors."""

    ANY = "a {number}"
    NOT_NEGATIVE = "a {number}, 0 or more"
    POSITIVE = "a positive {number}"


@dataclass(frozen=True)
class Choice:
    """One value of an enumeration, as dynamic_reconfigure shows it."""

    name: str
    value: int
    description: str


class InvalidValue(ValueError):
    """A value that no parameter of this kind can have; says what was expected."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of move_base.

    ``name``: the ROS spelling. ``kind``: "double", "int", "bool" or "str", as
    dynamic_reconfigure calls them. ``field``: the dataclass field that it fills,
    "" when nothing here reads it. ``default``: the value in force when nothing is
    set; ``initial`` where a different one is in force until the first
    reconfiguration. ``low`` and ``high``: the range that dynamic_reconfigure
    clamps to, None for none. ``convert`` turns the ROS value into the field's.
    """

    name: str
    kind: str
    default: Any
    field: str = ""
    description: str = ""
    unit: str = ""
    domain: Domain = Domain.ANY
    low: Optional[float] = None
    high: Optional[float] = None
    initial: Any = None
    convert: Optional[Callable[[Any], Any]] = None
    choices: Tuple[Choice, ...] = ()
    choices_description: str = ""

    @property
    def expected(self) -> str:
        """What a value has to be, for messages."""
        if self.kind == "bool":
            return "true or false"
        if self.kind == "str":
            return self.unit or "a text"
        number = f"number of {self.unit}" if self.unit else "number"
        if self.kind == "int" and not self.unit:
            number = "whole number"
        return self.domain.value.format(number=number)

    @property
    def in_force(self) -> Any:
        """The value that counts at start when nothing is set."""
        return self.default if self.initial is None else self.initial

    def field_value(self, value: Any) -> Any:
        """The dataclass field's value for a checked ROS value."""
        return value if self.convert is None else self.convert(value)

    def check(self, value: Any) -> Any:
        """The value in this parameter's own type, not yet clamped.

        Raises:
            InvalidValue: wrong type, not finite, or outside the domain.
        """
        if self.kind == "bool":
            if not isinstance(value, bool):
                raise InvalidValue(f"{value!r} is neither true nor false; expected {self.expected}")
            return value
        if self.kind == "str":
            return self._checked_text(value)
        return self._checked_number(value)

    def _checked_text(self, value: Any) -> str:
        if not isinstance(value, str):
            raise InvalidValue(f"{value!r} is not a text; expected {self.expected}")
        try:
            self.field_value(value)
        except ValueError as error:
            raise InvalidValue(f"{value!r}: {error}; expected {self.expected}") from error
        return value

    def _checked_number(self, value: Any) -> Any:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InvalidValue(f"{value!r} is not a number{_hint(value)}; expected {self.expected}")
        if not math.isfinite(value):
            raise InvalidValue(f"{value} is not finite; expected {self.expected}")
        if (
            value < 0
            and self.domain is not Domain.ANY
            or (value == 0 and self.domain is Domain.POSITIVE)
        ):
            raise InvalidValue(f"{value} cannot be; expected {self.expected}")
        if self.choices and value not in [choice.value for choice in self.choices]:
            names = ", ".join(f"{choice.value} ({choice.name})" for choice in self.choices)
            raise InvalidValue(f"{value} is no choice; expected one of {names}")
        # roscpp rounds a double that is read as an int, halves upwards.
        return float(value) if self.kind == "double" else math.floor(value + 0.5)

    def clamp(self, value: Any) -> Any:
        """The nearest value within dynamic_reconfigure's range."""
        if self.kind in ("bool", "str"):
            return value
        if self.low is not None and value < self.low:
            return type(value)(self.low)
        if self.high is not None and value > self.high:
            return type(value)(self.high)
        return value


@dataclass(frozen=True)
class Table:
    """The parameters of one namespace.

    ``reconfigurable`` are in the order in which dynamic_reconfigure lists them;
    ``fixed`` are read once at start. ``unsupported`` and ``ignored`` are keys
    that move_base knows: (name, why it changes nothing here), or in the original.
    """

    reconfigurable: Tuple[Parameter, ...] = ()
    fixed: Tuple[Parameter, ...] = ()
    unsupported: Tuple[Tuple[str, str], ...] = ()
    ignored: Tuple[Tuple[str, str], ...] = ()

    @property
    def parameters(self) -> Tuple[Parameter, ...]:
        return self.reconfigurable + self.fixed

    def __getitem__(self, name: str) -> Parameter:
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(name)


def double(
    name: str,
    default: float,
    field: str,
    unit: str,
    description: str,
    domain: Domain = Domain.NOT_NEGATIVE,
    low: Any = None,
    high: Any = None,
    **more: Any,
) -> Parameter:
    return Parameter(name, "double", default, field, description, unit, domain, low, high, **more)


def integer(
    name: str,
    default: int,
    field: str,
    unit: str,
    description: str,
    domain: Domain = Domain.ANY,
    low: Any = None,
    high: Any = None,
    **more: Any,
) -> Parameter:
    return Parameter(name, "int", default, field, description, unit, domain, low, high, **more)


def flag(name: str, default: bool, field: str, description: str) -> Parameter:
    return Parameter(name, "bool", default, field, description)


def text(
    name: str, default: str, field: str, expected: str, description: str, **more: Any
) -> Parameter:
    return Parameter(name, "str", default, field, description, expected, **more)


RESTORE_DEFAULTS = flag("restore_defaults", False, "", "Restore to the original configuration.")


def _hint(value: Any) -> str:
    """YAML 1.1 takes 1e-3 for a text: say so, it looks like a number."""
    if not isinstance(value, str):
        return ""
    try:
        return f" but a text (write {float(value)})"
    except ValueError:
        return ""
