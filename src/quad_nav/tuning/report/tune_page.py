"""The page of a study: how the search went, what came of it, a flight before and after."""

from __future__ import annotations

from pathlib import Path
from typing import List

from quad_nav.recording.trace import FlightTrace
from quad_nav.report import style
from quad_nav.report.encounters import encounters
from quad_nav.report.flight_metrics import flight_metrics
from quad_nav.report.measures import resampled_tracks
from quad_nav.report.page import MAX_STRIPS, Page, Section, picture, render
from quad_nav.report.paths_picture import paths_picture
from quad_nav.report.timeline_picture import timeline_picture
from quad_nav.tuning import study_text
from quad_nav.tuning.report.outcome_pictures import held_out_picture, pareto_picture
from quad_nav.tuning.report.search_pictures import (
    history_picture,
    importance_picture,
    importances,
    slice_picture,
)
from quad_nav.tuning.score import TERMS
from quad_nav.tuning.search import FIGURES, is_complete
from quad_nav.tuning.statistics import FlightStatistics, flight_statistics
from quad_nav.tuning.tune import TuneResult, all_versions

_FOLDER = Path(__file__).parent


def tune_page(result: TuneResult, before: FlightTrace, after: FlightTrace, command: str) -> Page:
    """``before`` and ``after``: one of the flights that were held out, base and tuned."""
    with style.styled():
        sections = [_held_out(result), _flights(before, after), *_search(result)]
    return render(
        "tune.html.jinja",
        sections,
        _FOLDER,
        result=result,
        command=command,
        rows=study_text.held_out_rows(result),
        barn=study_text.barn_rows(result),
        terms=TERMS,
        gains=[
            (
                gain,
                study_text.value_words(gain.base),
                study_text.value_words(gain.value),
                study_text.gain_words(gain),
            )
            for gain in result.refined.gains
        ],
        flights=[("base", flight_metrics(before)), ("tuned", flight_metrics(after))],
        versions=all_versions(),
    )


def _held_out(result: TuneResult) -> Section:
    held_out = result.held_out
    return Section(
        "held-out",
        "Flights that the search never saw",
        f"{len(held_out.cases)} flights with each "
        "set of parameters; a line joins those of the same mission and seed, thick bars are means.",
        (
            picture(
                "held_out",
                "Times and gaps of the base and the tuned parameters",
                held_out_picture(held_out.base, held_out.tuned),
            ),
        ),
    )


def _flights(before: FlightTrace, after: FlightTrace) -> Section:
    pictures, notes = [], []
    for name, trace in (("before", before), ("after", after)):
        tracks = resampled_tracks(trace)
        shown = encounters(trace, tracks)[:MAX_STRIPS]
        found = flight_metrics(trace, tracks)
        words = f"{name.capitalize()}: {found.mission_s:.1f} s"
        notes += [words, ""]
        pictures += [
            picture(f"paths_{name}", f"Paths {name}", paths_picture(trace, tracks, shown)),
            picture(f"timeline_{name}", f"Goals {name}", timeline_picture(trace)),
        ]
    return Section(
        "flights",
        "One of these flights, before and after",
        "The same mission and seed "
        "with the base and with the tuned parameters. Letters are close encounters.",
        tuple(pictures),
        tuple(notes),
    )


def _search(result: TuneResult) -> List[Section]:
    trials, space = result.trials, result.setup.space
    reference = flight_statistics(result.reference)
    found = importances(trials, space)
    sections = [
        Section(
            "history",
            "The search",
            "Mean cost of each candidate, lower is better. Those that "
            "were dropped did not fly everything.",
            (
                picture(
                    "history", "Cost of each candidate", history_picture(trials, reference.cost)
                ),
            ),
        ),
        _pareto(result, reference),
    ]
    if found:
        sections.append(
            Section(
                "importances",
                "What counted",
                "How much each parameter tells the better candidates from the others (PED-ANOVA).",
                (
                    picture(
                        "importances", "Importance of each parameter", importance_picture(found)
                    ),
                ),
            )
        )
    order = list(found) or list(space.paths)
    sections.append(
        Section(
            "slices",
            "Values",
            "Each candidate's value and cost, for every parameter that was "
            "searched; the tuned value has no line where the base's was kept.",
            (
                picture(
                    "slices",
                    "Cost over the values of each parameter",
                    slice_picture(
                        trials,
                        space,
                        order,
                        result.refined.values,
                        dict(result.setup.base),
                        reference.cost,
                    ),
                ),
            ),
        )
    )
    return sections


def _pareto(result: TuneResult, reference: FlightStatistics) -> Section:
    complete = [trial for trial in result.trials if is_complete(trial)]
    candidates = [FlightStatistics(**trial.user_attrs[FIGURES]) for trial in complete]
    gains = result.refined.gains
    tuned = gains[0].with_it if gains else reference
    return Section(
        "pareto",
        "Time against clearance",
        f"{len(candidates)} candidates flew everything; those "
        "that reached every goal and touched nothing are shown. No other one beats those of the "
        "front in both. The tuned one has flown more than the others.",
        (
            picture(
                "pareto",
                "Mean time and smallest gap of candidates",
                pareto_picture(candidates, reference, tuned),
            ),
        ),
    )
