"""Validate the contents of ``/quad/flight`` and ``/quad/events`` of a recording.

A recording may come from anywhere, so no type is trusted. Every function raises ValueError
with the key, the value and what was expected.
"""

from __future__ import annotations

import math
from typing import Any, Dict, Mapping, Optional

from quad_nav.config.differences import differences
from quad_nav.geometry import Pose3D
from quad_nav.mission.goal import goal_faults

LARGEST_M = 1e6
MAX_SECONDS = 1e10
"""Larger than any stamp: stamps hold 32 bits of seconds."""
LARGEST_HZ = 1e6
MAX_ROBOTS = 100
MAX_GOALS = 100_000
_UNIT_WITHIN = 1e-2
_MOST_LEVELS = 50
_LONGEST_TEXT = 10_000


def checked_flight(info: Mapping[str, Any]) -> Dict[str, Any]:
    """Return the known keys of a ``/quad/flight`` object; the scene is not validated yet.

    Raises:
        ValueError: A value has the wrong type or range.
    """
    given = {key: info[key] for key in ("scene",) if key in info}
    for key in ("title", "config", "reason"):
        if key in info:
            given[key] = _text(info, key)
    if "start_s" in info:
        given["start_s"] = _number(info, "start_s", MAX_SECONDS)
    for key in ("robot_radius_m", "jitter_m"):
        if key in info:
            given[key] = _number(info, key, LARGEST_M)
    if info.get("seed") is not None:
        given["seed"] = _whole(info, "seed")
    if "versions" in info:
        given["versions"] = {
            str(key): str(value) for key, value in _mapping(info["versions"], "versions").items()
        }
    if "robots" in info:
        given["robots"] = [_robot(robot) for robot in _list(info, "robots", MAX_ROBOTS)]
    return given


def checked_event(event: Mapping[str, Any]) -> Dict[str, Any]:
    """Return the known keys of a ``/quad/events`` object; ``event`` is None for unknown kinds.

    Raises:
        ValueError: A value has the wrong type or range.
    """
    robot = _whole(event, "robot")
    if not 0 <= robot < MAX_ROBOTS:
        raise ValueError(f"robot: {robot}, expected 0 to {MAX_ROBOTS - 1}")
    kind = event.get("event")
    if kind not in ("sent", "ended"):
        return {"robot": robot, "event": None}
    checked: Dict[str, Any] = {
        "robot": robot,
        "event": kind,
        "time_s": _number(event, "time_s", MAX_SECONDS),
    }
    if kind == "ended":
        has_error = event.get("yaw_error_rad") is not None  # a goal without yaw has none
        return {
            **checked,
            "yaw_error_rad": _number(event, "yaw_error_rad", math.pi) if has_error else None,
            "reached": event.get("reached") is True,
            "reason": _text(event, "reason"),
            "attempts": _whole(event, "attempts"),
        }
    places = {key: _number(event, key, LARGEST_M) for key in ("x_m", "y_m", "yaw_rad")}
    return {
        **checked,
        **places,
        "goal": _whole(event, "goal"),
        "lap": _whole(event, "lap"),
        "why": _text(event, "why"),
    }


def require_finite(values: Any, largest: float = LARGEST_M) -> None:
    """Check numbers.

    Raises:
        ValueError: A number is not finite or its magnitude exceeds ``largest``.
    """
    for value in values:
        if not abs(value) <= largest:
            raise ValueError(f"{value}, expected a finite number up to {largest:g}")


def checked_pose(pose: Pose3D) -> Pose3D:
    """Return the pose if its numbers are finite and its quaternion has unit length.

    Raises:
        ValueError: Otherwise.
    """
    require_finite((pose.x_m, pose.y_m, pose.z_m))
    length = math.sqrt(sum(part * part for part in pose.quaternion))
    if not abs(length - 1.0) < _UNIT_WITHIN:
        raise ValueError(f"rotation of length {length:g}, expected a unit quaternion")
    return pose


def _robot(value: Any) -> Dict[str, Any]:
    fields = _mapping(value, "robots")
    parameters = _mapping(fields.get("parameters", {}), "parameters")
    _check_levels(parameters, _MOST_LEVELS)
    if (
        "controller_frequency" in parameters
        and not _number(parameters, "controller_frequency", LARGEST_HZ) > 0
    ):
        raise ValueError("controller_frequency: expected a number above 0")
    try:
        differences(parameters)
    except (LookupError, TypeError, AttributeError, ValueError) as error:
        raise ValueError(f"parameters: {error!r}, expected move_base's tree") from error
    given: Dict[str, Any] = {"parameters": parameters}
    if "name" in fields:
        given["name"] = _text(fields, "name")
    if "goals" in fields:
        given["goals"] = _goals(fields)
    return given


def _goals(fields: Mapping[str, Any]) -> Any:
    goals = _list(fields, "goals", MAX_GOALS)
    for number, entry in enumerate(goals):
        fault = next(iter(goal_faults(entry)), "")
        if fault:
            raise ValueError(f"goals[{number}]{fault}")
    return goals


def _check_levels(value: Any, left: int) -> None:
    if left == 0:
        raise ValueError(f"parameters: nested more than {_MOST_LEVELS} levels deep, expected fewer")
    nested = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    for entry in nested:
        _check_levels(entry, left - 1)


def _mapping(value: Any, key: str) -> Dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{key}: {_short(value)}, expected an object")
    return value


def _list(fields: Mapping[str, Any], key: str, most: int) -> Any:
    value = fields[key]
    if not isinstance(value, list) or len(value) > most:
        raise ValueError(f"{key}: {_short(value)}, expected a list of {most} at most")
    return value


def _text(fields: Mapping[str, Any], key: str) -> str:
    """Return a text without unprintable characters, which would break text output."""
    value: Optional[Any] = fields.get(key)
    if not isinstance(value, str):
        raise ValueError(f"{key}: {_short(value)}, expected a text")
    return "".join(c for c in value[:_LONGEST_TEXT] if c.isprintable() or c == "\n")


def _number(fields: Mapping[str, Any], key: str, largest: float) -> float:
    value = fields.get(key)
    if (
        isinstance(value, bool)
        or not isinstance(value, (int, float))
        or (not math.isfinite(value) or abs(value) > largest)
    ):
        raise ValueError(f"{key}: {_short(value)}, expected a number up to {largest:g}")
    return value


def _whole(fields: Mapping[str, Any], key: str) -> int:
    value = fields.get(key)
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{key}: {_short(value)}, expected a whole number")
    return value


def _short(value: Any) -> str:
    return repr(value)[:60]
