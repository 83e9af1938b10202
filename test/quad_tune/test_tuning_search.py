"""Search and refinement with synthetic flights, where the best is known."""

from __future__ import annotations

import json
import os
from pathlib import Path
from signal import SIGKILL
from typing import Optional

import optuna
import pytest
from optuna.trial import TrialState
from study_flights import (
    SYNTHETIC_BASE,
    SYNTHETIC_SPACE,
    SyntheticCourse,
    SyntheticWorkers,
    trials_as_data,
)

from quad_nav.errors import InputError
from quad_tune.evaluation import Evaluation, StudyObserver
from quad_tune.flight_cache import FlightCache
from quad_tune.flight_result import FlightResult
from quad_tune.proposals import propose, should_prune
from quad_tune.refinement import refine
from quad_tune.report.tune_plots import importances
from quad_tune.search import SearchOptions, rounds, search
from quad_tune.study import json_differences, open_study
from quad_tune.study_text import gain_text

OPTIONS = SearchOptions(candidates=32, flights=4, generation=8, seed=3)
IDENTITY = {"course": "synthetic"}


def interrupt():
    raise KeyboardInterrupt


class StopsAfter(StudyObserver):
    """Ends, as by Ctrl-C, after so many flights."""

    def __init__(self, flights: int, stop=interrupt):
        self._left, self._stop = flights, stop

    def on_flight(self, flight: FlightResult, cached: bool) -> None:
        self._left -= not cached
        if self._left == 0:
            self._stop()


def run(folder: Path, options: SearchOptions = OPTIONS, observer: Optional[StudyObserver] = None):
    """The trials of a search, and the flights that it flew."""
    workers = SyntheticWorkers()
    with open_study(folder, IDENTITY) as study:
        evaluation = Evaluation(
            SyntheticCourse(), SYNTHETIC_SPACE, workers, study.journal, observer or StudyObserver()
        )
        try:
            search(evaluation, study, SYNTHETIC_BASE, options)
        except KeyboardInterrupt:
            pass
        return trials_as_data(study.trials), workers.flown


def test_flights_are_flown_in_rounds():
    assert rounds(1) == (1,)
    assert rounds(2) == (2,)
    assert rounds(8) == (2, 4, 8)
    assert rounds(10) == (2, 4, 8, 10)


def test_the_search_finds_what_is_best_and_drops_what_is_bad(tmp_path):
    trials, flown = run(tmp_path)
    assert len(trials) == 32
    assert trials[0][3] == SYNTHETIC_BASE
    best = min(trials, key=lambda trial: trial[2])
    assert abs(best[3]["speed"] - 0.5) < 0.05  # within a tenth of the range
    dropped = [trial for trial in trials if trial[1] is TrialState.PRUNED]
    assert dropped and all(max(trial[4]) < 4 for trial in dropped)
    assert len(flown) == sum(max(trial[4]) for trial in trials) < 128


def test_no_candidate_of_a_generation_knows_of_another(tmp_path):
    trials, _ = run(tmp_path, SearchOptions(16, 2, 8, 3))
    with open_study(tmp_path, IDENTITY) as study:
        first = study.trials[:8]
    assert propose(SYNTHETIC_SPACE, first, 1, 8, 3) == [trial[3] for trial in trials[8:]]
    assert propose(SYNTHETIC_SPACE, first, 1, 8, 4) != [trial[3] for trial in trials[8:]]


@pytest.mark.slow
@pytest.mark.parametrize("flights", [5, 60])
def test_an_interrupted_search_ends_as_an_uninterrupted_one_and_flies_nothing_again(
    tmp_path, flights
):
    whole, all_flown = run(tmp_path / "whole")
    _, before = run(tmp_path / "parts", observer=StopsAfter(flights))
    assert len(before) == flights
    resumed, after = run(tmp_path / "parts")
    assert resumed == whole
    assert sorted(before + after) == sorted(all_flown)


def test_a_search_can_be_made_longer(tmp_path):
    whole, _ = run(tmp_path / "whole", SearchOptions(20, 4, 8, 3))
    run(tmp_path / "parts", SearchOptions(11, 4, 8, 3))
    assert run(tmp_path / "parts", SearchOptions(20, 4, 8, 3))[0] == whole


@pytest.mark.slow
def test_kill_9_loses_nothing(tmp_path):
    whole, all_flown = run(tmp_path / "whole")
    child = os.fork()
    if child == 0:
        run(tmp_path / "parts", observer=StopsAfter(23, lambda: os.kill(os.getpid(), SIGKILL)))
    assert os.WTERMSIG(os.waitpid(child, 0)[1]) == SIGKILL
    assert FlightCache(tmp_path / "parts" / "study.db").known_at_start == 23
    resumed, after = run(tmp_path / "parts")
    assert resumed == whole and 23 + len(after) == len(all_flown)


