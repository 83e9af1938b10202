"""Flights of ``quad barn`` and ``quad dynabarn``."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Optional, Tuple

from quad_bench.barn import dynamic, dynamic_results, results
from quad_bench.barn.protocol import Outcome, Run
from quad_bench.barn.runs import fly_all
from quad_bench.barn.setup import BarnOptions, read_barn_setup
from quad_bench.cli.benchmark import (
    Benchmark,
    benchmark_outputs,
    exit_benchmark,
    run_benchmark,
    write_results,
)
from quad_nav.cli.options import exit_on_faults, parameter
from quad_nav.errors import InputError

_OUTCOMES = [outcome.value for outcome in Outcome]


def fly_barn(
    processes: Optional[int],
    per_world: bool,
    json_path: Optional[Path],
    csv_path: Optional[Path],
    quiet: bool,
    **given: Any,
) -> None:
    """Fly with the options of ``quad barn`` and exit with its status."""
    with exit_on_faults():
        outputs = benchmark_outputs(json_path, csv_path, quiet)
        setup = read_barn_setup(_options(**given))
        contestant = setup.contestant
        benchmark: Benchmark[Run] = Benchmark(
            "barn",
            setup.wanted,
            contestant.configuration,
            lambda workers: fly_all(setup, workers),
            _OUTCOMES,
            lambda run: run.outcome.value,
        )
        flown = run_benchmark(benchmark, processes, quiet)
    runs = tuple(sorted(flown.runs, key=lambda run: (run.world, run.run)))
    figures = results.Results(contestant, runs, setup.wanted, flown.wall_time_s)
    overview = results.text(figures, per_world)
    write_results(outputs, overview, results.to_json(figures), results.to_csv(figures), quiet)
    exit_benchmark(outputs, flown.interrupted)


def fly_dynabarn(
    processes: Optional[int],
    per_world: bool,
    json_path: Optional[Path],
    csv_path: Optional[Path],
    quiet: bool,
    interpolation: str,
    max_vel_x_mps: float,
    **given: Any,
) -> None:
    """Fly with the options of ``quad dynabarn`` and exit with its status."""
    with exit_on_faults():
        outputs = benchmark_outputs(json_path, csv_path, quiet)
        setup = dynamic.read_dynamic_setup(_options(**given), interpolation, max_vel_x_mps)
        contestant = setup.contestant
        benchmark: Benchmark[dynamic.DynamicRun] = Benchmark(
            "dynabarn",
            setup.wanted,
            contestant.configuration,
            lambda workers: dynamic.fly_all(setup, workers),
            _OUTCOMES,
            lambda run: run.outcome.value,
        )
        flown = run_benchmark(benchmark, processes, quiet)
    runs = tuple(sorted(flown.runs, key=lambda run: (run.world, run.run)))
    figures = dynamic_results.DynamicResults(
        contestant, setup.interpolation, runs, setup.wanted, flown.wall_time_s
    )
    write_results(
        outputs,
        dynamic_results.text(figures, per_world),
        dynamic_results.to_json(figures),
        dynamic_results.to_csv(figures),
        quiet,
    )
    exit_benchmark(outputs, flown.interrupted)


def _options(parameters: Tuple[str, ...], only: str, **given: Any) -> BarnOptions:
    return BarnOptions(
        **given, parameters=tuple(map(parameter, parameters)), only=_world_numbers(only)
    )


def _world_numbers(text: str) -> Tuple[int, ...]:
    """Parse the value of --only.

    Raises:
        InputError: It is not a list of numbers.
    """
    try:
        return tuple(int(word) for word in text.split(",") if word.strip())
    except ValueError as error:
        raise InputError(
            [f"--only {text}: expected numbers of worlds, for example 0,6,12"]
        ) from error
