"""Rules for values that people write, and the nearest name to a misspelled one.

RULES = {"robots": whole(at_least=1), "rate": number(above=0, unit="simulated seconds per second")}
problems = value_faults(values, RULES, "simulator")
problems += unknown_names(values, RULES, "simulator", "a parameter of the simulator")
"""

from __future__ import annotations

import difflib
import sys
from typing import Any, Callable, Iterable, List, Mapping, NamedTuple, Optional, Sequence

MAX_MEMORY_BYTES = 1_000_000_000
"""Most memory that one costmap, map or image may take while it is used."""
_LARGEST = sys.float_info.max


class Rule(NamedTuple):
    """A test for a value and a phrase for messages: what was expected."""

    accepts: Callable[[Any], bool]
    expected: str


def is_number(value: Any) -> bool:
    """True for a finite int or float; a bool is no number."""
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return False
    return bool(
        -_LARGEST <= value <= _LARGEST
    )  # math.isfinite raises for ints that exceed any float


def is_whole(value: Any) -> bool:
    """True for an int; a bool is no number."""
    return isinstance(value, int) and not isinstance(value, bool)


def number(
    above: Optional[float] = None,
    at_least: Optional[float] = None,
    at_most: Optional[float] = None,
    unit: str = "",
) -> Rule:
    """Rule for a finite number within limits; ``unit`` goes into the message."""

    def accepts(value: Any) -> bool:
        return (
            is_number(value)
            and (above is None or value > above)
            and (at_least is None or value >= at_least)
            and (at_most is None or value <= at_most)
        )

    return Rule(
        accepts, "a number" + (f" of {unit}" if unit else "") + _limits(above, at_least, at_most)
    )


def whole(at_least: int, at_most: Optional[int] = None) -> Rule:
    """Rule for a whole number within limits."""
    rule = number(at_least=at_least, at_most=at_most)
    return Rule(
        lambda value: is_whole(value) and rule.accepts(value),
        "a whole number" + _limits(None, at_least, at_most),
    )


def choice(names: Sequence[str]) -> Rule:
    """Rule for one of some names."""
    return Rule(lambda value: value in names, " or ".join(names))


def text(expected: str) -> Rule:
    """Rule for a text that is not empty."""
    return Rule(lambda value: isinstance(value, str) and value != "", expected)


def optional(rule: Rule, nothing: Any = "") -> Rule:
    """The same rule, which also accepts a value that stands for nothing."""
    return Rule(
        lambda value: (value == nothing and type(value) is type(nothing)) or rule.accepts(value),
        f"{rule.expected}, or {str(nothing) or 'nothing'}",
    )


BOOLEAN = Rule(lambda value: isinstance(value, bool), "true or false")


def value_faults(values: Mapping[str, Any], rules: Mapping[str, Rule], source: str) -> List[str]:
    """A message for each value that its rule does not accept, in the rules' order."""
    place = f"{source}: " if source else ""
    return [
        f"{place}{name}: is {values[name]!r}; expected {rule.expected}"
        for name, rule in rules.items()
        if not rule.accepts(values[name])
    ]


def memory_problem(width: float, height: float, unit: str, bytes_each: int, advice: str) -> str:
    """Return the reason why a grid takes too much memory, "" if it does not.

    Args:
        width: Number of columns.
        height: Number of rows.
        unit: Name of an element, in the plural.
        bytes_each: Memory that an element takes, all arrays that are computed from it included.
        advice: What to change.
    """
    total = width * height * bytes_each
    if total <= MAX_MEMORY_BYTES:
        return ""
    return (
        f"{width:.10g} x {height:.10g} {unit} of {bytes_each} bytes each take {total / 1e9:.5g} GB"
        f" of memory; expected {MAX_MEMORY_BYTES / 1e9:g} GB at most ({advice})"
    )


def nearest(name: object, known: Iterable[str]) -> str:
    """The known name that is most similar to a misspelled one; "" if none is similar."""
    return next(iter(difflib.get_close_matches(str(name), list(known), n=1)), "")


def expected_name(name: object, known: Iterable[str]) -> str:
    """The nearest known name, or "one of ..." if none is similar."""
    known = list(known)
    return nearest(name, known) or f"one of {', '.join(known)}"


def unknown_names(names: Iterable[str], known: Iterable[str], source: str, what: str) -> List[str]:
    """A message for each name that is not known; ``what`` as "a parameter of the simulator"."""
    known = list(known)
    return [
        f"{source}: {name}: is not {what}; expected {expected_name(name, known)}"
        for name in names
        if name not in known
    ]


def _limits(above: Optional[float], at_least: Optional[float], at_most: Optional[float]) -> str:
    if above is not None:
        return f" above {above:g}" + ("" if at_most is None else f", at most {at_most:g}")
    if at_least is None:
        return "" if at_most is None else f", at most {at_most:g}"
    return f", {at_least:g} or more" if at_most is None else f", {at_least:g} to {at_most:g}"
