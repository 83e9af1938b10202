"""Studies of the BARN benchmark, which need the add-on ``quad_bench``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

pytest.importorskip("quad_bench")
from quad_bench.barn.protocol import Outcome  # noqa: E402
from quad_bench.barn.runs import fly_world  # noqa: E402
from quad_bench.barn.setup import BarnOptions, read_barn_setup  # noqa: E402
from quad_tune.barn_course import BarnCourse  # noqa: E402
from quad_tune.cli.tune import tune  # noqa: E402
from quad_tune.courses import HELD_OUT_SEED, Case  # noqa: E402
from quad_tune.evaluation import task_of  # noqa: E402
from quad_tune.flight_result import fly_task  # noqa: E402


def barn_worlds(folder: Path) -> Path:
    """Twelve empty worlds; 0 and 6 are of the official sample."""
    numbers = np.arange(12, dtype=np.int32)
    way = np.array([[-2.25, 5.0], [-2.25, 9.0]], np.float32)
    np.savez(
        folder / "worlds.npz",
        index=numbers,
        occupied=np.zeros((12, 64, 30), np.uint8),
        **{f"path_{number}": way for number in numbers},
    )
    return folder / "worlds.npz"


def test_barn_is_searched_outside_of_the_official_sample(tmp_path):
    course = BarnCourse(BarnOptions(barn_worlds(tmp_path)))
    searched_worlds = [case.name for case in course.search_cases(10)]
    held_out = [case.name for case in course.held_out_cases(3)]
    numbers = sorted(int(name.split()[-1]) for name in searched_worlds)
    assert numbers == [1, 2, 3, 4, 5, 7, 8, 9, 10, 11]
    assert held_out == ["BARN world 0", "BARN world 6", "BARN world 0"]
    assert {int(name.split()[-1]) > 5 for name in searched_worlds[:2]} == {True, False}
    assert {case.seed for case in course.held_out_cases(3)} == {HELD_OUT_SEED, HELD_OUT_SEED + 1}


def test_a_flight_through_barn_counts_as_the_benchmark_counts_it(tmp_path):
    path = barn_worlds(tmp_path)
    course = BarnCourse(BarnOptions(path))
    cases = [Case(0, "BARN world 0", 0)]
    flight = fly_task(task_of(course, cases[0], ()))
    setup = read_barn_setup(BarnOptions(path, only=(0,)))
    run = fly_world(setup.contestant, setup.worlds[0], 0)
    assert run.outcome is Outcome.SUCCESS
    found = course.protocol_statistics(cases, [flight]).data
    assert found["successes"] == 1
    assert (found["mean_time_s"], found["metric"]) == (run.time_s, run.metric)
    touched = course.protocol_statistics(cases, [replace(flight, contacts=1)]).data
    late = course.protocol_statistics(cases, [replace(flight, reached=0)]).data
    assert (touched["collisions"], late["time_outs"]) == (1, 1)
    assert touched["metric"] == late["metric"] == 0.0


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["--worlds", "none.npz"], "none.npz"),
        (["--worlds", "none.npz", "--robots", "2"], "cannot be combined with"),
    ],
)
def test_worlds_that_cannot_be_used_are_refused(arguments, words, tmp_path):
    result = CliRunner().invoke(tune, [*arguments, "--output", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert words in result.output
    assert not (tmp_path / "out").exists()
