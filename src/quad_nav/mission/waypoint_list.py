"""Other people's lists of waypoints: the format is recognised by the contents of a file.

``waypoint_tree`` reads YAML and JSON, ``waypoint_table`` CSV and the goals of tuw_multi_robot,
``qgroundcontrol`` missions. ``docs/goals.md`` lists the formats.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, replace
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

from quad_nav.errors import InputError
from quad_nav.mission.goal import GOAL_KEYS
from quad_nav.mission.qgroundcontrol import (
    WPL,
    Mission,
    Position,
    local_position,
    read_plan,
    read_wpl,
)
from quad_nav.mission.waypoint_fields import (
    PLACE,
    Record,
    Value,
    entry_of,
    field_of,
    number_of,
)
from quad_nav.mission.waypoint_table import TUW, read_table, read_tuw
from quad_nav.mission.waypoint_tree import NamedRecords, find_lists, frames, read_documents

_MAP_FRAMES = {"", "map", "world"}


class Entry(NamedTuple):
    """A goal as a goal file has it, where it is in the file, and its faults."""

    value: Dict[str, Any]
    place: str
    faults: List[str]


@dataclass(frozen=True)
class WaypointList:
    """A file of waypoints.

    Attributes:
        kind: What the file was read as.
        robots: A list of waypoints for each robot.
        datum: Position that is (0, 0) of the map, if the waypoints are geographic.
        datum_is: What that position is.
        notes: What was left out or taken for granted.
        degrees: Whether yaws without a unit are degrees.
    """

    kind: str
    robots: Tuple[NamedRecords, ...]
    datum: Optional[Position] = None
    datum_is: str = "home"
    notes: Tuple[str, ...] = ()
    degrees: bool = False

    def entries(self, robot: int) -> List[Entry]:
        """Return the goals of a robot."""
        return [self._entry(record) for record in self.robots[robot].records]

    def line(self, robot: int) -> str:
        """Say what the file was read as, and what of it is not flown."""
        own = self.robots[robot]
        count = len(own.records)
        parts = [f"read as {self.kind}: {count} goal{'s' * (count != 1)}"]
        if len(self.robots) > 1:
            parts[0] += f" of {own.name or 'a robot'}, one of {len(self.robots)} robots"
        if self.datum is not None:
            lat, lon = self.datum
            parts.append(f"(0, 0) is {self.datum_is}, lat {lat:.7f}, lon {lon:.7f}")
        if any(number_of(one["z"].value) for one in own.records if "z" in one):
            parts.append("heights (z) left out")
        return "; ".join([*parts, *self.notes])

    def _entry(self, record: Record) -> Entry:
        value, line = record[PLACE]
        if value is not None:
            return Entry({}, f"line {line}", [f": {value}"])
        if len(record) == 1:
            return Entry({}, f"line {line}", [": is no waypoint; expected x and y"])
        problem = ""
        if "x" not in record and "lat" in record and "lon" in record:
            record, problem = self._projected(record)
        entry, faults = ({}, [f": {problem}"]) if problem else entry_of(record, self.degrees)
        return Entry(entry, f"line {line}", faults)

    def _projected(self, record: Record) -> Tuple[Record, str]:
        position = _degrees(record)
        if position is None or self.datum is None:
            lat, lon = record["lat"].value, record["lon"].value
            return record, f"lat {lat}, lon {lon}; expected degrees"
        x_m, y_m = local_position(position, self.datum)
        line = record["lat"].line
        return {**record, "x": Value(x_m, line), "y": Value(y_m, line)}, ""


def read_waypoints(text: str, name: str) -> Optional[WaypointList]:
    """Read a list of waypoints; None for a text that is a goal file, or nothing that is known.

    Raises:
        InputError: The text is of a known format and has faults; lists all of them.
    """
    try:
        found = _read(text)
    except InputError as error:
        raise InputError([f"{name}: {problem}" for problem in error.problems]) from error
    if found is None:
        return None
    numbers = [re.findall(r"\d+", one.name)[-1:] for one in found.robots]
    if all(numbers) and len({int(one[0]) for one in numbers}) == len(numbers):
        order = sorted(range(len(numbers)), key=lambda k: int(numbers[k][0]))
        found = replace(found, robots=tuple(found.robots[k] for k in order))
    return found


def _read(text: str) -> Optional[WaypointList]:
    start = text.lstrip()
    if start.startswith(WPL):
        return _mission(read_wpl(text), "a mission of QGroundControl (WPL)")
    if start.startswith(TUW):
        return WaypointList("goals of tuw_multi_robot", tuple(read_tuw(text)))
    if start[:1] in ("{", "["):
        return _read_tree(text) if _is_of_others(text) else None
    if not start or start.startswith('"goals"'):
        return None
    table = read_table(text)
    if table is not None:
        kind, records = table
        return _with_datum(WaypointList(kind, (NamedRecords("", records),)))
    return _read_tree(text)


def _read_tree(text: str) -> Optional[WaypointList]:
    documents = read_documents(text)
    if documents and isinstance(documents[0].value, dict):
        kind = documents[0].value.get("fileType")
        if kind is not None and kind.value == "Plan":
            return _mission(read_plan(documents[0]), "a plan of QGroundControl")
    lists = find_lists(documents) if documents else []
    if not lists:
        return None
    keys = ".".join(lists[0].keys) if len(lists) == 1 else ""
    how = f" ({keys})" if keys else f" ({len(documents)} messages)" if len(documents) > 1 else ""
    other = sorted(frames(documents) - _MAP_FRAMES)
    notes = (f"frame {', '.join(other)} taken as map",) if other else ()
    return _with_datum(WaypointList(f"waypoints in YAML or JSON{how}", tuple(lists), notes=notes))


def _mission(mission: Mission, kind: str) -> WaypointList:
    left_out = ", ".join(map(str, mission.left_out))
    notes = (f"commands left out: {left_out}",) if left_out else ()
    robots = (NamedRecords("", mission.records),)
    return _with_datum(WaypointList(kind, robots, mission.home, notes=notes))


def _with_datum(found: WaypointList) -> WaypointList:
    """Take the first waypoint as datum of geographic waypoints without home."""
    records = (one for robot in found.robots for one in robot.records if "x" not in one)
    first = next(filter(None, map(_degrees, records)), None)
    if first is None or found.datum is not None:
        return found
    return replace(found, datum=first, datum_is="the first waypoint")


def _degrees(record: Record) -> Optional[Position]:
    lat, lon = (number_of(record[key].value) if key in record else None for key in ("lat", "lon"))
    if lat is None or lon is None or abs(lat) > 90.0 or abs(lon) > 180.0:
        return None
    return lat, lon


def _is_of_others(text: str) -> bool:
    """Return whether a text in braces is no goal file of ours, nor one with a mistake.

    A goal file has ``goals``, and they have no keys of messages such as theta or position. YAML may
    begin as JSON does.
    """
    try:
        tree = json.loads(text, parse_int=float)
    except ValueError:
        return '"goals"' not in text
    except RecursionError:
        return False
    if not isinstance(tree, dict) or "goals" not in tree:
        return True
    goals = tree["goals"]
    objects: Sequence[Any] = goals if isinstance(goals, list) else []
    return any(
        key not in GOAL_KEYS and _is_pose_key(key)
        for one in objects
        if isinstance(one, dict)
        for key in one
    )


def _is_pose_key(key: str) -> bool:
    is_own = field_of(key) in ("", "z", "wait_s", "frame")
    return not is_own or key.lower() in ("position", "pose", "orientation")
