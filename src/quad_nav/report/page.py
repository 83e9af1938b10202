"""The HTML of a report: one file, pictures within it, nothing to load."""

from __future__ import annotations

import base64
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, List, Optional, Sequence, Tuple

import jinja2
from matplotlib.figure import Figure

from quad_nav.recording.trace import FlightTrace
from quad_nav.report import style
from quad_nav.report.comparison_picture import comparison_picture, grouped
from quad_nav.report.cycle_picture import cycle_picture, has_walls
from quad_nav.report.distance_picture import distance_picture
from quad_nav.report.encounter_picture import encounter_picture
from quad_nav.report.encounters import CLOSE_M, LETTERS, Encounter, encounters, gap_text
from quad_nav.report.flight_metrics import FlightMetrics, flight_metrics
from quad_nav.report.measures import Tracks, tracks
from quad_nav.report.motion_picture import motion_picture
from quad_nav.report.parameter_table import parameter_rows
from quad_nav.report.paths_picture import paths_picture
from quad_nav.report.timeline_picture import timeline_picture

MAX_STRIPS = 6
"""Close encounters beyond this number are counted and not shown."""


@dataclass(frozen=True)
class Picture:
    """A PNG with its file name; ``alt`` says what it shows."""

    name: str
    alt: str
    png: bytes

    @property
    def source(self) -> str:
        return "data:image/png;base64," + base64.b64encode(self.png).decode("ascii")


@dataclass(frozen=True)
class Section:
    """A heading, what to look at, and pictures; ``notes`` stand above each picture."""

    anchor: str
    heading: str
    caption: str
    pictures: Tuple[Picture, ...] = ()
    notes: Tuple[str, ...] = ()


@dataclass(frozen=True)
class Page:
    """The HTML and the pictures in it."""

    html: str
    pictures: Tuple[Picture, ...]


def flight_page(trace: FlightTrace, wall_time_s: Optional[float] = None) -> Page:
    """The report of one flight; ``wall_time_s`` is how long it took, where that is known."""
    with style.styled():
        among = tracks(trace)
        flight = flight_metrics(trace, among)
        met = encounters(trace, among)
        shown = met[:MAX_STRIPS]
        sections = [
            _paths(trace, among, shown),
            _encounters(trace, among, met, shown),
            *_curves(trace, among, flight, shown),
        ]
    sim_s = float(among.times_s[-1]) if len(among.times_s) else 0.0
    factor = sim_s / wall_time_s if wall_time_s else None
    return render(
        "flight.html.jinja",
        sections,
        trace=trace,
        flight=flight,
        factor=factor,
        parameters=parameter_rows(trace),
        parameters_known=any(robot.parameters for robot in trace.robots),
    )


def comparison_page(flights: Sequence[FlightMetrics]) -> Page:
    """The report of several flights."""
    with style.styled():
        compared = picture("comparison", "Figures of each flight", comparison_picture(flights))
    section = Section(
        "comparison",
        "Side by side",
        "Every dot is a flight; boxes hold the middle half of five or more, with the median.",
        (compared,),
    )
    return render("comparison.html.jinja", [section], flights=flights, groups=grouped(flights))


def _paths(trace: FlightTrace, among: Tracks, shown: Sequence[Encounter]) -> Section:
    return Section(
        "paths",
        "Paths",
        "Goals have their numbers in the order of flight and start positions the "
        "robot's number; discs show where the flight ended. Do paths keep to the middle of gaps, "
        "and where do they go round in circles?",
        (picture("paths", "Paths over the scene", paths_picture(trace, among, shown)),),
    )


