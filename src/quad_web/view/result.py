"""The item ``result``: how a flight ended, and what was written about it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Dict, Mapping, Optional

from quad_web.view.state import Item

REPORT, SUMMARY = "/report.html", "/summary.json"
"""Addresses of the report and of the summary, below that of the page."""
_MAX_REASON = 500


def result_item(summary: Mapping[str, Any], hint: str, report: Optional[Path] = None) -> Item:
    """Return the item of a flight.

    Args:
        summary: The JSON object of ``mission.summary``.
        hint: Command that writes a report.
        report: The report, if there is one.

    Raises:
        Exception: Whatever comes of an object of another form; numbers that are not finite are a
            ``ValueError``.
    """
    goals = [goal for robot in summary["robots"] for goal in robot["goals"]]
    clearances_m = [_number(robot["min_clearance_m"]) for robot in summary["robots"]]
    data: Dict[str, Any] = dict(
        is_success=bool(summary["success"]),
        reason=str(summary["reason"])[:_MAX_REASON],
        reached=sum(bool(goal["reached"]) for goal in goals),
        goals=len(goals),
        contacts=len(summary["contacts"]) if summary["contacts_reported"] else None,
        sim_time_s=float(summary["sim_time_s"]),
        wall_time_s=_number(summary["wall_time_s"]),
        min_separation_m=_number(summary["min_separation_m"]),
        min_clearance_m=min((m for m in clearances_m if m is not None), default=None),
        summary=summary,
        report="" if report is None else str(report.absolute()),
        hint=hint,
    )
    json.dumps(data, allow_nan=False)  # raises an error for what a browser cannot read
    return Item("result", data)


def _number(value: Any) -> Optional[float]:
    return None if value is None else float(value)
