"""Replace or insert values in the text of a YAML file and keep everything else.

A YAML loader drops comments and layout. So values are replaced in place, and the remark beside a
replaced value is replaced, too.
"""

from __future__ import annotations

import re
from typing import Any, List, Optional, Sequence

import yaml

_INDENT = 2
_REMARK = re.compile(r"\s*#.*$")


def replaced(text: str, path: Sequence[str], value: Any, comment: str) -> Optional[str]:
    """Return the text with another value at ``path``, None if nothing is there."""
    node = _node(yaml.compose(text, yaml.SafeLoader), path)
    if node is None or isinstance(node, yaml.MappingNode):
        return None
    first, last = node.start_mark, node.end_mark
    lines = text.split("\n")
    before = lines[first.line][: first.column]
    rest = lines[last.line][last.column :]
    column = lines[last.line].find("#", last.column)
    lines[first.line : last.line + 1] = [before + value_text(value) + rest]
    return "\n".join(
        _remarked(lines, first.line, len(before) + len(value_text(value)), comment, column)
    )


def inserted(text: str, path: Sequence[str], value: Any, comment: str) -> str:
    """Return the text with a new entry at ``path``, as the last one of its namespace."""
    root = yaml.compose(text, yaml.SafeLoader)
    namespace, depth = root, 0
    while depth < len(path) - 1:
        below = _entry(namespace, path[depth])
        if not isinstance(below, yaml.MappingNode):
            break
        namespace, depth = below, depth + 1
    if not isinstance(namespace, yaml.MappingNode) or not namespace.value:
        return (
            text.rstrip("\n")
            + "\n" * bool(text)
            + "\n".join(_new_lines(path[depth:], 0, value, comment))
            + "\n"
        )
    if namespace.flow_style:
        return _inserted_in_braces(text, namespace, path[depth:], value)
    lines = text.split("\n")
    at = _last_line(namespace) + 1
    while at < len(lines) and _is_continued(lines, at):
        at += 1
    lines[at:at] = _new_lines(path[depth:], namespace.value[0][0].start_mark.column, value, comment)
    return "\n".join(lines)


def value_text(value: Any) -> str:
    """Format a number, boolean or text as YAML."""
    return str(yaml.safe_dump(value, default_flow_style=True, width=1000)).split("\n")[0]


def _entry(node: Any, key: str) -> Any:
    if isinstance(node, yaml.MappingNode):
        for key_node, value_node in node.value:
            if key_node.value == key:
                return value_node
    return None


def _node(node: Any, path: Sequence[str]) -> Any:
    for key in path:
        node = _entry(node, key)
    return node


def _new_lines(path: Sequence[str], column: int, value: Any, comment: str) -> List[str]:
    lines = [" " * (column + _INDENT * depth) + f"{key}:" for depth, key in enumerate(path)]
    lines[-1] += f" {value_text(value)}  # {comment}"
    return lines


def _inserted_in_braces(
    text: str, namespace: yaml.MappingNode, path: Sequence[str], value: Any
) -> str:
    at = namespace.value[0][0].start_mark.index
    words = value_text(value)
    for key in reversed(path[1:]):
        words = f"{{{key}: {words}}}"
    return f"{text[:at]}{path[0]}: {words}, {text[at:]}"


def _remarked(lines: List[str], number: int, end: int, comment: str, column: int) -> List[str]:
    """Replace the comment behind the value that ends at ``end``.

    The old comment was at ``column`` before the value changed, and so are its continuation lines.
    """
    line = lines[number]
    old = _REMARK.match(line, end)
    if old is None and line[end:].strip():
        return lines  # more follows within braces
    kept = [line[:end] + f"  # {comment}"]
    following = number + 1
    while column > 0 and following < len(lines) and _comment_column(lines[following]) == column:
        following += 1
    return [*lines[:number], *kept, *lines[following:]]


def _comment_column(line: str) -> int:
    """Return the column of the comment of a comment-only line, otherwise -1."""
    bare = line.lstrip()
    return len(line) - len(bare) if bare.startswith("#") else -1


def _is_continued(lines: Sequence[str], number: int) -> bool:
    """Return true if a line continues the remark of a value above it."""
    column = _comment_column(lines[number])
    return column > 0 and len(lines[number - 1]) > column and lines[number - 1][column] == "#"


def _last_line(node: Any) -> int:
    """Return the line on which a node ends; a block's end mark is the next token's start."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _last_line(last[1] if isinstance(last, tuple) else last)
    end = node.end_mark
    return end.line - 1 if end.column == 0 and end.line > node.start_mark.line else end.line
