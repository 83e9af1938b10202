"""Edit the goals in the text of a goal file; the rest of the text stays as a person wrote it."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Sequence, Tuple

_DECODER = json.JSONDecoder()
_SPACE = re.compile(r"[ \t\r\n]*")
_BYTE_ORDER_MARK = "\ufeff"
_DIGITS = 3  # of a coordinate that was dragged: millimetres and milliradians

Span = Tuple[int, int]


@dataclass(frozen=True)
class GoalEdit:
    """A goal after an edit.

    Attributes:
        source: Index of the goal in the file that it was; None for a new one.
        x_m: Position in ``map``.
        y_m: Position in ``map``.
        yaw_rad: Yaw in ``map``; None if the goal has none.
    """

    source: Optional[int]
    x_m: float
    y_m: float
    yaw_rad: Optional[float] = None


def edited_text(text: str, goals: Sequence[GoalEdit]) -> str:
    """Return the text of a goal file with other goals.

    A goal that has not moved keeps its text. One that has keeps its form, list or object, and its
    further keys.

    Args:
        text: Text of a valid goal file.
        goals: All goals of the new text, in order.
    """
    (start, end), spans = _goals_span(text)
    parts = [_goal_text(text, spans, goal) for goal in goals]
    if [goal.source for goal in goals] == list(range(len(spans))):
        return _spliced(text, spans, parts)
    lead, between, tail = _separators(text, (start, end), spans)
    inside = lead + between.join(parts) + tail if parts else ""
    return f"{text[:start]}[{inside}]{text[end:]}"


def _spliced(text: str, spans: Sequence[Span], parts: Sequence[str]) -> str:
    """Replace each goal's text by its new one."""
    pieces: List[str] = []
    last = 0
    for (start, end), part in zip(spans, parts):
        pieces += [text[last:start], part]
        last = end
    return "".join(pieces) + text[last:]


def _separators(text: str, goals: Span, spans: Sequence[Span]) -> Tuple[str, str, str]:
    """Return what the file has before the first goal, between two, and after the last one."""
    start, end = goals
    if not spans:
        return "", ", ", ""
    lead, tail = text[start + 1 : spans[0][0]], text[spans[-1][1] : end - 1]
    if len(spans) > 1:
        return lead, text[spans[0][1] : spans[1][0]], tail
    return lead, f",{lead or ' '}", tail


def _goal_text(text: str, spans: Sequence[Span], goal: GoalEdit) -> str:
    """Return the text of one goal: that of the file if it has not changed."""
    if goal.source is None:
        return _written(_as_list(goal))
    start, end = spans[goal.source]
    before, _ = _DECODER.raw_decode(text, start)
    if _values(before) == (goal.x_m, goal.y_m, goal.yaw_rad):
        return text[start:end]
    if isinstance(before, dict):
        return _written(_as_object(before, goal))
    return _written(_as_list(goal))


def _values(entry: Any) -> Tuple[Any, Any, Any]:
    """Return x, y and yaw of a goal in the file; yaw is None if there is none."""
    if isinstance(entry, dict):
        return entry.get("x"), entry.get("y"), entry.get("yaw")
    return entry[0], entry[1], entry[2] if len(entry) > 2 else None


def _as_list(goal: GoalEdit) -> List[float]:
    place = [_rounded(goal.x_m), _rounded(goal.y_m)]
    return place if goal.yaw_rad is None else [*place, _rounded(goal.yaw_rad)]


def _as_object(before: Dict[str, Any], goal: GoalEdit) -> Dict[str, Any]:
    entry = {**before, "x": _rounded(goal.x_m), "y": _rounded(goal.y_m)}
    if goal.yaw_rad is not None:
        entry["yaw"] = _rounded(goal.yaw_rad)
    elif "yaw" in entry:
        entry["yaw"] = None
    return entry


def _rounded(value: float) -> float:
    return round(float(value), _DIGITS) + 0.0  # no -0.0


def _written(entry: Any) -> str:
    return json.dumps(entry, ensure_ascii=False, allow_nan=False)


def _goals_span(text: str) -> Tuple[Span, List[Span]]:
    """Find the list of goals in the text, brackets included, and each goal in it."""
    position = _after_space(text, len(_BYTE_ORDER_MARK) if text.startswith(_BYTE_ORDER_MARK) else 0)
    position += text[position] == "{"  # the tutorial prints its files without the outer braces
    while True:
        key, position = _DECODER.raw_decode(text, _after_space(text, position))
        start = _after_space(text, _after_space(text, position) + 1)  # behind the colon
        if key == "goals":
            spans = _elements(text, start)
            end = _after_space(text, spans[-1][1] if spans else start + 1) + 1
            return (start, end), spans
        _, position = _DECODER.raw_decode(text, start)
        position = _after_space(text, position) + 1  # behind the comma


def _elements(text: str, start: int) -> List[Span]:
    """Return the elements of the list whose opening bracket is at ``start``."""
    spans: List[Span] = []
    position = _after_space(text, start + 1)
    while text[position] != "]":
        _, end = _DECODER.raw_decode(text, position)
        spans.append((position, end))
        position = _after_space(text, end)
        if text[position] == ",":
            position = _after_space(text, position + 1)
    return spans


def _after_space(text: str, position: int) -> int:
    found = _SPACE.match(text, position)
    return found.end() if found else position
