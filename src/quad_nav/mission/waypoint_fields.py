"""Names of the values of a waypoint in other people's files, and the goal that they make.

Names are those of messages (``pose.orientation.z``), columns (``x_m``, ``yaw [deg]``) and
parameters (``goalYaw``). Quaternions and angles become a yaw as move_base sees it.
"""

from __future__ import annotations

import math
import re
from typing import Any, Dict, Iterable, List, Mapping, NamedTuple, Optional, Tuple

from quad_nav.files.values import is_number


class Value(NamedTuple):
    """A value and the line of the file that has it."""

    value: Any
    line: int


Record = Dict[str, Value]
"""Values of a waypoint by their fields; ``PLACE`` has the line on which it begins."""
PLACE = "place"
LISTS: Dict[int, Tuple[str, ...]] = {
    2: ("x", "y"),
    3: ("x", "y", "yaw"),
    4: ("x", "y", "z", "yaw"),
    6: ("x", "y", "z", "roll", "pitch", "yaw"),
    7: ("x", "y", "z", "qx", "qy", "qz", "qw"),
}
"""Fields of a list of numbers without names."""
_UNITS = {
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("rad", "rads", "radian", "radians"), "rad"),
    **dict.fromkeys(("deg", "degs", "degree", "degrees"), "deg"),
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
}
_ROTATIONS = {"orientation", "orient", "ori", "rotation", "rot", "quaternion", "quat", "q", "o"}
_ANGLES = {"euler", "rpy", "angles"}
_YAWS = {"yaw", "theta", "heading", "angle", "th", "orientation", "rotation"}
_WAITS = {"wait", "waiting", "hold", "pause", "stay", "dwell"}
_POSITIONS = {
    **dict.fromkeys(("x", "east", "easting"), "x"),
    **dict.fromkeys(("y", "north", "northing"), "y"),
    **dict.fromkeys(("z", "height", "altitude", "alt"), "z"),
    **dict.fromkeys(("lat", "latitude"), "lat"),
    **dict.fromkeys(("lon", "lng", "long", "longitude"), "lon"),
}
_NOT_OF_A_POSE = set(
    "linear angular twist vel velocity acc acceleration covariance scale size color colour"
    " tolerance origin offset verts vertices footprint polygon".split()
)
_TILT = 1e-3
"""Upstream discards a goal whose z axis is further from the vertical (``isQuaternionValid``)."""


def field_of(*names: str) -> str:
    """Return the field that a name, with the names above it, stands for; "" for none.

    Args:
        names: As ("pose", "orientation", "z") or ("field.pose.orientation.z",).
    """
    tokens = [token for name in names for token in _tokens(name)]
    unit = ""
    while len(tokens) > 1 and tokens[-1] in _UNITS:
        unit = _UNITS[tokens.pop()]
    if not tokens or _NOT_OF_A_POSE & set(tokens):
        return ""
    last, above = tokens[-1], set(tokens[:-1])
    if last == "frame" or (last == "id" and "frame" in above):
        return "frame"
    if _WAITS & set(tokens):
        return "wait_s"
    if re.fullmatch("[qo][xyzw]", last) or (last in set("xyzw") and _ROTATIONS & above):
        return "q" + last[-1]
    if _ANGLES & above:
        return "yaw" if last in ("z", "yaw") else ""
    if last in _YAWS:
        return "yaw_deg" if unit == "deg" else "yaw"
    return "w" if last == "w" else _POSITIONS.get(last, "")


def list_fields(count: int, name: str, beside: Iterable[str]) -> Tuple[str, ...]:
    """Return the fields of a list of numbers; () for a list that is no part of a pose.

    Args:
        count: Number of its values.
        name: The key of the list, "" for none.
        beside: The keys of the mapping that it is in.
    """
    tokens = set(_tokens(name))
    if not is_of_a_pose(name):
        return ()
    if _ANGLES & tokens or (_ROTATIONS & tokens and count == 3):
        return ("roll", "pitch", "yaw") if count == 3 else ()
    if (
        _ROTATIONS & tokens
    ):  # Nav2's panel of RViz writes pose: [x, y, z], orientation: [w, x, y, z]
        order = "wxyz" if "pose" in beside else "xyzw"
        return tuple("q" + axis for axis in order) if count == 4 else ()
    if field_of(name):  # a column
        return ()
    is_turned = any((_YAWS | _ROTATIONS | _ANGLES) & set(_tokens(key)) for key in beside)
    is_place = is_turned or {"position", "point", "translation", "xyz", "pos"} & tokens
    return ("x", "y", "z") if count == 3 and is_place else LISTS.get(count, ())


