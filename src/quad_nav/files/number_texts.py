"""Convert strings that hold lists of numbers: footprints and velocities."""

from __future__ import annotations

from typing import Any, Optional, Sequence, Tuple

import numpy as np
import yaml

from quad_nav.files import plain_yaml

Polygon = Tuple[Tuple[float, float], ...]


def polygon_from_text(text: str) -> Optional[Polygon]:
    """Convert a footprint's string to vertices in metres.

    As in move_base the numbers are rounded to float32.

    Returns:
        The vertices, or None for "" and "[]": a circular footprint.

    Raises:
        ValueError: The string is not a list of at least three [x, y].
    """
    if text.strip() in ("", "[]"):
        return None
    try:
        points = plain_yaml.load(text)
    except yaml.YAMLError:
        raise ValueError("not a list") from None
    return polygon_from_list(points)


def polygon_from_list(points: Any) -> Optional[Polygon]:
    """Convert a footprint's list to vertices in metres; None for an empty list.

    Raises:
        ValueError: The list has fewer than three points, or an entry is not [x, y].
    """
    if points == []:
        return None
    if not isinstance(points, list) or len(points) < 3:
        raise ValueError("fewer than three points")
    return tuple(_vertex(point) for point in points)


def text_from_polygon(polygon: Sequence[Tuple[float, float]]) -> str:
    """Convert vertices to a string as move_base does for the parameter server: six digits."""
    return "[" + ",".join(f"[{x:g},{y:g}]" for x, y in polygon) + "]"


def numbers_from_text(text: str) -> Tuple[float, ...]:
    """Convert a string such as ``-0.3, 0.3`` to numbers.

    Raises:
        ValueError: A word is not a finite number.
    """
    words = text.strip().strip("[]").replace(",", " ").split()
    numbers = tuple(float(word) for word in words)
    if not np.all(np.isfinite(numbers)):
        raise ValueError("not finite")
    return numbers


def _vertex(point: Any) -> Tuple[float, float]:
    if not isinstance(point, list) or len(point) != 2:
        raise ValueError(f"{point!r} is not a point [x, y]")
    for number in point:
        if (
            isinstance(number, bool)
            or not isinstance(number, (int, float))
            or (not np.isfinite(number))
        ):
            raise ValueError(f"{number!r} is not a number")
    # Rounded to six digits and float32, as in move_base.
    x, y = (float(np.float32(f"{number:g}")) for number in point)
    return (x, y)
