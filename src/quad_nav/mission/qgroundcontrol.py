"""Missions of QGroundControl: ``QGC WPL 110`` and ``.plan`` files.

Positions are geographic. The datum, which is (0, 0) of the map, is the home position.

Source: MAVLink, "File Formats", mavlink.io/en/file_formats; QGroundControl, "Plan File Format".
"""

from __future__ import annotations

import math
from typing import Any, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from quad_nav.errors import InputError
from quad_nav.mission.waypoint_fields import PLACE, Record, Value, number_of
from quad_nav.mission.waypoint_tree import Tree

WPL = "QGC WPL"
Position = Tuple[float, float]
"""Latitude and longitude, degrees."""
_WAYPOINT, _LOITER_TIME, _LAND = 16, 19, 21
_GOALS = {_WAYPOINT, 17, 18, _LOITER_TIME, _LAND, 31, 82}
"""Commands that fly to a position: waypoint, loiter (three ways), land, loiter to alt, spline."""
_GLOBAL_FRAMES = {0, 3, 5, 6, 10, 11}
_HOME_FRAME = 0
_EQUATOR_M = 6378137.0
_ECCENTRICITY_2 = 6.69437999014e-3


class Mission(NamedTuple):
    """Records of a mission, its home and the commands that are no goals."""

    records: List[Record]
    home: Optional[Position]
    left_out: List[int]


class _Item(NamedTuple):
    command: Any
    frame: Any
    params: Sequence[Any]
    line: int


def local_position(position: Position, datum: Position) -> Tuple[float, float]:
    """Return metres east and north of a datum, in the plane that touches WGS 84 there.

    A distance d comes out shorter than on the ground by d^3 / 6 R^2: 4 mm for 10 km.

    Source: ESA Navipedia, "Transformations between ECEF and ENU coordinates".
    """
    (x, y, z), (x0, y0, z0) = _geocentric(position), _geocentric(datum)
    lat, lon = map(math.radians, datum)
    dx, dy, dz = x - x0, y - y0, z - z0
    east = -math.sin(lon) * dx + math.cos(lon) * dy
    outward = math.cos(lon) * dx + math.sin(lon) * dy
    return east, math.cos(lat) * dz - math.sin(lat) * outward


def read_wpl(text: str) -> Mission:
    """Read a ``QGC WPL 110`` file. Item 0 in the global frame is home, as Mission Planner has it.

    Raises:
        InputError: A line has not twelve numbers.
    """
    items: List[_Item] = []
    problems: List[str] = []
    for number, line in list(enumerate(text.splitlines(), 1))[1:]:
        cells = [number_of(cell) for cell in line.split()]
        if len(cells) == 12 and None not in cells:
            items.append(_Item(cells[3], cells[2], cells[4:11], number))
        elif cells and not line.lstrip().startswith("#"):
            problems.append(f"line {number}: {line.strip()!r}; expected 12 numbers")
    if problems:
        raise InputError(problems)
    home = None
    if items and (items[0].command, items[0].frame) == (_WAYPOINT, _HOME_FRAME):
        home = _position(items.pop(0).params)
    return _mission(items, home)


def read_plan(plan: Tree) -> Mission:
    """Read a ``.plan`` file; the items of surveys and other patterns are those that they fly.

    Raises:
        InputError: There is no mission, or an item has no parameters.
    """
    mission = _child(plan, "mission")
    problems: List[str] = []
    items = list(_plan_items(_child(mission, "items"), problems))
    if problems:
        raise InputError(problems)
    home = [child.value for child in _children(_child(mission, "plannedHomePosition"))]
    return _mission(items, _position([None] * 4 + home))


def _plan_items(items: Tree, problems: List[str]) -> Iterator[_Item]:
    for item in _children(items):
        nested = _child(_child(item, "TransectStyleComplexItem"), "Items")
        params = [child.value for child in _children(_child(item, "params"))]
        if nested.value is not None:
            yield from _plan_items(nested, problems)
        elif len(params) < 7:
            kind = _child(item, "complexItemType").value or "an item"
            expected = "expected seven params, or the Items that a pattern flies"
            problems.append(f"line {item.line}: {kind} has neither; {expected}")
        else:
            frame, command = _child(item, "frame").value, _child(item, "command").value
            yield _Item(command, frame, params, item.line)


def _mission(items: Sequence[_Item], home: Optional[Position]) -> Mission:
    goals = [one for one in items if one.command in _GOALS]
    goals = [one for one in goals if one.command != _LAND or _position(one.params)]
    left_out = sorted({int(one.command) for one in items if one not in goals})
    return Mission([_record(one) for one in goals], home, left_out)


def _record(item: _Item) -> Record:
    position = _position(item.params)
    place = {PLACE: Value(None, item.line)}
    if position is None or item.frame not in _GLOBAL_FRAMES:
        lat, lon = item.params[4], item.params[5]
        text = f"lat {lat}, lon {lon} in frame {item.frame}; expected degrees in a global frame"
        return {PLACE: Value(text, item.line)}
    hold, heading = item.params[0], number_of(item.params[3])
    values = {"lat": position[0], "lon": position[1], "z": item.params[6]}
    if item.command in (_WAYPOINT, _LOITER_TIME):
        values["wait_s"] = hold
    if item.command == _WAYPOINT and heading:  # 0 stands for any: ArduPilot does not use it
        values["yaw"] = math.radians(90.0 - heading)
    return {**place, **{key: Value(value, item.line) for key, value in values.items()}}


def _position(params: Sequence[Any]) -> Optional[Position]:
    """Return the position of parameters; None for none, and for zeros, which stand for none."""
    lat, lon = (number_of(one) for one in [*params, None, None][4:6])
    if lat is None or lon is None or lat == lon == 0.0:
        return None
    return (lat, lon) if abs(lat) <= 90.0 and abs(lon) <= 180.0 else None


def _geocentric(position: Position) -> Tuple[float, float, float]:
    lat, lon = map(math.radians, position)
    normal_m = _EQUATOR_M / math.sqrt(1.0 - _ECCENTRICITY_2 * math.sin(lat) ** 2)
    flat_m = normal_m * math.cos(lat)
    height_m = normal_m * (1.0 - _ECCENTRICITY_2) * math.sin(lat)
    return flat_m * math.cos(lon), flat_m * math.sin(lon), height_m


def _child(tree: Tree, key: str) -> Tree:
    value = tree.value
    return value[key] if isinstance(value, dict) and key in value else Tree(None, tree.line)


def _children(tree: Tree) -> List[Tree]:
    return tree.value if isinstance(tree.value, list) else []