def is_of_a_pose(name: str) -> bool:
    """Return whether values below a name may be those of a pose."""
    return not _NOT_OF_A_POSE & set(_tokens(name))


def is_position(fields: Iterable[str]) -> bool:
    """Return whether fields are enough for a goal."""
    found = set(fields)
    return {"x", "y"} <= found or {"lat", "lon"} <= found


def number_of(value: Any) -> Optional[float]:
    """Return a finite number, also of a text such as 1e-05, which YAML does not read as one."""
    if isinstance(value, str):
        try:
            value = float(value)
        except ValueError:
            return None
    return float(value) if is_number(value) else None


def yaw_of(x: float, y: float, z: float, w: float) -> Tuple[Optional[float], str]:
    """Return the yaw of a quaternion and what is wrong with it.

    A quaternion of zeros was never set: it has no yaw, where move_base discards the goal.
    """
    square = x * x + y * y + z * z + w * w
    if square < 1e-6:
        return None, ""
    if 2.0 * (x * x + y * y) / square > _TILT:
        return None, (
            f"the rotation ({x:g}, {y:g}, {z:g}, {w:g}) tilts the robot; expected a quaternion "
            "(x, y, z, w) about the z axis"
        )
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z), ""


def entry_of(record: Record, degrees: bool) -> Tuple[Dict[str, Optional[float]], List[str]]:
    """Return the goal of a record as a goal file has it, and its faults.

    Args:
        record: The record.
        degrees: Whether yaws without a unit are degrees.
    """
    problems: List[str] = []
    numbers = {key: _number(key, record, problems) for key in record if key in _NUMBERS}
    for key in ("x", "y"):
        if key not in record:
            problems.append(f": has no {key}; expected a number of metres")
    entry = {key: numbers.get(key) for key in ("x", "y")}
    if problems:
        return entry, problems
    yaw, problem = _yaw(numbers, degrees)
    wait_s = numbers.get("wait_s") or 0.0
    entry["yaw"] = yaw
    if wait_s:
        entry["wait_s"] = wait_s
    return entry, [f": {problem}"] if problem else []


_NUMBERS = ("x", "y", "z", "yaw", "yaw_deg", "qx", "qy", "qz", "qw", "w", "wait_s")
_NEEDED = ("x", "y")


def _number(key: str, record: Record, problems: List[str]) -> Optional[float]:
    value = record[key].value
    if key not in _NEEDED and (value in (None, "") or value is False):
        return None
    number = number_of(value)
    if number is None:
        problems.append(f": {key} is {value!r}; expected a finite number")
    return number


def _yaw(numbers: Mapping[str, Optional[float]], degrees: bool) -> Tuple[Optional[float], str]:
    """Return the yaw, None if there is none or it is wrong, and what is wrong."""
    x, y, z, w = (numbers.get(key) for key in ("qx", "qy", "qz", "qw"))
    if w is None and z is None and numbers.get("w") is not None:  # {x, y, z, w}: a planar pose
        z, w = numbers.get("z"), numbers["w"]
    if z is not None and w is not None:
        return yaw_of(x or 0.0, y or 0.0, z, w)
    angle_deg, angle = numbers.get("yaw_deg"), numbers.get("yaw")
    if angle_deg is None and degrees:
        angle_deg = angle
    if angle_deg is not None:
        return math.radians(math.remainder(angle_deg, 360.0)), ""
    if angle is not None and abs(angle) > 2.0 * math.pi:
        return angle, (
            f"yaw is {angle:g}; expected radians, or a name with a unit as yaw_deg, or the option "
            "--degrees of quad goals convert"
        )
    return angle, ""


def _tokens(name: str) -> List[str]:
    split = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()
    return re.findall("[a-z]+", split.replace("°", "deg"))
