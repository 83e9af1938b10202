"""Candidates times flights: each flown once, whoever asks for it and however often."""

from __future__ import annotations

from typing import Any, Dict, Iterable, List, Mapping, Optional, Protocol, Sequence, Set, Tuple

from quad_nav.errors import InputError
from quad_nav.offline.workers import Workers, fly_all
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.tuning.courses import Case
from quad_nav.tuning.flight_cache import FlightCache, Key, key_text
from quad_nav.tuning.flight_result import FlightResult, FlightTask, fly_task
from quad_nav.tuning.space import Assignments, SearchSpace, Values


class Course(Protocol):
    """What candidates fly; see ``courses`` and ``barn_course``."""

    @property
    def ends_at_contact(self) -> bool:
        """Whether a flight is over when something is touched."""

    @property
    def config(self) -> str:
        """The base: a shipped folder's name or a folder."""

    @property
    def fixed(self) -> Tuple[Tuple[str, Any], ...]:
        """Parameters on top of the base."""

    def search_cases(self, count: int) -> Tuple[Case, ...]:
        """The first flights of the search."""

    def held_out_cases(self, count: int) -> Tuple[Case, ...]:
        """Flights that the search never sees."""

    def setup(self, case: Case, assignments: Assignments) -> FlightSetup:
        """One flight with parameters on top of the base; InputError if it cannot be."""

    def identity(self) -> Dict[str, Any]:
        """What else flights depend on."""


def task_of(course: Course, case: Case, assignments: Assignments) -> FlightTask:
    """A flight that can be sent anywhere; it says if the parameters cannot be used."""
    try:
        return FlightTask(course.setup(case, assignments), course.ends_at_contact)
    except InputError as error:
        return FlightTask(None, refused="; ".join(error.problems))


class Watcher:
    """Is told how the work goes on; every method may do nothing."""

    def expect(self, flights: int) -> None:
        """So many flights more will come, or less."""

    def stage(self, name: str) -> None:
        """What is flown for now."""

    def flown(self, flight: FlightResult, kept: bool) -> None:
        """A flight is over, or was flown before and ``kept``."""

    def told(self, candidates: int, best: float) -> None:
        """So many candidates are through; ``best`` is the least cost so far."""


class Evaluation:
    """Flies what is not in the journal yet, and keeps it there as it comes.

    ``context``: what else tells flights apart in a journal of several studies.
    """

    def __init__(
        self,
        course: Course,
        space: SearchSpace,
        workers: Workers,
        journal: FlightCache,
        watcher: Watcher,
        context: Optional[Mapping[str, Any]] = None,
    ) -> None:
        self.course = course
        self.space = space
        self.watcher = watcher
        self._workers = workers
        self._cache = journal
        self._context = {} if context is None else dict(context)
        self._counted: Set[Key] = set()

    def of(self, course: Course, context: Mapping[str, Any]) -> Evaluation:
        """The same workers and journal for another course."""
        return Evaluation(course, self.space, self._workers, self._cache, self.watcher, context)

    def fly(self, wanted: Iterable[Tuple[Values, Case]]) -> None:
        """Afterwards all of them are in the journal."""
        missing: Dict[Key, Tuple[Values, Case]] = {}
        for values, case in wanted:
            key = self._key(values, case)
            if key not in self._cache:
                missing[key] = (values, case)
            elif key not in self._counted:
                self._counted.add(key)
                self.watcher.flown(self._cache[key], True)
        keys = list(missing)
        tasks = [
            (number, task_of(self.course, case, self.space.assignments(values)))
            for number, (values, case) in enumerate(missing.values())
        ]
        for number, flight in fly_all(self._workers, fly_task, tasks):
            self._cache.add(keys[number], flight)
            self._counted.add(keys[number])
            self.watcher.flown(flight, False)

    def flights(self, values: Values, cases: Sequence[Case]) -> List[FlightResult]:
        """Results of flights that were flown, in the cases' order."""
        return [self._cache[self._key(values, case)] for case in cases]

    def flown(
        self, candidates: Sequence[Values], cases: Sequence[Case]
    ) -> List[List[FlightResult]]:
        """Flies them and returns each candidate's results."""
        self.fly((values, case) for case in cases for values in candidates)
        return [self.flights(values, cases) for values in candidates]

    def _key(self, values: Values, case: Case) -> Key:
        parameters = {**self._context, **dict(self.space.assignments(values))}
        return key_text(parameters), case.name, case.seed
