"""One goal of a goal file: ``[x, y]``, ``[x, y, yaw]``, or an object with further settings.

Metres and radians in ``map``. ``{"x": 1.0, "y": 2.0, "yaw": null, "wait_s": 5.0}`` is an object
without a yaw.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterable, List, Mapping, NamedTuple, Optional, Tuple, Union

from quad_nav.files.values import expected_name, is_number
from quad_nav.geometry import Pose2D, angle_difference

MAX_COORDINATE_M = 1e6
"""Largest coordinate of a goal, and largest tolerance."""
MAX_TIMEOUT_S = 1e9


@dataclass(frozen=True)
class Goal:
    """Position in ``map``; without a yaw the robot may face in the direction of its path.

    Attributes:
        x_m: Position in ``map``.
        y_m: Position in ``map``.
        yaw_rad: Yaw that the robot must have, None for any.
        wait_s: Time that the robot stays before it gets its next goal.
        tolerance_m: Distance within which the goal counts as reached, None for the file's.
        yaw_tolerance_rad: Error of the yaw within which it counts as reached, None for the file's.
    """

    x_m: float
    y_m: float
    yaw_rad: Optional[float] = None
    wait_s: float = 0.0
    tolerance_m: Optional[float] = None
    yaw_tolerance_rad: Optional[float] = None

    @property
    def pose(self) -> Pose2D:
        """Pose in ``map``, with yaw 0 if the goal has none."""
        return Pose2D(self.x_m, self.y_m, self.yaw_rad or 0.0)

    def is_same_pose(self, other: Goal) -> bool:
        """Return whether another goal has the same position and yaw."""
        return (self.x_m, self.y_m, self.yaw_rad) == (other.x_m, other.y_m, other.yaw_rad)

    def yaw_error_rad(self, pose: Pose2D) -> Optional[float]:
        """Return a pose's yaw less the goal's, from -pi to pi; None for a goal without yaw."""
        return None if self.yaw_rad is None else angle_difference(pose.yaw_rad, self.yaw_rad)


class Setting(NamedTuple):
    """Field of ``SequenceSettings`` or ``Goal``, test for a value, and phrase for messages."""

    field: str
    accepts: Callable[[Any], bool]
    expected: str


def position_tolerance(field: str) -> Setting:
    """Return the setting of a distance within which a goal counts as reached."""
    return Setting(
        field,
        lambda v: is_number(v) and 0 < v <= MAX_COORDINATE_M,
        f"a number of metres above 0, {MAX_COORDINATE_M:g} at most",
    )


YAW_TOLERANCE = Setting(
    "yaw_tolerance_rad",
    lambda v: is_number(v) and 0 < v <= math.pi,
    "a number of radians above 0, pi at most",
)
GOAL_SETTINGS: Dict[str, Setting] = {
    "wait_s": Setting(
        "wait_s",
        lambda v: is_number(v) and 0 <= v <= MAX_TIMEOUT_S,
        f"a number of seconds, 0 to {MAX_TIMEOUT_S:g}",
    ),
    "tolerance": position_tolerance("tolerance_m"),
    "yaw_tolerance": YAW_TOLERANCE,
}
GOAL_KEYS: Tuple[str, ...] = ("x", "y", "yaw", *GOAL_SETTINGS)
ALTITUDES = ("altitude", "alt", "height", "z")
"""Keys by which people ask for an altitude."""
_FORMS = '[x, y] or [x, y, yaw], or an object with "x" and "y"'


def goal_entry(goal: Goal) -> Union[List[float], Dict[str, Optional[float]]]:
    """Return a goal as a goal file has it: a list, or an object if it has further settings."""
    pose = [goal.x_m, goal.y_m] if goal.yaw_rad is None else [goal.x_m, goal.y_m, goal.yaw_rad]
    settings = {key: getattr(goal, setting.field) for key, setting in GOAL_SETTINGS.items()}
    given = {key: value for key, value in settings.items() if value}
    return {**dict(zip(GOAL_KEYS, pose)), **given} if given else pose


def read_goal(entry: Any) -> Goal:
    """Return the goal of an entry without faults."""
    if isinstance(entry, list):
        return Goal(*entry)
    settings = {one.field: entry[key] for key, one in GOAL_SETTINGS.items() if key in entry}
    return Goal(entry["x"], entry["y"], entry.get("yaw"), **settings)


def goal_faults(entry: Any) -> Iterable[str]:
    """Return what is wrong with an entry of the list of goals, each as ``: fault; expected``."""
    if isinstance(entry, dict):
        return [*_key_faults(entry), *_pose_faults(entry), *_setting_faults(entry)]
    if not isinstance(entry, list):
        return [f": is {show(entry)}; expected {_FORMS}"]
    if len(entry) not in (2, 3):
        return [f": has {len(entry)} numbers; expected {_FORMS}"]
    return _pose_faults(dict(zip(GOAL_KEYS, entry)))


def _pose_faults(entry: Mapping[str, Any]) -> Iterable[str]:
    for label in ("x", "y"):
        value = entry.get(label)
        if label in entry and not is_number(value):
            yield f": {label} is {show(value)}; expected a finite number of metres"
        elif label in entry and abs(entry[label]) > MAX_COORDINATE_M:
            yield f": {label} is {value:g}; expected {MAX_COORDINATE_M:g} metres at most"
    yaw = entry.get("yaw")
    if yaw is not None and not is_number(yaw):
        yield f": yaw is {show(yaw)}; expected a finite number of radians, or null"
    elif yaw is not None and abs(yaw) > 2 * math.pi:
        yield (
            f": yaw is {yaw:g}; expected radians between -2 pi and 2 pi "
            f"({yaw:g} degrees are {math.radians(yaw):.4g})"
        )


def _key_faults(entry: Mapping[str, Any]) -> Iterable[str]:
    """Yield the faults in the keys of a goal that is an object."""
    for key in ("x", "y"):
        if key not in entry:
            yield f": has no {key}; expected a number of metres"
    for key in entry:
        if key.lower() in ALTITUDES:
            yield f": {altitude_fault(key)}"
        elif key not in GOAL_KEYS:
            expected = expected_name(key.lower(), GOAL_KEYS)
            yield f": {key} is not a key of goals; expected {expected}"


def _setting_faults(entry: Mapping[str, Any]) -> Iterable[str]:
    for key, setting in GOAL_SETTINGS.items():
        if key in entry and not setting.accepts(entry[key]):
            yield f": {key} is {show(entry[key])}; expected {setting.expected}"
    if "yaw_tolerance" in entry and entry.get("yaw") is None:
        yield ": yaw_tolerance has no effect without a yaw; expected a yaw in radians"


def altitude_fault(key: str) -> str:
    """Return why an altitude is refused, under whatever key."""
    return (
        f"{key} cannot be set for a goal: all quadcopters fly at the scene's altitude; "
        "expected none here, and altitude in the scene file"
    )


def show(value: Any) -> str:
    """Return a value as the file shows it, shortened."""
    text = f"{value:g}" if isinstance(value, float) and math.isfinite(value) else json.dumps(value)
    return text if len(text) <= 40 else text[:37] + "..."
