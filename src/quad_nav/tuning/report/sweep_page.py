"""Report of a sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Iterator, Optional, Sequence

from quad_nav.report import style
from quad_nav.report.page import Page, Section, picture, render, write_page
from quad_nav.tuning.report.sweep_pictures import sweep_picture
from quad_nav.tuning.study_text import format_value
from quad_nav.tuning.sweep import SweepRow, SweepSetup
from quad_nav.versions import versions

_FOLDER = Path(__file__).parent


def sweep_page(setup: SweepSetup, rows: Sequence[SweepRow]) -> Page:
    """Build the page with pictures and table."""
    with style.styled():
        section = Section(
            "sweep",
            "Comparison",
            f"Flights per point: {setup.flights}, equal for all points. A gap is the smaller of "
            "clearance and separation. Times are those of completed missions.",
            (picture("sweep", "Statistics over the values", sweep_picture(rows)),),
        )
    return render(
        "sweep.html.jinja",
        [section],
        _FOLDER,
        setup=setup,
        rows=rows,
        words=format_value,
        versions=versions(),
    )


def write_sweep_report(
    setup: SweepSetup, rows: Sequence[SweepRow], path: Optional[Path], pictures: Optional[Path]
) -> Iterator[Path]:
    """Write the page, its pictures, or both; yield each path when it is written."""
    page = sweep_page(setup, rows)
    if path is not None:
        write_page(page, path)
        yield path
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        for image in page.pictures:
            (pictures / f"{image.name}.png").write_bytes(image.png)
        yield pictures
