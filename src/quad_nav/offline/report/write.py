"""Reports, pictures and animations as files."""
from __future__ import annotations

import os
from pathlib import Path
from typing import Optional, Sequence

from quad_nav.offline.report.figures import figures
from quad_nav.offline.report.page import Page, comparison_page, flight_page
from quad_nav.offline.trace import FlightTrace


def write_report(traces: Sequence[FlightTrace], path: Path, pictures: Optional[Path] = None,
                 wall_time_s: Optional[float] = None) -> None:
    """The report of one flight, or the comparison of several, with its folders.

    ``pictures``: the folder that gets every picture as a PNG file, None for none.
    """
    page = (flight_page(traces[0], wall_time_s) if len(traces) == 1
            else comparison_page([figures(trace) for trace in traces]))
    write_page(page, path, pictures)


def write_page(page: Page, path: Path, pictures: Optional[Path] = None) -> None:
    """A reader never sees half of the HTML."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    partial.write_text(page.html, encoding="utf-8")
    partial.replace(path)
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        for picture in page.pictures:
            (pictures / f"{picture.name}.png").write_bytes(picture.png)