def _encounters(
    trace: FlightTrace, among: Tracks, met: Sequence[Encounter], shown: Sequence[Encounter]
) -> Section:
    if not met:
        text = "No two quadcopters came" if len(trace.robots) > 1 else "No other quadcopter came"
        return Section(
            "encounters",
            "Close encounters",
            f"{text} within {CLOSE_M:g} m, hull to hull, and no obstacle was touched.",
        )
    caption = (
        f"Contacts with obstacles, and whenever two hulls came within {CLOSE_M:g} m: the "
        "closest moment is framed in red. Discs are to scale, the line in them is the nose, "
        "arrows are the way of 1.5 s. Each frame is 3.2 m wide."
    )
    if len(met) > len(shown):
        caption += f" The {len(shown)} closest are shown, {len(met) - len(shown)} more are not."
    pictures = tuple(
        picture(f"encounter_{letter}", note, encounter_picture(trace, among, one))
        for letter, note, one in zip(LETTERS, map(_note, shown), shown)
    )
    return Section(
        "encounters",
        "Close encounters",
        caption,
        pictures,
        tuple(f"{letter}: {_note(one)}" for letter, one in zip(LETTERS, shown)),
    )


def _note(one: Encounter) -> str:
    if one.other is None:
        return f"{one.names[0]} touches {one.names[1]} at {one.time_s:.1f} s"
    return f"{one.names[0]} and {one.names[1]}, {gap_text(one.gap_m)} at {one.time_s:.1f} s"


def _curves(
    trace: FlightTrace, among: Tracks, flight: FlightMetrics, shown: Sequence[Encounter]
) -> List[Section]:
    rows = _most_endangered(flight)
    left_out = len(trace.robots) - len(rows)
    motion = (
        "What was flown, in the robot's colour, and what the navigator commanded, in black. "
        "Commands that jump to and fro, or that the body does not follow, cost time; a "
        "tilted LIDAR sees the floor."
    )
    if left_out:
        motion += (
            f" The {len(rows)} quadcopters that came closest to anything are shown, "
            f"{left_out} more are not."
        )
    cycles = (
        "A cycle that takes longer than the control period holds everything up."
        if has_walls(trace)
        else "The recording has no computing times: this is how regularly cycles came."
    )
    return [
        Section(
            "gaps",
            "Distances",
            "Between hulls, discs of "
            f"{trace.robot_radius_m:.2f} m radius; below zero they overlap. Letters are close "
            "encounters, dashed lines contacts.",
            (picture("distances", "Gaps over time", distance_picture(trace, among, shown)),),
        ),
        Section(
            "timeline",
            "Goals",
            "Bars are goals with their numbers, from being sent to being reached.",
            (picture("timeline", "Goals over time", timeline_picture(trace)),),
        ),
        Section(
            "motion",
            "Motion",
            motion,
            (
                picture(
                    "motion", "Speed, turn rate and tilt over time", motion_picture(trace, rows)
                ),
            ),
        ),
        Section(
            "cycles",
            "Control cycles",
            cycles,
            (picture("cycles", "Times of control cycles", cycle_picture(trace)),),
        ),
    ]


def _most_endangered(flight: FlightMetrics) -> List[int]:
    """Numbers of the quadcopters that get a row each, in order."""

    def least_gap_m(number: int) -> float:
        robot = flight.robots[number]
        gaps = (robot.least_clearance_m, robot.least_separation_m)
        return min((gap for gap in gaps if gap is not None), default=float("inf"))

    return sorted(sorted(range(len(flight.robots)), key=least_gap_m)[: style.MAX_ROWS])


def picture(name: str, alt: str, figure: Figure) -> Picture:
    """A figure as a picture."""
    return Picture(name, alt, style.png(figure))


def render(
    template: str, sections: Sequence[Section], folder: Optional[Path] = None, **context: Any
) -> Page:
    """A page from a template of this folder, or of another one; ``context`` is for it."""
    folders = [Path(__file__).parent, *([folder] if folder is not None else [])]
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folders),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["figure"] = _figure_filter()
    html = environment.get_template(template).render(sections=sections, **context)
    return Page(html, tuple(picture for section in sections for picture in section.pictures))


def _figure_filter() -> Callable[[Optional[float], int], str]:
    def figure(value: Optional[float], decimals: int = 2) -> str:
        return "–" if value is None else f"{round(value, decimals) + 0.0:.{decimals}f}"

    return figure


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
    flights: Sequence[FlightMetrics], path: Path, pictures: Optional[Path] = None
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
