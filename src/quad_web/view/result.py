"""The item ``result``: how a flight ended, and what was written about it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, Optional

from quad_nav.mission.summary import MissionSummary, to_json
from quad_web.view.state import Item

REPORT, SUMMARY = "/report.html", "/summary.json"
"""Addresses of the report and of the summary, below that of the page."""


def result_item(summary: MissionSummary, report: Optional[Path]) -> Item:
    """Return the item from the summary of a flight, and its report if there is one."""
    legs = [leg for robot in summary.robots for leg in robot.legs]
    clearances_m = [robot.min_clearance_m for robot in summary.robots]
    data: Dict[str, Any] = dict(
        is_success=summary.success,
        reason=summary.reason,
        reached=sum(leg.reached for leg in legs),
        goals=len(legs),
        contacts=len(summary.contacts) if summary.contacts_reported else None,
        sim_time_s=summary.sim_time_s,
        wall_time_s=summary.wall_time_s,
        min_separation_m=summary.min_separation_m,
        min_clearance_m=min((m for m in clearances_m if m is not None), default=None),
        summary=to_json(summary),
        report="" if report is None else str(report.absolute()),
        hint="quad fly --web --report FILE.html",
    )
    return Item("result", data)
