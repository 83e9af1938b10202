"""Comparing what was found with what was recorded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, List

import numpy as np


@dataclass(frozen=True)
class Difference:
    """A field of a recording that came out otherwise, and how."""

    field: str
    text: str

    def __str__(self) -> str:
        return f"{self.field}: {self.text}"


class Comparison:
    """Collects the differences of one case. NaN agrees with NaN, an infinity with itself."""

    def __init__(self) -> None:
        self.differences: List[Difference] = []

    def exact(self, field: str, found: Any, recorded: Any) -> None:
        """Numbers, texts or arrays that have to be the same."""
        found, recorded = np.asarray(found), np.asarray(recorded)
        if not self._same_shape(field, found, recorded):
            return
        different = np.atleast_1d(~_equal(found, recorded))
        if different.any():
            where, values = _place(different.argmax(), found, recorded)
            count = f"{different.sum()} of {different.size} differ, the first " if where else ""
            self._add(field, f"{count}{where}{values}")

    def near(self, field: str, found: Any, recorded: Any, tolerance: float) -> None:
        """Numbers that may be ``tolerance`` apart, absolutely."""
        found = np.asarray(found, dtype=np.float64)
        recorded = np.asarray(recorded, dtype=np.float64)
        if not self._same_shape(field, found, recorded):
            return
        with np.errstate(invalid="ignore"):
            apart = np.abs(found - recorded)
        apart = np.atleast_1d(np.where(_equal(found, recorded), 0.0, apart))
        apart[np.isnan(apart)] = np.inf
        if apart.size and apart.max() > tolerance:
            where, values = _place(apart.argmax(), found, recorded)
            self._add(
                field,
                f"{apart.max():.3g} apart{' ' + where if where else ': '}{values},"
                f" allowed are {tolerance:g}",
            )

    def _same_shape(self, field: str, found: np.ndarray, recorded: np.ndarray) -> bool:
        if found.shape != recorded.shape:
            self._add(field, f"shape {found.shape}, recorded {recorded.shape}")
        return found.shape == recorded.shape

    def _add(self, field: str, text: str) -> None:
        self.differences.append(Difference(field, text))


def _equal(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    equal = np.asarray(a == b)
    if a.dtype.kind == "f" and b.dtype.kind == "f":
        equal |= np.isnan(a) & np.isnan(b)
    return equal


def _place(flat_index: Any, found: np.ndarray, recorded: np.ndarray) -> Any:
    """Place in the arrays, "" for single values, and the two values there."""
    index = np.unravel_index(int(flat_index), found.shape)
    values = f"{found[index]}, recorded {recorded[index]}"
    return (f"at [{', '.join(map(str, index))}]: " if index else ""), values
