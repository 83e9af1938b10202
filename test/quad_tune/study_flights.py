"""Studies of the small mission, and flights on paper."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, Iterator, List, Sequence, Tuple

from small_mission import write_mission

from quad_nav.errors import InputError
from quad_nav.offline.workers import Workers
from quad_nav.scenario.flight_setup import FlightSetup
from quad_tune.courses import HELD_OUT_SEED, Case, Mission, MissionOptions
from quad_tune.evaluation import Evaluation, StudyObserver
from quad_tune.flight_result import FlightResult, FlightTask
from quad_tune.search import SearchOptions, search
from quad_tune.space import Assignments, Dimension, SearchSpace
from quad_tune.study import open_study
from quad_tune.tune import TuneOptions, TuneSetup, read_tune_setup, start_values

SPACE = """\
TrajectoryPlannerROS/max_vel_x: {range: [0.3, 0.8]}
TrajectoryPlannerROS/vx_samples: {range: [3, 8], integer: true}
"*_costmap/inflation_radius": {range: [0.4, 0.9]}
"""
FAST = (
    ("TrajectoryPlannerROS/vtheta_samples", 8),
    ("global_costmap/width", 5.0),
    ("global_costmap/height", 4.0),
    ("TrajectoryPlannerROS/sim_time", 1.0),
)
FLOWN = FlightResult(
    goals=2,
    reached=2,
    contacts=0,
    time_s=40.0,
    straight_m=10.0,
    clearance_m=0.5,
    separation_m=None,
    roughness_mps2=0.2,
)


def mission_options(folder: Path, **given: Any) -> MissionOptions:
    """Whose flights take a fifth of what those with all samples do."""
    return MissionOptions((Mission(*write_mission(folder)),), parameters=FAST, **given)


def tune_setup(
    folder: Path, output: Path, candidates: int = 3, config: str = "default", **given: Any
) -> TuneSetup:
    """A study of few short flights."""
    options = mission_options(folder, config=config)
    space = folder / "space.yaml"
    if not space.exists():
        space.write_text(SPACE)
    return read_tune_setup(
        TuneOptions(
            options,
            output,
            space,
            SearchOptions(candidates, 2, 3, 0),
            finalists=1,
            final_flights=2,
            **{"held_out": 1, "free_speed": True, **given},
        )
    )


def trials_as_data(trials: Sequence[Any]) -> List[Tuple[Any, ...]]:
    """The contents of a study without the times of day."""
    return [
        (
            trial.number,
            trial.state,
            trial.value,
            trial.params,
            trial.intermediate_values,
            trial.user_attrs,
        )
        for trial in trials
    ]


def searched(setup: TuneSetup, workers: Workers) -> List[Tuple[Any, ...]]:
    """The trials of the search alone."""
    with open_study(setup.options.output, setup.identity) as study:
        evaluation = Evaluation(setup.course, setup.space, workers, study.journal, StudyObserver())
        search(evaluation, study, start_values(setup.space, setup.base), setup.options.search)
        return trials_as_data(study.trials)


def mortal_tasks(marker: Path, deaths: int) -> List[Tuple[int, Any]]:
    """Six synthetic flights, one of which kills its worker so many times."""

    class Mortal:
        setup = None

        def __init__(self, kills: bool):
            self.kills = kills

        @property
        def refused(self) -> str:
            if self.kills:
                with marker.open("a") as file:
                    file.write("x")
                if len(marker.read_text()) <= deaths:
                    os._exit(9)
            return "flown"

    return [(number, Mortal(number == 3)) for number in range(6)]


class SyntheticCourse:
    """Synthetic flights: how long one takes follows from its parameters and its seed.

    Its workers are ``SyntheticWorkers``. The best speed is 0.5; "idle" has no effect; a "bad" of
    more than 5 reaches no goal.
    """

    config = "default"
    fixed = ()
    ends_at_contact = False

    def search_cases(self, count: int) -> Tuple[Case, ...]:
        return tuple(Case(0, "synthetic", seed) for seed in range(count))

    def held_out_cases(self, count: int) -> Tuple[Case, ...]:
        return tuple(Case(0, "synthetic", HELD_OUT_SEED + seed) for seed in range(count))

    def setup(self, case: Case, assignments: Assignments) -> FlightSetup:
        """Synthetic flights have no set-up; the refusal holds their parameters."""
        raise InputError([json.dumps([dict(assignments), case.seed])])

    def identity(self) -> Dict[str, Any]:
        return {"course": "synthetic"}


class SyntheticWorkers:
    """Flies synthetic flights and counts them."""

    count = 1

    def __init__(self) -> None:
        self.flown: List[str] = []

    def run(
        self,
        function: Callable[[FlightTask], FlightResult],
        tasks: Iterable[Tuple[int, FlightTask]],
    ) -> Iterator[Tuple[int, FlightResult]]:
        for number, task in tasks:
            self.flown.append(task.refused)
            yield number, paper_flight(*json.loads(task.refused))


def paper_flight(parameters: Dict[str, Any], seed: int) -> FlightResult:
    """10 m in 40 s and more the farther the speed is from 0.5; seeds differ by a second."""
    time_s = 40.0 + 100.0 * abs(parameters.get("speed", 0.1) - 0.5) + seed % 3
    reached = 2 if parameters.get("bad", 0.0) <= 5.0 else 0
    return replace(FLOWN, time_s=time_s, reached=reached)


SYNTHETIC_SPACE = SearchSpace(
    "synthetic",
    (Dimension("speed", 0.0, 1.0), Dimension("idle", 0.0, 1.0), Dimension("bad", 0.0, 10.0)),
)
SYNTHETIC_BASE = {"speed": 0.1, "idle": 0.5, "bad": 0.0}


class PaperWorkers:
    """Returns the result of a function for each flight, without flying."""

    count = 1

    def __init__(self, fly: Callable[[FlightTask], FlightResult] = lambda _: FLOWN) -> None:
        self._fly = fly
        self.flown = 0

    def run(
        self, function: Any, tasks: Iterable[Tuple[int, FlightTask]]
    ) -> Iterator[Tuple[int, FlightResult]]:
        """Yield each task's number and the result."""
        for number, task in tasks:
            self.flown += 1
            yield number, self._fly(task)


def without_flying(
    monkeypatch: Any, module: str, fly: Callable[[FlightTask], FlightResult] = lambda _: FLOWN
) -> None:
    """Let a command fly on paper."""
    monkeypatch.setattr(f"quad_tune.cli.{module}.workers_of", lambda *_: PaperWorkers(fly))
    monkeypatch.setattr("quad_tune.cli.flights_bar.compile_kernels", lambda *_: None)
