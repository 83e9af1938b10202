"""Write the outputs of a study: parameters, description, results and report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Iterator, Optional

from quad_nav.files.output import write_text
from quad_nav.offline.flight import StopAtContact
from quad_nav.offline.run import fly
from quad_nav.recording.trace import FlightTrace, TraceObserver
from quad_tune.parameter_files import write_parameters
from quad_tune.space import Assignments
from quad_tune.study_text import changes, markdown, to_json
from quad_tune.tune import TuneResult

PARAMETERS = "config"
RECORD = "STUDY.md"
RESULTS = "results.json"
REPORT = "report.html"


def write_result(
    result: TuneResult, command: str, pictures: Optional[Path] = None
) -> Iterator[Path]:
    """Write the outputs of a study into its folder.

    Args:
        result: Outcome of the study.
        command: Command line of the study, for the documentation.
        pictures: Folder that gets the report's pictures as PNG and SVG files, or None.

    Yields:
        Each path when it is written: tuned parameters, results, report and pictures.

    Raises:
        OSError: A file cannot be written.
    """
    folder = result.setup.options.output
    parameters = folder / PARAMETERS
    write_parameters(result.setup.base_source, parameters, changes(result))
    write_text(parameters / RECORD, markdown(result, command))
    yield parameters
    text = json.dumps(to_json(result, command), indent=2, allow_nan=False, default=str)
    write_text(folder / RESULTS, text + "\n")
    yield folder / RESULTS
    yield _write_report(result, command, pictures)
    if pictures is not None:
        yield pictures


def _write_report(result: TuneResult, command: str, pictures: Optional[Path]) -> Path:
    """Write the report; the import is local because matplotlib loads slowly."""
    from quad_nav.report.page import write_page, write_pictures
    from quad_tune.report.tune_page import tune_page

    path = result.setup.options.output / REPORT
    before, after = (
        _traced(result, name, assignments)
        for name, assignments in (("base", ()), ("tuned", result.assignments))
    )
    page = tune_page(result, before, after, command)
    write_page(page, path)
    if pictures is not None:
        write_pictures(page, pictures)
    return path


def _traced(result: TuneResult, name: str, assignments: Assignments) -> FlightTrace:
    """Fly the first held-out flight again and trace it."""
    course, case = result.setup.course, result.held_out.cases[0]
    setup = course.setup(case, assignments)
    observer = TraceObserver(f"{case.name}, seed {case.seed}, {name}")
    stops = (StopAtContact(),) if course.ends_at_contact else ()
    summary = fly(setup, (observer, *stops))
    return observer.trace(summary.contacts, summary.reason)
