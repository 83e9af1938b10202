"""Flights of ``quad circle``."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Optional, Sequence, Tuple

from quad_bench.circle.results import CircleResults, in_order, text, to_csv, to_json
from quad_bench.circle.runs import CircleRun, fly_all
from quad_bench.circle.setup import Circle, CircleOptions, read_circles
from quad_bench.cli.benchmark import Benchmark, exit_benchmark, run_benchmark, write_results
from quad_nav.cli.options import exit_on_faults, parameter
from quad_nav.cli.outputs import Outputs
from quad_nav.errors import InputError
from quad_nav.report.results import number_text

_OUTCOMES = ("success", "contact", "time-out")


def fly_circle(
    processes: Optional[int],
    json_path: Optional[Path],
    csv_path: Optional[Path],
    picture: Optional[Path],
    quiet: bool,
    **given: Any,
) -> None:
    """Fly with the options of ``quad circle`` and exit with its status."""
    with exit_on_faults("benchmark not started"):
        texts = {"--json": json_path, "--csv": csv_path}
        outputs = Outputs(texts, {"--picture": _checked(picture)}, quiet=quiet)
        options = _options(**given)
        circles = read_circles(options)
        benchmark: Benchmark[CircleRun] = Benchmark(
            "circle",
            len(circles) * len(options.methods) * options.runs,
            circles[0].flight.configurations[0],
            lambda workers: fly_all(circles, options.methods, options.runs, workers),
            _OUTCOMES,
            _outcome,
        )
        flown = run_benchmark(benchmark, processes, quiet)
    results = CircleResults(options, in_order(flown.runs), benchmark.wanted, flown.wall_time_s)
    write_results(outputs, text(results), to_json(results), to_csv(results), quiet)
    if picture is not None and results.runs:
        with outputs.attempt("--picture", picture):
            _draw(results.runs, circles, len(options.methods), picture)
            outputs.announce("picture", picture)
    exit_benchmark(outputs, flown.interrupted)


def _options(parameters: Tuple[str, ...], methods: Tuple[str, ...], **given: Any) -> CircleOptions:
    return CircleOptions(
        **given,
        methods=tuple(dict.fromkeys(methods)),
        parameters=tuple(map(parameter, parameters)),
    )


def _checked(picture: Optional[Path]) -> Optional[Path]:
    """Return the picture's path.

    Raises:
        InputError: It is neither PNG nor SVG.
    """
    if picture is not None and picture.suffix not in (".png", ".svg"):
        raise InputError([f"--picture {picture}: expected a file .png or .svg"])
    return picture


def _outcome(run: CircleRun) -> str:
    return "contact" if run.contacts else "success" if run.succeeded else "time-out"


def _draw(runs: Sequence[CircleRun], circles: Sequence[Circle], columns: int, path: Path) -> None:
    """Draw the first flights, a row for each circle; matplotlib loads slowly."""
    from quad_bench.circle.picture import PathsPanel, write_paths

    of_count = {len(one.starts): one for one in circles}
    panels: List[PathsPanel] = []
    for run in runs:
        if run.run == 0:
            flown = of_count[run.robots]
            panels.append(
                PathsPanel(
                    f"{run.robots} robots, {run.method}\nlast arrival "
                    f"{number_text(run.last_arrival_s)} s, gap {run.gap_m:.2f} m",
                    run.tracks_m,
                    flown.goals_m,
                    flown.flight.robot_radius_m,
                )
            )
    write_paths(panels, columns, path)
