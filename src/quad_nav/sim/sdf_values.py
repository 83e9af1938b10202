"""Poses and numbers in SDF files; faults are collected with their lines."""

from __future__ import annotations

import math
from pathlib import Path
from typing import List, Optional

from quad_nav.files.xml_tree import Element
from quad_nav.geometry import Pose3D, quaternion_from_euler

MAX_LENGTH_M = 1e5
IDENTITY = Pose3D(0.0, 0.0, 0.0)
_TRUE = ("true", "1")


class NotRepresented(Exception):
    """Reason in a few words why an element is left out of the scene."""


class SdfReader:
    """Reader of the values in one file; adds a message to ``problems`` for each fault."""

    def __init__(self, path: Path, problems: List[str]) -> None:
        self.path = path
        self.problems = problems

    def fault(self, element: Element, problem: str) -> None:
        """Add a fault of an element."""
        self.problems.append(f"{self.path}: line {element.line}: <{element.tag}>: {problem}")

    def pose(self, parent: Element, default: Pose3D = IDENTITY) -> Pose3D:
        """Return the ``<pose>`` of an element, relative to the element that contains it.

        Raises:
            NotRepresented: The pose is relative to a named frame.
        """
        element = parent.first("pose")
        if element is not None and element.attributes.get("relative_to", "world") != "world":
            raise NotRepresented("pose relative to a named frame")
        if element is None or not element.text.strip():
            return default
        if element.attributes.get("rotation_format") == "quat_xyzw":
            values = self.numbers(element, 7, "x y z and a quaternion x y z w")
            length = math.sqrt(sum(v * v for v in values[3:])) if values else 0.0
            if not values or length == 0.0:
                return default
            qx, qy, qz, qw = (v / length for v in values[3:])
            return Pose3D(values[0], values[1], values[2], (qx, qy, qz, qw))
        values = self.numbers(element, 6, "x y z roll pitch yaw")
        if not values:
            return default
        unit = math.pi / 180 if element.attributes.get("degrees") in _TRUE else 1.0
        roll, pitch, yaw = (unit * v for v in values[3:])
        return Pose3D(values[0], values[1], values[2], quaternion_from_euler(roll, pitch, yaw))

    def length(self, parent: Element, tag: str) -> float:
        """Return a length above 0 in m, NaN after a fault."""
        return self.lengths(parent, tag, 1, "a number of metres")[0]

    def lengths(self, parent: Element, tag: str, count: int, expected: str) -> List[float]:
        """Return lengths above 0 in m, NaNs after a fault."""
        element = parent.first(tag)
        faulty = [math.nan] * count
        if element is None:
            self.fault(parent, f"<{tag}> is missing, expected {expected}")
            return faulty
        values = self.numbers(element, count, expected)
        if values and min(values) <= 0.0:
            self.fault(element, f"'{element.text.strip()}', expected {expected}, above 0")
            return faulty
        return values or faulty

    def numbers(self, element: Element, count: int, expected: str) -> Optional[List[float]]:
        """Return the finite numbers of a text, separated by blanks; None after a fault."""
        text = element.text.strip()
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        if len(values) != count or not all(abs(v) <= MAX_LENGTH_M for v in values):
            self.fault(element, f"'{text}', expected {expected}")
            return None
        return values


def is_true(text: str) -> bool:
    """Return whether a text is SDF's true."""
    return text.strip().lower() in _TRUE
