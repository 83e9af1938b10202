"""Waypoints in YAML and JSON, found by their shape, whatever the keys above them are called.

A waypoint is a mapping with one position, or a list of two to seven numbers. A list of waypoints is
a sequence or a mapping of them, a document for each as ``rostopic echo`` writes them, or a mapping
of columns. Several lists are those of several robots.
"""

from __future__ import annotations

import re
from typing import Any, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Set, Tuple

import yaml

from quad_nav.errors import InputError
from quad_nav.files.document import yaml_fault
from quad_nav.files.plain_yaml import PlainLoader
from quad_nav.mission.waypoint_fields import (
    PLACE,
    Record,
    Value,
    field_of,
    is_of_a_pose,
    is_position,
    list_fields,
    number_of,
)

_LISTS = set(
    "goal goals waypoint waypoints wps pose poses point points route path targets destinations"
    " locations places trajectory patrol".split()
)
"""Keys of lists of waypoints; a list below one of them is preferred to others."""
_ROBOT_NAMES = ("robot_name", "robot", "namespace", "name")


class Tree(NamedTuple):
    """A mapping of trees, a list of trees or a scalar, and its line."""

    value: Any
    line: int


class NamedRecords(NamedTuple):
    """A list of waypoints, its name in the file and the keys above it."""

    name: str
    records: List[Record]
    keys: Tuple[str, ...] = ()


def read_documents(text: str) -> List[Tree]:
    """Read the documents of a YAML or JSON text; empty ones are left out.

    Raises:
        InputError: The text is not YAML, or a key is given twice; with the line.
    """
    if text.lstrip()[:1] in ("{", "["):
        text = text.replace("\t", " ")  # JSON allows tabs between its values
    trees: List[Tree] = []
    try:
        loader = PlainLoader(text)
        while loader.check_node():
            trees.append(_tree(loader, loader.get_node()))
    except yaml.YAMLError as error:
        raise InputError([yaml_fault(error)]) from error
    return [one for one in trees if one.value is not None]


def _tree(loader: PlainLoader, node: Optional[yaml.Node]) -> Tree:
    assert node is not None
    line = node.start_mark.line + 1
    if isinstance(node, yaml.SequenceNode):
        return Tree([_tree(loader, child) for child in node.value], line)
    if not isinstance(node, yaml.MappingNode):
        return Tree(loader.construct_object(node), line)
    children: Dict[str, Tree] = {}
    for key_node, child in node.value:
        key = str(key_node.value)
        if key in children:
            mark = key_node.start_mark
            raise yaml.constructor.ConstructorError(None, None, f"key {key!r} twice", mark)
        children[key] = _tree(loader, child)
    return Tree(children, line)


def find_lists(documents: Sequence[Tree]) -> List[NamedRecords]:
    """Return the lists of waypoints in documents, in the order of the file."""
    whole = documents[0] if len(documents) == 1 else Tree(list(documents), 1)
    found = list(_lists(whole, (), ""))
    named = [one for one in found if _LISTS & {key.lower() for key in one.keys}]
    return named or found


def frames(documents: Iterable[Tree]) -> Set[str]:
    """Return every ``frame_id`` in documents."""
    found: Set[str] = set()
    for tree in documents:
        children = tree.value if isinstance(tree.value, dict) else {}
        found |= {str(child.value) for key, child in children.items() if key == "frame_id"}
        below = children.values() if children else tree.value
        found |= frames(below) if isinstance(tree.value, (dict, list)) else set()
    return {one.lstrip("/") for one in found}


def _lists(
    tree: Tree, keys: Tuple[str, ...], name: str, is_known: bool = False
) -> Iterator[NamedRecords]:
    """Yield the lists in a tree; ``is_known`` if the tree itself is a waypoint of a list above."""
    records = _records(tree, keys)
    below: List[NamedRecords] = []
    if isinstance(tree.value, list) and not records:
        for number, child in enumerate(tree.value):
            below += _lists(child, keys, f"{name}[{number}]")
    elif isinstance(tree.value, dict):
        given = [tree.value[key].value for key in _ROBOT_NAMES if key in tree.value]
        name = next((str(one) for one in given if isinstance(one, (str, int))), name)
        for key, child in tree.value.items():
            is_name = key.lower() not in _LISTS and (_number(key) or not _number(name))
            if is_of_a_pose(key):
                is_waypoint = is_position(_record(child, key))
                below += _lists(child, (*keys, key), key if is_name else name, is_waypoint)
    is_waypoint = is_position(_record(tree, keys[-1] if keys else ""))
    if records and not (is_waypoint and (below or is_known)):
        yield NamedRecords(name, records, keys)
    yield from below


def _records(tree: Tree, keys: Tuple[str, ...]) -> List[Record]:
    """Return the waypoints of a tree that is a list of them, or one; faulty ones as they are."""
    record = _record(tree, keys[-1] if keys else "")
    rows = _rows(tree) if isinstance(tree.value, dict) else []
    if rows or is_position(record):
        return rows or [record]
    if isinstance(tree.value, dict):
        records = [_record(child, key) for key, child in tree.value.items()]
        is_list = any(map(is_position, records))
        return [one for one in records if is_list and len(one) > 1]
    if isinstance(tree.value, list):
        records = [_record(child) for child in tree.value]
        return records if any(map(is_position, records)) else []
    return []


def _rows(tree: Tree) -> List[Record]:
    """Return the waypoints of a mapping whose values are columns."""
    columns = {
        field_of(key): child.value
        for key, child in tree.value.items()
        if _is_numeric(child) and field_of(key)
    }
    if not is_position(columns):
        return []
    values = [
        {field: Value(*column[k]) for field, column in columns.items() if k < len(column)}
        for k in range(max(map(len, columns.values())))
    ]
    return [{PLACE: Value(None, next(iter(one.values())).line), **one} for one in values]


def _record(tree: Tree, key: str = "") -> Record:
    """Return what a tree has of a waypoint, without position if it has several."""
    place = {PLACE: Value(None, tree.line)}
    found = list(_values(tree, (key,), ()))
    fields = [field for field, _ in found]
    if any(fields.count(field) > 1 for field in ("x", "y", "lat", "lon")):
        return place
    return {**place, **dict(found)}


def _values(
    tree: Tree, keys: Tuple[str, ...], beside: Iterable[str]
) -> Iterator[Tuple[str, Value]]:
    """Yield the fields of a mapping or a list of numbers, without looking into other lists."""
    if isinstance(tree.value, dict):
        for key, child in tree.value.items():
            yield from _values(child, (*keys, key), tree.value)
    elif _is_numeric(tree):
        fields = list_fields(len(tree.value), keys[-1], beside)
        yield from zip(fields, (Value(*one) for one in tree.value))
    elif not isinstance(tree.value, list):
        field = field_of(*keys)
        if field:
            yield field, Value(*tree)


def _is_numeric(tree: Tree) -> bool:
    return isinstance(tree.value, list) and all(
        number_of(child.value) is not None for child in tree.value
    )


def _number(name: str) -> Optional[str]:
    """Return the last number in a name."""
    return next(iter(re.findall(r"\d+", name)[::-1]), None)
