"""A study's outcome as files: parameters, record, figures and report."""
from __future__ import annotations

import json
from pathlib import Path
from typing import Iterator

from quad_nav.tuning.parameter_files import write_parameters
from quad_nav.tuning.record import changes, markdown, to_json
from quad_nav.tuning.tune import TuneResult

PARAMETERS = "config"
RECORD = "STUDY.md"
FIGURES = "results.json"
REPORT = "report.html"


def write_result(result: TuneResult, command: str) -> Iterator[Path]:
    """Writes everything into the study's folder; yields what is there now."""
    folder = result.setup.options.output
    parameters = folder / PARAMETERS
    write_parameters(result.setup.base_folder, parameters, changes(result))
    (parameters / RECORD).write_text(markdown(result, command), encoding="utf-8")
    yield parameters
    text = json.dumps(to_json(result, command), indent=2, allow_nan=False, default=str)
    (folder / FIGURES).write_text(text + "\n", encoding="utf-8")
    yield folder / FIGURES
