"""Paired intervals worked out by hand and by simulation, and what studies claim with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from study_flights import FLOWN, PaperWorkers, tune_setup

from quad_tune.evaluation import StudyObserver
from quad_tune.flight_result import FlightTask
from quad_tune.statistics import (
    MIN_PAIRS,
    compare,
    mean_interval,
    paired_difference,
)
from quad_tune.study_text import comparison_text, held_out_lines, text, verdict
from quad_tune.tune import run_tune


def test_equal_pairs_differ_by_nothing():
    found = paired_difference([0.0] * 8)
    assert (found.pairs, found.mean, found.low, found.high) == (8, 0.0, 0.0, 0.0)
    assert not found.is_claimed


def test_a_single_pair_has_no_interval():
    found = paired_difference([-3.0])
    assert (found.mean, found.low, found.high, found.is_claimed) == (-3.0, None, None, False)
    assert mean_interval([]) is None


def test_two_values_span_the_interval():
    """Of two values the resampled means are a, (a + b) / 2 and b; the tails reach a and b."""
    assert mean_interval([1.0, 3.0]) == (1.0, 3.0)


def test_an_interval_of_ten_differences():
    """-1 and 1 in turn, moved by 2: the mean of 10 draws has the deviation 1 / sqrt(10) = 0.316.

    The expanded tails are Phi(-sqrt(10 / 9) 2.262) = 0.86 %, 2.38 deviations of a normal mean,
    so about 2 - 0.75 and 2 + 0.75; means of ten such draws are multiples of 0.2.
    """
    low, high = mean_interval([1.0, 3.0] * 5)
    assert (low, high) == (pytest.approx(1.2), pytest.approx(2.8))
    assert mean_interval([1.0, 3.0] * 5) == (low, high)  # the seed is fixed


@pytest.mark.parametrize("count", [8, 20])
def test_intervals_cover_the_mean_as_often_as_they_say(count):
    """400 simulated studies; three deviations of the count of 95 % are 3.3 %."""
    random = np.random.default_rng(99)
    covered = 0
    for _ in range(400):
        low, high = mean_interval(random.normal(5.0, 2.0, count))
        covered += low <= 5.0 <= high
    assert 0.915 <= covered / 400 <= 0.985


def test_fewer_than_six_pairs_claim_nothing():
    """Even where all agree: five signs agree by chance in 2 of 32 cases."""
    for count in range(1, MIN_PAIRS):
        assert not paired_difference([-1.0] * count).is_claimed
    assert paired_difference([-1.0] * MIN_PAIRS).is_claimed
    assert not paired_difference([-1.0, 1.0] * MIN_PAIRS).is_claimed


def test_times_count_where_both_flights_completed_the_mission():
    before = [FLOWN, replace(FLOWN, reached=0, time_s=300.0), replace(FLOWN, clearance_m=None)]
    after = [replace(FLOWN, time_s=30.0), FLOWN, replace(FLOWN, time_s=36.0)]
    found = compare(after, before)
    assert (found.time_s.pairs, found.time_s.mean) == (2, -7.0)
    assert (found.gap_m.pairs, found.gap_m.mean) == (2, 0.0)
    assert found.completed.mean == pytest.approx(1 / 3)
    # 10 m: 10 s less is a cost of 1; the goals that were missed cost 10000, 260 s more cost 26.
    assert found.cost.mean == pytest.approx((-1.0 - 10026.0 - 0.4 - 1.0 + 1.0) / 3, abs=0.5)
    with pytest.raises(ValueError, match="3 and 2 flights"):
        compare(after, before[:2])
    assert compare([FLOWN], [replace(FLOWN, reached=1)]).time_s is None


def pairs(count, change):
    """Flights with a change and without it, of which each differs a little from the others."""
    before = [replace(FLOWN, time_s=40.0 + k % 5) for k in range(count)]
    return [change(flight, k) for k, flight in enumerate(before)], before


def faster(flight, number):
    """3 s faster, give or take a second."""
    return replace(flight, time_s=flight.time_s - 3.0 + (number % 3 - 1))


@pytest.mark.parametrize(
    "count, change, words",
    [
        (12, faster, "3.0 s faster (95 %: 2.5 to 3.5)"),
        (4, faster, "not distinguishable from chance with 4 flights"),
        (1, faster, "not distinguishable from chance with 1 flight"),
        (12, lambda flight, _: flight, "no effect in 12 flights"),
        (
            12,
            lambda flight, k: replace(flight, time_s=40.0 + (k * 7) % 5),
            "not distinguishable from chance with 12 flights",
        ),
        (
            12,
            lambda flight, _: replace(flight, clearance_m=0.4, contacts=1),
            "100 % more flights with contacts (95 %: 100 to 100), gaps 0.10 m narrower "
            "(95 %: 0.10 to 0.10)",
        ),
        (
            12,
            lambda flight, _: replace(flight, roughness_mps2=0.196),
            "cost 0.002 lower (95 %: 0.002 to 0.002)",
        ),
    ],
)
def test_effects_in_words(count, change, words):
    assert comparison_text(compare(*pairs(count, change))) == words


def tuned(folder, fly, **given):
    """The result of a study on paper; ``fly`` gets the speed."""

    def flown(task: FlightTask):
        seed, tree = task.setup.seed, task.setup.configurations[0].to_tree()
        return fly(tree["TrajectoryPlannerROS"]["max_vel_x"], seed)

    setup = tune_setup(folder, folder / "out", **given)
    return run_tune(setup, PaperWorkers(flown), StudyObserver())


def by_speed(speed, seed):
    """Faster is better by seconds, and seeds differ by a tenth."""
    return replace(FLOWN, time_s=60.0 - 20.0 * speed + 0.1 * (seed % 3) * speed)


def test_a_clear_gain_is_claimed_with_its_interval(tmp_path):
    result = tuned(tmp_path, by_speed, held_out=8)
    words, kind = verdict(result)
    assert (words, kind) == ("Better than default in 8 flights", "good")
    (line,) = held_out_lines(result)
    assert line.startswith("tuned compared to default: ") and " s faster (95 %: " in line
    assert line in text(result)


def test_four_flights_claim_nothing(tmp_path):
    result = tuned(tmp_path, by_speed, held_out=4)
    assert result.refined.values
    assert verdict(result) == ("Not distinguishable from chance with 4 flights", "unclear")
    assert text(result).count("not distinguishable from chance with") >= 2  # and of each change


def test_a_mission_that_nothing_flies_claims_nothing(tmp_path):
    """The faster candidates only give up sooner, which costs less."""
    problems = []

    class Observer(StudyObserver):
        def on_problem(self, problem: str) -> None:
            problems.append(problem)

    setup = tune_setup(tmp_path, tmp_path / "out")
    workers = PaperWorkers(
        lambda task: replace(
            FLOWN,
            reached=0,
            time_s=10.0
            / task.setup.configurations[0].to_tree()["TrajectoryPlannerROS"]["max_vel_x"],
            reason="stuck",
        )
    )
    result = run_tune(setup, workers, Observer())
    assert min(trial.value for trial in result.trials[1:]) < result.trials[0].value
    assert result.refined.values == {}
    assert verdict(result) == ("Base kept: no candidate is better", "unclear")
    assert "No flight completed its mission" in text(result)
    assert "parameters of default are written unchanged" in text(result)
    assert problems == [
        "tune: the base default completed none of 2 flights (stuck) and reached 0 of 4 goals; a "
        "search from a base that flies the mission finds more"
    ]
