"""Faults and remarks that are found while a configuration is read, each with its place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Iterable, List, Mapping, Optional, Sequence

from quad_nav.errors import InputError
from quad_nav.files.values import nearest

ERROR = "error"  # no navigator starts with it
UNKNOWN = "unknown"  # move_base does not know the key either
UNSUPPORTED = "unsupported"  # move_base knows it, this package does not
IGNORED = "ignored"  # move_base ignores it too
UNUSED = "unused"  # of a planner that is not chosen
CLAMPED = "clamped"  # the value in force differs
RENAMED = "renamed"  # an old name that still works
CAUTION = "caution"  # legal, but probably a mistake
MAPPED = "mapped"  # of another robot: flown with the quadcopter's own
LEFT_OUT = "left out"  # of another robot: the quadcopter has none
OTHER_ROBOT = "other_robot"
"""Parameter with the lines about what was mapped and left out, for a navigator's log."""
NO_EFFECT = (UNKNOWN, UNSUPPORTED, IGNORED, UNUSED, CLAMPED)
"""Kinds of remarks on values that do not do what they say."""


@dataclass(frozen=True)
class Remark:
    """One fault or remark, a line of ``quad check``.

    Attributes:
        place: Path of the parameter.
        kind: One of the kinds above.
        text: What is wrong or odd, and what was expected.
        origin: "file:line" of a value that a file sets.
        nearest: The known name that is most similar to an unknown one, if there is any.
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
    """Parameters with faults.

    Attributes:
        faults: The faults; each is a line of the error's message.
        remarks: Remarks on the other parameters.
    """

    def __init__(self, faults: Sequence[Remark], remarks: Sequence[Remark]) -> None:
        super().__init__([str(fault) for fault in faults])
        self.faults = tuple(faults)
        self.remarks = tuple(remarks)


class Notes:
    """Collect faults and remarks while a tree is read.

    ``place`` is the prefix of all paths, such as the node's name; ``origins`` has "file:line" of
    values that come from files.
    """

    def __init__(self, place: str, origins: Optional[Mapping[str, str]] = None) -> None:
        self._place = place
        self._origins = origins or {}
        self._moved: Dict[str, str] = {}
        self.faults: List[Remark] = []
        self.remarks: List[Remark] = []

    def moved(self, path: str, written_at: str) -> None:
        """Name another place, where the value at ``path`` was written, in messages about it."""
        self._moved[path] = self._moved.get(written_at, written_at)

    def problem(self, path: str, text: str) -> None:
        """Add a fault."""
        fault = self._about(path, ERROR, text)
        if fault not in self.faults:
            self.faults.append(fault)

    def remark(self, path: str, kind: str, text: str, nearest: str = "") -> None:
        """Add a remark."""
        remark = self._about(path, kind, text, nearest)
        if remark not in self.remarks:
            self.remarks.append(remark)

    def _about(self, path: str, kind: str, text: str, nearest: str = "") -> Remark:
        path = self._moved.get(path, path)
        place = self._place.rstrip("/") + "/" + path if path else self._place
        return Remark(place, kind, text, self._origins.get(path, ""), nearest)

    def unknown(self, path: str, name: str, known: Iterable[str]) -> None:
        """Add a remark on an unknown key, with the nearest of the known names."""
        self.remark(path, UNKNOWN, "unknown parameter, nothing reads it", nearest(name, known))

    def raise_problems(self) -> None:
        """Raise an error if there is any fault.

        Raises:
            ParameterError: There are faults.
        """
        if self.faults:
            raise ParameterError(self.faults, self.remarks)


def join(*parts: str) -> str:
    """Join the parts of a path; empty parts are left out."""
    return "/".join(part for part in parts if part)


def without_effect(remarks: Iterable[Remark], paths: Sequence[str], where: str) -> List[str]:
    """Return a line for each parameter at ``paths`` that does not do what it says.

    ``where`` is the name of the configuration that they are set on top of.
    """
    own = [f"/{path.strip('/')}/" for path in paths]
    return [
        f"{remark}; expected a parameter that has an effect in {where}"
        for remark in remarks
        if remark.kind in NO_EFFECT and any(path.startswith(f"{remark.place}/") for path in own)
    ]
