"""What is to be said about a configuration: every fault and every remark, with its place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Iterable, List, Mapping, Optional, Sequence

from quad_nav.errors import InputError
from quad_nav.files.values import nearest

ERROR = "error"  # nothing flies with it
UNKNOWN = "unknown"  # move_base does not know the key either
UNSUPPORTED = "unsupported"  # move_base knows it, this package does not
IGNORED = "ignored"  # the original reads past it as well
UNUSED = "unused"  # of a planner that does not fly
CLAMPED = "clamped"  # the value in force is another one
RENAMED = "renamed"  # an old name, still honoured
CAUTION = "caution"  # legal, and probably not what was meant


@dataclass(frozen=True)
class Remark:
    """One line of ``quad check``: where, which kind, what about it.

    ``origin``: "file:line" where the value was written, when it came from a file.
    ``nearest``: the known name that an unknown one is most like, if there is one.
    """

    place: str
    kind: str
    text: str
    origin: str = ""
    nearest: str = ""

    def __str__(self) -> str:
        where = f"{self.place} ({self.origin})" if self.origin else self.place
        hint = f"; did you mean {self.nearest}?" if self.nearest else ""
        return f"{where}: {self.text}{hint}"


class ParameterError(InputError):
    """Parameters that nothing flies with: ``faults``, and ``remarks`` on the others."""

    def __init__(self, faults: Sequence[Remark], remarks: Sequence[Remark]):
        super().__init__([str(fault) for fault in faults])
        self.faults = tuple(faults)
        self.remarks = tuple(remarks)


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
        self.faults: List[Remark] = []
        self.remarks: List[Remark] = []

    def moved(self, path: str, written_at: str) -> None:
        """The value at ``path`` was written at another place; complaints name that one."""
        self._moved[path] = self._moved.get(written_at, written_at)

    @property
    def problems(self) -> List[str]:
        """The faults as lines."""
        return list(map(str, self.faults))

    def problem(self, path: str, text: str) -> None:
        fault = self._about(path, ERROR, text)
        if fault not in self.faults:
            self.faults.append(fault)

    def remark(self, path: str, kind: str, text: str, nearest: str = "") -> None:
        remark = self._about(path, kind, text, nearest)
        if remark not in self.remarks:
            self.remarks.append(remark)

    def _about(self, path: str, kind: str, text: str, nearest: str = "") -> Remark:
        path = self._moved.get(path, path)
        place = self._place.rstrip("/") + "/" + path if path else self._place
        return Remark(place, kind, text, self._origins.get(path, ""), nearest)

    def unknown(self, path: str, name: str, known: Iterable[str]) -> None:
        """A key that nobody reads, with the nearest name that somebody does."""
        self.remark(path, UNKNOWN, "unknown, nothing reads it", nearest(name, known))

    def raise_problems(self) -> None:
        """Raises ParameterError when there was any problem."""
        if self.faults:
            raise ParameterError(self.faults, self.remarks)


def join(*parts: str) -> str:
    """A path from its parts; empty ones do not count."""
    return "/".join(part for part in parts if part)
