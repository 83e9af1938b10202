"""Parameters and tables of parameters: ROS spelling, type, range, and the field that is filled."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any, Callable, Optional, Tuple


class Domain(enum.Enum):
    """Set of numbers that a parameter accepts; others are errors."""

    ANY = "a {number}"
    NOT_NEGATIVE = "a {number}, 0 or more"
    POSITIVE = "a positive {number}"


@dataclass(frozen=True)
class Choice:
    """Value of an enumeration, as dynamic_reconfigure shows it."""

    name: str
    value: int
    description: str


class InvalidValue(ValueError):
    """A value that a parameter does not accept; the message says what was expected."""


@dataclass(frozen=True)
class Parameter:
    """Parameter of move_base.

    Attributes:
        name: ROS spelling.
        kind: "double", "int", "bool" or "str", as in dynamic_reconfigure.
        default: Value in force when nothing is set.
        field: Dataclass field that the parameter fills, "" if nothing here reads it.
        description: One sentence, shown by dynamic_reconfigure and in the reference.
        unit: Unit of a number; for a text, what is expected.
        domain: Numbers that are accepted.
        low: Lower end of the range that dynamic_reconfigure clamps to, None without one.
        high: Upper end of that range.
        initial: Value in force until the first reconfiguration, where it is not ``default``.
        convert: Converts the ROS value to the field's; raises ``ValueError``.
        choices: Values of an enumeration.
        choices_description: Description of the enumeration.
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
        if self.kind == "bool":
            if not isinstance(value, bool):
                raise InvalidValue(f"{value!r} is not a boolean; expected {self.expected}")
            return value
        if self.kind == "str":
            return self._checked_text(value)
        return self._checked_number(value)

    def _checked_text(self, value: Any) -> str:
        if not isinstance(value, str):
            raise InvalidValue(f"{value!r} is not a string; expected {self.expected}")
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
            raise InvalidValue(f"{value} is out of range; expected {self.expected}")
        if self.choices and value not in [choice.value for choice in self.choices]:
            names = ", ".join(f"{choice.value} ({choice.name})" for choice in self.choices)
            raise InvalidValue(f"{value} is not a valid choice; expected one of {names}")
        # roscpp rounds a double that is read as an int, halves upwards.
        return float(value) if self.kind == "double" else math.floor(value + 0.5)

    def clamp(self, value: Any) -> Any:
        """Clamp a value to dynamic_reconfigure's range."""
        if self.kind in ("bool", "str"):
            return value
        if self.low is not None and value < self.low:
            return type(value)(self.low)
        if self.high is not None and value > self.high:
            return type(value)(self.high)
        return value


@dataclass(frozen=True)
class Table:
    """Parameters of one namespace.

    Attributes:
        reconfigurable: Parameters that can change in flight, in the order of dynamic_reconfigure.
        fixed: Parameters that are read once, at the start.
        unsupported: (name, reason) of keys that move_base reads and this package does not.
        ignored: (name, reason) of keys that move_base ignores too.
    """

    reconfigurable: Tuple[Parameter, ...] = ()
    fixed: Tuple[Parameter, ...] = ()
    unsupported: Tuple[Tuple[str, str], ...] = ()
    ignored: Tuple[Tuple[str, str], ...] = ()

    @property
    def parameters(self) -> Tuple[Parameter, ...]:
        """All parameters, the reconfigurable ones first."""
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
    """Make a parameter that is a number."""
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
    """Make a parameter that is a whole number."""
    return Parameter(name, "int", default, field, description, unit, domain, low, high, **more)


def flag(name: str, default: bool, field: str, description: str) -> Parameter:
    """Make a parameter that is true or false."""
    return Parameter(name, "bool", default, field, description)


def text(
    name: str, default: str, field: str, expected: str, description: str, **more: Any
) -> Parameter:
    """Make a parameter that is a string; ``expected`` describes it in messages."""
    return Parameter(name, "str", default, field, description, expected, **more)


RESTORE_DEFAULTS = flag("restore_defaults", False, "", "Restore to the original configuration.")


def _hint(value: Any) -> str:
    """Explain a string that looks like a number: YAML 1.1 reads 1e-3 as a string."""
    if not isinstance(value, str):
        return ""
    try:
        return f" but a string (write {float(value)})"
    except ValueError:
        return ""
