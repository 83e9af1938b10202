"""Report that compares several flights."""

from __future__ import annotations

from pathlib import Path
from typing import Optional, Sequence

from quad_nav.report.comparison_picture import comparison_picture, grouped
from quad_nav.report.flight_metrics import FlightMetrics
from quad_nav.report.page import Page, Section, picture, render, write_page


def comparison_page(flights: Sequence[FlightMetrics]) -> Page:
    """Build the report that compares several flights."""
    section = Section(
        "comparison",
        "Side by side",
        "A dot is a flight. Boxes span the middle half of five or more flights, with the median.",
        (picture("comparison", "Metrics of each flight", lambda: comparison_picture(flights)),),
    )
    return render("comparison.html.jinja", [section], flights=flights, groups=grouped(flights))


def write_comparison(
    flights: Sequence[FlightMetrics], path: Path, pictures: Optional[Path] = None
) -> None:
    """Write the report that compares several flights, as ``write_report`` does."""
    write_page(comparison_page(flights), path, pictures)