def test_a_folder_keeps_to_its_study(tmp_path):
    with open_study(tmp_path, {"seed": 0, "space": [1, 2]}):
        with pytest.raises(InputError, match="another quad tune works on this study"):
            with open_study(tmp_path, {"seed": 0, "space": [1, 2]}):
                pass
    with pytest.raises(InputError) as raised:
        with open_study(tmp_path, {"seed": 1, "space": [1, 3], "x": "y"}):
            pass
    assert [line.split(": ", 2)[2].split(";")[0] for line in raised.value.problems] == [
        "seed was 0 and is 1",
        "space[1] was 2 and is 3",
        'x was absent and is "y"',
    ]
    assert json_differences({"a": (1,)}, {"a": [2, 3]}) != []
    (tmp_path / "study.db").write_text("no database, but long enough to be looked at" * 100)
    with pytest.raises(InputError, match="file is not a database; expected a file of quad tune"):
        with open_study(tmp_path, {}):
            pass


def test_a_candidate_is_dropped_above_the_median_of_those_that_flew_everything():
    trials = [
        optuna.create_trial(value=1.0, intermediate_values={2: float(mean), 4: 1.0})
        for mean in (1, 2, 3, 4, 5)
    ]
    assert should_prune(trials, 2, 3.01)
    assert not should_prune(trials, 2, 3.0)
    assert not should_prune(trials[:4], 2, 99.0)  # too few to say
    pruned = optuna.create_trial(state=TrialState.PRUNED, value=0.0, intermediate_values={2: 0.0})
    assert not should_prune([*trials, pruned, pruned], 2, 3.0)


def test_refining_keeps_what_helps_and_takes_back_what_does_not():
    workers, course = SyntheticWorkers(), SyntheticCourse()
    evaluation = Evaluation(course, SYNTHETIC_SPACE, workers, FlightCache(), StudyObserver())
    refined = refine(
        evaluation,
        [{"speed": 0.5, "idle": 0.9, "bad": 0.0}, {"speed": 0.6, "idle": 0.2, "bad": 0.0}],
        SYNTHETIC_BASE,
        course.search_cases(2),
        course.search_cases(3),
    )
    assert refined.values == {"speed": 0.5}
    (gain,) = refined.gains
    assert (gain.path, gain.value, gain.base) == ("speed", 0.5, 0.1)
    # 40 s less over 10 m: 4 s for each metre.
    found = gain.difference
    assert (found.time_s.mean, gain.cost) == (pytest.approx(-40.0), pytest.approx(4.0))
    assert (found.time_s.low, found.time_s.high) == (pytest.approx(-40.0), pytest.approx(-40.0))
    assert gain_text(gain) == "not distinguishable from chance with 3 flights"
    assert len(workers.flown) == len(set(workers.flown))


def test_nothing_is_changed_when_nothing_beats_the_base():
    course = SyntheticCourse()
    evaluation = Evaluation(
        course, SYNTHETIC_SPACE, SyntheticWorkers(), FlightCache(), StudyObserver()
    )
    refined = refine(
        evaluation,
        [{"speed": 0.99, "idle": 0.5, "bad": 0.0}, {"speed": 0.5, "idle": 0.5, "bad": 9.0}],
        {**SYNTHETIC_BASE, "speed": 0.1},
        course.search_cases(2),
        course.search_cases(2),
    )
    assert refined.values == {} and refined.gains == ()


def test_a_flight_is_known_by_parameters_mission_and_seed(tmp_path):
    course = SyntheticCourse()
    workers = SyntheticWorkers()
    for _ in range(2):
        evaluation = Evaluation(
            course, SYNTHETIC_SPACE, workers, FlightCache(tmp_path / "f.db"), StudyObserver()
        )
        evaluation.evaluate(
            [{"speed": 0.5}, {"speed": 0.5}, {"speed": 0.25}], course.search_cases(2)
        )
    assert [json.loads(flown) for flown in workers.flown] == [
        [{"speed": 0.5}, 0],
        [{"speed": 0.25}, 0],
        [{"speed": 0.5}, 1],
        [{"speed": 0.25}, 1],
    ]


def test_the_parameter_that_counts_is_found(tmp_path):
    run(tmp_path)
    with open_study(tmp_path, IDENTITY) as study:
        found = importances(study.trials, SYNTHETIC_SPACE)
        assert importances(study.trials[:5], SYNTHETIC_SPACE) == {}  # too few to say
    assert next(iter(found)) == "speed"
    assert sum(found.values()) == pytest.approx(1.0)
