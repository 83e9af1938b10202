"""What is to be said about a configuration: every fault and every remark, with its place."""
from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import Dict, Iterable, List, Mapping, Optional

from quad_nav.errors import InputError

UNKNOWN = "unknown"  # move_base does not know the key either
UNSUPPORTED = "unsupported"  # move_base knows it, this package does not
IGNORED = "ignored"  # the original reads past it as well
UNUSED = "unused"  # of a planner that does not fly
CLAMPED = "clamped"  # the value in force is another one
RENAMED = "renamed"  # an old name, still honoured
CAUTION = "caution"  # legal, and probably not what was meant


@dataclass(frozen=True)
class Remark:
    """One line of ``quad check``: where, which kind, what about it."""

    place: str
    kind: str
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


class Notes:
    """Collects problems and remarks while a tree is read.

    Args:
        place: what paths are relative to, such as the node's name.
        origins: path -> "file:line" for values that came from files.
    """

    def __init__(self, place: str, origins: Optional[Mapping[str, str]] = None):
        self._place = place
        self._origins = origins or {}
        self._moved: Dict[str, str] = {}
        self.problems: List[str] = []
        self.remarks: List[Remark] = []

    def moved(self, path: str, written_at: str) -> None:
        """The value at ``path`` was written at another place; complaints name that one."""
        self._moved[path] = self._moved.get(written_at, written_at)

    def where(self, path: str) -> str:
        path = self._moved.get(path, path)
        place = self._place.rstrip("/") + "/" + path if path else self._place
        origin = self._origins.get(path)
        return f"{place} ({origin})" if origin else place

    def problem(self, path: str, text: str) -> None:
        line = f"{self.where(path)}: {text}"
        if line not in self.problems:
            self.problems.append(line)

    def remark(self, path: str, kind: str, text: str) -> None:
        remark = Remark(self.where(path), kind, text)
        if remark not in self.remarks:
            self.remarks.append(remark)

    def unknown(self, path: str, name: str, known: Iterable[str]) -> None:
        """A key that nobody reads, with the nearest name that somebody does."""
        nearest = difflib.get_close_matches(name, list(known), n=1, cutoff=0.6)
        hint = f"; did you mean {nearest[0]}?" if nearest else ""
        self.remark(path, UNKNOWN, f"unknown, nothing reads it{hint}")

    def raise_problems(self) -> None:
        """Raises InputError when there was any problem."""
        if self.problems:
            raise InputError(self.problems)


def join(*parts: str) -> str:
    """A path from its parts; empty ones do not count."""
    return "/".join(part for part in parts if part)
