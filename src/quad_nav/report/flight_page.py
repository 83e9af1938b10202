"""Report of one flight: its sections, plots and pictures."""

from __future__ import annotations

from functools import partial
from typing import List, Optional, Sequence

import numpy as np

from quad_nav.config.differences import parameter_rows
from quad_nav.mission.localization_errors import error_note
from quad_nav.recording.trace import FlightTrace
from quad_nav.report import style
from quad_nav.report.distances import distance_panels, speed_panel
from quad_nav.report.encounter_picture import encounter_picture
from quad_nav.report.encounters import (
    CLOSE_M,
    LETTERS,
    Encounter,
    closest_moment,
    encounters,
    separation_text,
)
from quad_nav.report.flight_metrics import FlightMetrics, flight_metrics
from quad_nav.report.matplotlib_figures import distance_picture, paths_picture, timeline_picture
from quad_nav.report.measures import Tracks, resampled_tracks
from quad_nav.report.page import MAX_STRIPS, Page, Section, picture, render
from quad_nav.report.panels import plot_section
from quad_nav.report.paths import flown_paths
from quad_nav.report.plotly_figures import distance_plot, paths_plot, timeline_plot
from quad_nav.report.robot_plots import (
    cycle_plot,
    has_wall_times,
    localization_plot,
    motion_plot,
)
from quad_nav.report.timeline import timeline

_NOT_RECORDED = "Not recorded."


def flight_page(trace: FlightTrace, wall_time_s: Optional[float] = None) -> Page:
    """Build the report of one flight; ``wall_time_s`` is how long it took, if known."""
    tracks = resampled_tracks(trace)
    flight = flight_metrics(trace, tracks)
    found = encounters(trace, tracks)
    shown = found[:MAX_STRIPS] or closest_moment(trace, tracks)
    sections = [
        _paths(trace, tracks, shown),
        _encounters(trace, tracks, found, shown),
        *_curves(trace, tracks, flight, shown),
    ]
    sim_s = float(tracks.times_s[-1]) if len(tracks.times_s) else 0.0
    factor = sim_s / wall_time_s if wall_time_s else None
    return render(
        "flight.html.jinja",
        sections,
        trace=trace,
        flight=flight,
        factor=factor,
        parameters=parameter_rows({robot.name: robot.parameters for robot in trace.robots}),
        parameters_known=any(robot.parameters for robot in trace.robots),
        has_yaws=any(
            goal.yaw_error_rad is not None for robot in trace.robots for goal in robot.goals
        ),
    )


def _paths(trace: FlightTrace, tracks: Tracks, shown: Sequence[Encounter]) -> Section:
    content = flown_paths(trace, tracks, shown)
    obstacles = " and what moves by itself" if trace.movers is not None else ""
    return Section(
        "paths",
        "Paths",
        "Goal 0.2 is the second goal of quadcopter 0. Squares are start positions, discs the "
        f"quadcopters{obstacles}, at the end or at the time of the slider. Drag to zoom, "
        "double-click to zoom out. A click in the legend hides a quadcopter, a double click all "
        "others. Check whether paths keep to the middle of gaps, and whether they circle.",
        plots=(paths_plot(content),),
        paper=(picture("paths", "Paths over the scene", lambda: paths_picture(content)),),
    )


def _encounters(
    trace: FlightTrace, tracks: Tracks, found: Sequence[Encounter], shown: Sequence[Encounter]
) -> Section:
    if found:
        caption = f"Contacts with obstacles, and separations below {CLOSE_M:g} m."
    elif len(trace.robots) > 1:
        caption = f"No separation below {CLOSE_M:g} m and no contact with an obstacle."
    else:
        caption = "No contact with an obstacle."
    if shown:
        caption += (
            " The closest moment is framed in red. Discs are to scale, the line in a disc points "
            "to the nose, arrows show the displacement in 1.5 s."
        )
    if len(found) > len(shown):
        caption += f" The {len(shown)} closest encounters of {len(found)} are shown."
    pictures = tuple(
        picture(f"encounter_{letter}", note, partial(encounter_picture, trace, tracks, encounter))
        for letter, note, encounter in zip(LETTERS, map(_note, shown), shown)
    )
    return Section(
        "encounters",
        "Close encounters",
        caption,
        pictures,
        tuple(f"{letter}: {_note(encounter)}" for letter, encounter in zip(LETTERS, shown)),
    )


