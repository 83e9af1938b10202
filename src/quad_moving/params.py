"""Parameters of the filters, each declared once, in the field of its dataclass."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, Type, TypeVar

from quad_nav.config.plugins import Parameters
from quad_nav.errors import InputError

_Params = TypeVar("_Params")


def number(name: str, default: float, unit: str, low: float, high: float, text: str) -> Any:
    """Declare a field of a dataclass that is a parameter.

    Args:
        name: Name in YAML.
        default: Value if it is not set.
        unit: Its unit.
        low: Least value.
        high: Greatest value.
        text: What it means, one sentence.
    """
    metadata = {"name": name, "unit": unit, "low": low, "high": high, "text": text}
    return dataclasses.field(default=default, metadata=metadata)


def read(params_class: Type[_Params], parameters: Parameters) -> _Params:
    """Make a dataclass of the parameters in a filter's namespace.

    Raises:
        InputError: One line for each parameter that is unknown, or no number within its range.
    """
    fields = {one.metadata["name"]: one for one in dataclasses.fields(params_class)}  # type: ignore[arg-type]
    problems, values = [], {}
    for name, value in parameters.items():
        if name not in fields:
            known = ", ".join(fields)
            problems.append(f"{parameters.place}/{name}: unknown; expected one of {known}")
            continue
        about = fields[name].metadata
        low, high = about["low"], about["high"]
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not is_number or not math.isfinite(value) or not low <= value <= high:
            expected = f"expected a number of {about['unit']} from {low:g} to {high:g}"
            problems.append(f"{parameters.place}/{name}: is {value!r}; {expected}")
            continue
        values[fields[name].name] = float(value)
    if problems:
        raise InputError(problems)
    return params_class(**values)
