"""Reports and pictures as files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Optional, Sequence

from quad_nav.recording.trace import FlightTrace
from quad_nav.report.figures import FlightFigures
from quad_nav.report.page import Page, comparison_page, flight_page


def write_report(
    trace: FlightTrace,
    path: Path,
    pictures: Optional[Path] = None,
    wall_time_s: Optional[float] = None,
) -> None:
    """The report of one flight, with its folders.

    ``pictures``: the folder that gets every picture as a PNG file, None for none.
    """
    write_page(flight_page(trace, wall_time_s), path, pictures)


def write_comparison(
    flights: Sequence[FlightFigures], path: Path, pictures: Optional[Path] = None
) -> None:
    """The report of several flights, written as ``write_report`` does."""
    write_page(comparison_page(flights), path, pictures)


def write_page(page: Page, path: Path, pictures: Optional[Path] = None) -> None:
    """The HTML, and its pictures as PNG files for a folder; nobody sees half of the HTML."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    partial.write_text(page.html, encoding="utf-8")
    partial.replace(path)
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        for picture in page.pictures:
            (pictures / f"{picture.name}.png").write_bytes(picture.png)
