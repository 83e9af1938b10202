"""Generate hostile messages from the definitions of their types.

A message is made from a valid one: one to three fields, drawn at random, get values that are not
finite, huge, negative, zero, of the wrong length, from another frame or from another time.
"""

from __future__ import annotations

import copy
import math
import random
from typing import Any, Callable, Dict, List, Tuple

import genpy
import numpy as np

Path = Tuple[Any, ...]

FLOATS = [
    *(math.nan, math.inf, -math.inf, 0.0, -0.0, 1.0, -1.0, 1e-300, -1e-45, 1e6, 1.1e6, -1e6),
    *(1e30, -1e30, 3.4e38, 1e300, -1e300, 2.0**31, 2.0**53, 0.5, 7.0, 1e-9),
]
TEXTS = [
    *("", "/", "//map", "map", "/map", "odom0", "base_link0", "Lidar0", "odom1", "base_link1"),
    *("x" * 300, "m" * 100_000, "a\0b", "\x1b[2J\n[ERROR] no", "\u202e", "é", "no where", "%s %d"),
    *("hostile", "nan", "inf", "contact", "quad0", "quad1", "1e999"),
]
SECONDS = [0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**32 - 3600, 4_000_000_000]
NANOSECONDS = [0, 1, 999_999_999, 10**9, 2**31, 2**32 - 1]
LENGTHS = [0, 1, 2, 3, 35, 36, 37, 100, 5000]


def integers(kind: str) -> List[int]:
    """Return odd values of an integer type such as `uint8`."""
    unsigned = kind.startswith("u") or kind in ("char", "byte")
    bits = int(kind.lstrip("uint") or 8) if kind not in ("char", "byte") else 8
    low, high = (0, 2**bits - 1) if unsigned else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    wanted = (0, 1, -1, 2, 4, 7, 8, 100, -100, 127, 255, 10_000, 2**16, 2**20, low, high, high - 1)
    return [value for value in wanted if low <= value <= high]


class Generator:
    """Generate messages like a valid one.

    Args:
        valid: Returns a valid message with stamps of the present time.
        now_s: Returns the present time; stamps are drawn around it.
        seed: Seed of the random draws.
    """

    def __init__(
        self, valid: Callable[[], genpy.Message], now_s: Callable[[], float], seed: int
    ) -> None:
        self._valid, self._now_s = valid, now_s
        self._random = random.Random(seed)
        self._odd: Dict[str, Callable[[Any], Any]] = {}

    def message(self) -> genpy.Message:
        """Return the next message."""
        message = self._valid()
        if not message.__slots__:
            return message
        for _ in range(self._random.choice((1, 1, 2, 3))):
            self._change(message)
        return message

    def _change(self, message: genpy.Message) -> None:
        """Change one field of a message, in place; going down copies only what is changed."""
        draw = self._random
        while True:
            name, kind = draw.choice(list(zip(message.__slots__, message._slot_types)))
            value = getattr(message, name)
            if isinstance(value, genpy.Message):
                value = copy.copy(value)
                setattr(message, name, value)
                if value.__slots__:
                    message = value
                    continue
                return
            if isinstance(value, (list, tuple)) and value and draw.random() < 0.7:
                value = list(value)
                setattr(message, name, value)
                index = draw.randrange(len(value))
                if isinstance(value[index], genpy.Message):
                    message = value[index] = copy.copy(value[index])
                    continue
                value[index] = self._odd_value(kind.split("[")[0], value[index])
                return
            setattr(message, name, self._odd_value(kind, value))
            return

    def _odd_value(self, kind: str, value: Any) -> Any:
        draw = self._random
        if kind == "time":
            return self._stamp()
        if kind == "duration":
            return genpy.Duration(draw.choice([-(2**31), -1, 0, 1, 2**31 - 1]), 0)
        if kind.startswith("float") and "[" not in kind:
            return draw.choice(FLOATS) if kind == "float64" else _float32(draw.choice(FLOATS))
        if kind == "string":
            return draw.choice(TEXTS)
        if kind == "bool":
            return draw.choice([True, False])
        if "[" in kind:
            return self._array(kind, value)
        return draw.choice(integers(kind))

    def _stamp(self) -> genpy.Time:
        """Return a stamp as it can come over the wire: its nanoseconds may exceed a second."""
        draw, stamp = self._random, genpy.Time()
        if draw.random() < 0.5:
            around_s = self._now_s() + draw.choice([-100.0, -11.0, -2.0, -0.5, 0.5, 2.0, 20.0])
            return genpy.Time.from_sec(max(around_s, 0.0))
        stamp.secs, stamp.nsecs = draw.choice(SECONDS), draw.choice(NANOSECONDS)
        return stamp

    def _array(self, kind: str, value: Any) -> Any:
        draw, element = self._random, kind.split("[")[0]
        fixed = kind[kind.index("[") + 1 : -1]
        length = int(fixed) if fixed else draw.choice(LENGTHS)
        if isinstance(value, np.ndarray):
            odd = _float32(draw.choice(FLOATS))
            filled = np.resize(value if len(value) else np.zeros(1, value.dtype), length)
            filled[draw.randrange(length) if length else slice(0)] = odd
            return filled if draw.random() < 0.5 else np.full(length, odd, np.float32)
        if element in ("uint8", "char"):
            return bytes([draw.choice(integers(element))]) * length
        if element.startswith(("float", "int", "uint", "bool", "string")):
            return [self._odd_value(element, None)] * length
        sample = value[0] if value else genpy.message.get_message_class(element)()
        return [sample] * min(length, 100)


def _float32(value: float) -> float:
    with np.errstate(over="ignore"):
        return float(np.float32(value))
