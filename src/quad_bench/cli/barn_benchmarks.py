"""Flights of ``quad barn`` and ``quad dynabarn``."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Iterator, Optional, Tuple

from quad_bench.barn import dynamic
from quad_bench.barn.dynamic_results import DynamicResults
from quad_bench.barn.protocol import Outcome, Run
from quad_bench.barn.results import Results
from quad_bench.barn.runs import fly_all
from quad_bench.barn.setup import BarnOptions, BarnSetup, read_barn_setup
from quad_bench.cli.benchmark import Benchmark, exit_benchmark, run_benchmark, write_results
from quad_nav.cli.options import exit_on_faults, parameter
from quad_nav.cli.outputs import Outputs
from quad_nav.errors import InputError

_OUTCOMES = [outcome.value for outcome in Outcome]


def fly_barn(**given: Any) -> None:
    """Fly with the options of ``quad barn`` and exit with its status."""
    _fly("barn", read_barn_setup, fly_all, _results, **given)


def fly_dynabarn(interpolation: str, max_vel_x_mps: float, **given: Any) -> None:
    """Fly with the options of ``quad dynabarn`` and exit with its status."""
    _fly(
        "dynabarn",
        lambda options: dynamic.read_dynamic_setup(options, interpolation, max_vel_x_mps),
        dynamic.fly_all,
        lambda setup, runs, wall_time_s: DynamicResults(
            setup.contestant, runs, setup.wanted, wall_time_s, setup.interpolation
        ),
        **given,
    )


def _results(setup: BarnSetup, runs: Tuple[Run, ...], wall_time_s: float) -> Results:
    return Results(setup.contestant, runs, setup.wanted, wall_time_s)


def _fly(
    name: str,
    read: Callable[[BarnOptions], Any],
    fly: Callable[[Any, int], Iterator[Any]],
    make_results: Callable[[Any, Tuple[Any, ...], float], Results],
    processes: Optional[int],
    per_world: bool,
    json_path: Optional[Path],
    csv_path: Optional[Path],
    quiet: bool,
    **given: Any,
) -> None:
    with exit_on_faults("benchmark not started"):
        outputs = Outputs({"--json": json_path, "--csv": csv_path}, quiet=quiet)
        setup = read(_options(**given))
        benchmark: Benchmark[Any] = Benchmark(
            name,
            setup.wanted,
            setup.contestant.configuration,
            lambda workers: fly(setup, workers),
            _OUTCOMES,
            lambda run: run.outcome.value,
        )
        flown = run_benchmark(benchmark, processes, quiet)
    runs = tuple(sorted(flown.runs, key=lambda run: (run.world, run.run)))
    results = make_results(setup, runs, flown.wall_time_s)
    write_results(outputs, results.text(per_world), results.to_json(), results.to_csv(), quiet)
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
