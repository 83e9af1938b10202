"""Report of a study."""

from __future__ import annotations

from pathlib import Path
from typing import List

from quad_nav.recording.trace import FlightTrace
from quad_nav.report import style
from quad_nav.report.encounters import encounters
from quad_nav.report.flight_metrics import flight_metrics
from quad_nav.report.matplotlib_figures import paths_picture, timeline_picture
from quad_nav.report.measures import resampled_tracks
from quad_nav.report.page import MAX_STRIPS, Page, Section, picture, render
from quad_nav.report.panels import plot_section
from quad_nav.report.paths import flown_paths
from quad_nav.report.timeline import timeline
from quad_tune import study_text
from quad_tune.report.tune_plots import (
    held_out_plot,
    history_plot,
    importance_plot,
    importances,
    pareto_plot,
    slices_plot,
)
from quad_tune.score import TERMS
from quad_tune.search import is_complete
from quad_tune.statistics import STATISTICS, FlightStatistics, flight_statistics
from quad_tune.tune import TuneResult, all_versions

_FOLDER = Path(__file__).parent


def tune_page(result: TuneResult, before: FlightTrace, after: FlightTrace, command: str) -> Page:
    """Build the report; ``before`` and ``after`` are a held-out flight, base and tuned."""
    with style.styled():
        sections = [_held_out(result), _flights(before, after), *_search(result)]
    return render(
        "tune.html.jinja",
        sections,
        _FOLDER,
        result=result,
        command=command,
        rows=study_text.held_out_rows(result),
        protocol=study_text.protocol_rows(result),
        verdict=study_text.verdict(result),
        lines=[line.rstrip(".") for line in study_text.held_out_lines(result)],
        interval_text=study_text.INTERVAL_TEXT,
        terms=TERMS,
        gains=[
            (
                gain,
                study_text.format_value(gain.base),
                study_text.format_value(gain.value),
                study_text.gain_text(gain),
            )
            for gain in result.refined.gains
        ],
        flights=[("base", flight_metrics(before)), ("tuned", flight_metrics(after))],
        versions=all_versions(),
    )


def _held_out(result: TuneResult) -> Section:
    return plot_section(
        "held-out",
        "Held-out flights",
        f"{len(result.held_out.cases)} flights with each set of parameters. A line connects "
        "flights of the same mission and seed, black bars are means with their 95 % intervals. "
        "Vertical axes start at 0. A gap is the smaller of clearance and separation.",
        held_out_plot(result),
    )


def _flights(before: FlightTrace, after: FlightTrace) -> Section:
    pictures, notes = [], []
    for name, trace in (("base", before), ("tuned", after)):
        tracks = resampled_tracks(trace)
        shown = encounters(trace, tracks)[:MAX_STRIPS]
        metrics = flight_metrics(trace, tracks)
        notes += [f"{name.capitalize()}: {metrics.mission_s:.1f} s", ""]
        pictures += [
            picture(
                f"paths_{name}", f"Paths, {name}", paths_picture(flown_paths(trace, tracks, shown))
            ),
            picture(f"timeline_{name}", f"Goals, {name}", timeline_picture(timeline(trace))),
        ]
    return Section(
        "flights",
        "One held-out flight, base and tuned",
        "The same mission and seed with the base and with the tuned parameters. Letters are close "
        "encounters.",
        tuple(pictures),
        tuple(notes),
    )


def _search(result: TuneResult) -> List[Section]:
    reference = flight_statistics(result.reference)
    importance = importances(result.trials, result.setup.space)
    order = list(importance) or list(result.setup.space.paths)
    history = plot_section(
        "history",
        "Search",
        "Mean cost of each candidate; lower is better. Pruned candidates did not fly all flights. "
        "The vertical axis does not start at 0; costs above it, of failed missions, are red.",
        history_plot(result, reference.cost),
    )
    slices = plot_section(
        "slices",
        "Values",
        "Value and cost of each candidate, for each searched parameter. There is no line for the "
        "tuned value where the base's value was kept. Axes do not start at 0.",
        slices_plot(result, order, reference.cost),
    )
    if not importance:
        return [history, _pareto(result, reference), slices]
    bars = plot_section(
        "importances",
        "Importance of the parameters",
        "How strongly each parameter separates good candidates from the others (PED-ANOVA).",
        importance_plot(importance),
    )
    return [history, _pareto(result, reference), bars, slices]


def _pareto(result: TuneResult, reference: FlightStatistics) -> Section:
    candidates = {
        trial.number: FlightStatistics(**trial.user_attrs[STATISTICS])
        for trial in result.trials
        if is_complete(trial)
    }
    gains = result.refined.gains
    return plot_section(
        "pareto",
        "Time against gap",
        f"{len(candidates)} candidates completed all flights. The plot shows those that reached "
        "every goal without contact. No candidate beats one of the front in both time and gap. "
        "The tuned parameters have flown more flights than the others. The axis of the time does "
        "not start at 0.",
        pareto_plot(candidates, reference, gains[0].with_it if gains else reference),
    )
