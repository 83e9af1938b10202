"""Fly candidates, each flight only once."""

from __future__ import annotations

from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Set, Tuple

from quad_nav.errors import InputError
from quad_nav.offline.workers import Workers, fly_all
from quad_tune.courses import Case, Course
from quad_tune.flight_cache import FlightCache, key_text
from quad_tune.flight_result import FlightResult, FlightTask, fly_task
from quad_tune.space import Assignments, SearchSpace, Values
from quad_tune.study_database import Key


def task_of(course: Course, case: Case, assignments: Assignments) -> FlightTask:
    """Build a flight for a worker process; invalid parameters are noted in the task."""
    try:
        return FlightTask(course.setup(case, assignments), course.ends_at_contact)
    except InputError as error:
        return FlightTask(None, refused="; ".join(error.problems))


class StudyObserver:
    """Base class of progress displays; every method may do nothing."""

    def on_stored(self, flights: int) -> None:
        """Handle the number of flights that are stored already."""

    def on_remaining(self, flights: int) -> None:
        """Handle a new estimate of the flights still to come, stored ones included."""

    def on_stage(self, name: str) -> None:
        """Handle the start of a stage of the study."""

    def on_flight(self, flight: FlightResult, cached: bool) -> None:
        """Handle a result, of a new flight or from the cache."""

    def on_candidates(self, candidates: int, best: float) -> None:
        """Handle completed candidates; ``best`` is the lowest cost so far."""

    def on_problem(self, problem: str) -> None:
        """Handle a fault that does not end the flights, such as a full disk."""


class Evaluation:
    """Flies what is not in the cache, and caches each result at once.

    ``context`` distinguishes the flights of several studies in one cache.

    Attributes:
        later: Estimate of the flights after the present stage of the study.
    """

    def __init__(
        self,
        course: Course,
        space: SearchSpace,
        workers: Workers,
        journal: FlightCache,
        observer: StudyObserver,
        context: Optional[Mapping[str, Any]] = None,
    ) -> None:
        self.course = course
        self.space = space
        self.observer = observer
        self._workers = workers
        self._cache = journal
        self._context = {} if context is None else dict(context)
        self._counted: Set[Key] = set()
        self.later = 0

    def of(self, course: Course, context: Mapping[str, Any]) -> Evaluation:
        """Return an evaluation of another course with the same workers and cache."""
        return Evaluation(course, self.space, self._workers, self._cache, self.observer, context)

    def expect(self, flights: int) -> None:
        """Tell the observer how many flights the present stage still flies."""
        self.observer.on_remaining(flights + self.later)

    def fly(self, wanted: Iterable[Tuple[Values, Case]]) -> None:
        """Fly all cases that are not in the cache."""
        missing: Dict[Key, Tuple[Values, Case]] = {}
        for values, case in wanted:
            key = self._key(values, case)
            if key not in self._cache:
                missing[key] = (values, case)
            elif key not in self._counted:
                self._counted.add(key)
                self.observer.on_flight(self._cache[key], True)
        keys = list(missing)
        tasks = [
            (number, task_of(self.course, case, self.space.assignments(values)))
            for number, (values, case) in enumerate(missing.values())
        ]
        for number, flight in fly_all(self._workers, fly_task, tasks):
            self._cache.add(keys[number], flight)
            self._counted.add(keys[number])
            self.observer.on_flight(flight, False)

    def flights(self, values: Values, cases: Sequence[Case]) -> List[FlightResult]:
        """Return the cached results of a candidate, in the order of the cases."""
        return [self._cache[self._key(values, case)] for case in cases]

    def evaluate(
        self, candidates: Sequence[Values], cases: Sequence[Case]
    ) -> List[List[FlightResult]]:
        """Fly all candidates and return each candidate's results."""
        self.fly((values, case) for case in cases for values in candidates)
        return [self.flights(values, cases) for values in candidates]

    def _key(self, values: Values, case: Case) -> Key:
        parameters = {**self._context, **dict(self.space.assignments(values))}
        return key_text(parameters), case.name, case.seed