def _note(encounter: Encounter) -> str:
    name, other = encounter.names
    if encounter.is_contact:
        return f"{name} touches {other} at {encounter.time_s:.1f} s"
    text = f"{separation_text(encounter.separation_m)} at {encounter.time_s:.1f} s"
    is_above = encounter.separation_m >= CLOSE_M
    return f"{name} and {other}: {text}" + f", above {CLOSE_M:g} m" * is_above


def _curves(
    trace: FlightTrace, tracks: Tracks, flight: FlightMetrics, shown: Sequence[Encounter]
) -> List[Section]:
    return [
        _distances(trace, tracks, shown),
        _timeline(trace),
        *_localization(trace, flight),
        _motion(trace, flight),
        _cycles(trace),
    ]


def _timeline(trace: FlightTrace) -> Section:
    content = timeline(trace)
    if not content.series and not content.marks:
        return Section("timeline", "Timeline", _NOT_RECORDED)
    return Section(
        "timeline",
        "Timeline",
        "A bar is a goal with its number, from sending it to its end.",
        plots=(timeline_plot(content),),
        paper=(picture("timeline", "Goals over time", lambda: timeline_picture(content)),),
    )


def _distances(trace: FlightTrace, tracks: Tracks, shown: Sequence[Encounter]) -> Section:
    panels = distance_panels(trace, tracks, shown)
    names = [robot.name for robot in trace.robots]
    contacts_s = [contact.time_s for contact in trace.contacts]
    marks = "Dashed lines are contacts."
    if len(trace.robots) > 1:
        marks = (
            "Letters are the moments shown above, the dotted line is the limit of close "
            f"encounters, {CLOSE_M:g} m, and dashed lines are contacts."
        )
    return Section(
        "gaps",
        "Distances and speeds",
        "Separation is the distance between the hulls of two robots, clearance the distance from "
        f"a hull to the nearest obstacle or wall. Hulls are discs of {trace.robot_radius_m:.2f} m "
        f"radius; below zero they overlap. {marks}",
        plots=(distance_plot([*panels, speed_panel(trace)], names, contacts_s),),
        paper=(
            picture(
                "distances",
                "Separation and clearance over time",
                lambda: distance_picture(panels, names, contacts_s),
            ),
        ),
    )


def _motion(trace: FlightTrace, flight: FlightMetrics) -> Section:
    rows = _rows_to_show(flight)
    caption = (
        "The flown motion in the robot's colour, the navigator's commands as thin steps. Commands "
        "that oscillate, or that the body does not follow, cost time. A tilted LIDAR sees the "
        "floor."
    )
    if len(rows) < len(trace.robots):
        caption += (
            f" The {len(rows)} quadcopters of {len(trace.robots)} that came closest to an "
            "obstacle or to each other are shown."
        )
    if not rows:
        return Section("motion", "Motion", caption)
    return plot_section("motion", "Motion", caption, motion_plot(trace, rows))


def _localization(trace: FlightTrace, flight: FlightMetrics) -> List[Section]:
    """Return the section of a flight whose robots find their places."""
    localized = [k for k, robot in enumerate(trace.robots) if robot.is_localized]
    if not localized:
        return []
    errors = [float(np.max(robot.errors[:, 0], initial=0.0)) for robot in trace.robots]
    shown = sorted(sorted(localized, key=lambda k: -errors[k])[: style.MAX_ROWS])
    caption = "" if flight.localization is None else f"{error_note(flight.localization)} "
    caption += (
        "Bands are two standard deviations, as the robots believe. Errors far above them are those"
        " of a robot that does not know that it is lost."
    )
    if len(shown) < len(localized):
        caption += f" The {len(shown)} quadcopters with the largest errors are shown."
    return [plot_section("localization", "Localization", caption, localization_plot(trace, shown))]


def _cycles(trace: FlightTrace) -> Section:
    if not any(len(one.cycle_walls_s) or len(one.cycle_times_s) > 1 for one in trace.robots):
        return Section("cycles", "Control cycles", _NOT_RECORDED)
    caption = (
        "A cycle that takes longer than the control period delays all navigators of its process."
        if has_wall_times(trace)
        else "The recording has no wall times. The plot shows the time between control cycles."
    )
    return plot_section("cycles", "Control cycles", caption, cycle_plot(trace))


def _rows_to_show(flight: FlightMetrics) -> List[int]:
    """Return the numbers of the robots with the smallest distances, in order."""

    def min_distance_m(number: int) -> float:
        robot = flight.robots[number]
        distances = (robot.min_clearance_m, robot.min_separation_m)
        return min(
            (distance for distance in distances if distance is not None), default=float("inf")
        )

    return sorted(sorted(range(len(flight.robots)), key=min_distance_m)[: style.MAX_ROWS])
