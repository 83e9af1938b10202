"""Fly many flights in worker processes."""

from __future__ import annotations

from typing import Any, Callable, Iterable, Iterator, Tuple, TypeVar

from quad_nav.offline import workers

R = TypeVar("R")


def fly_each(
    function: Callable[..., R], tasks: Iterable[Tuple[Any, ...]], count: int
) -> Iterator[R]:
    """Yield the flight of each task as soon as it is flown, in any order.

    The flights do not depend on ``count``, the number of flights at the same time.

    Args:
        function: Flies a task; found by its name in every worker.
        tasks: Arguments of the function.
        count: Number of workers.

    Raises:
        WorkersLost: Workers died repeatedly.
    """
    numbered = list(enumerate((function, task) for task in tasks))
    flown = workers.fly_all(workers.LocalWorkers(count), _fly, numbered)
    return (flight for _, flight in flown)


def _fly(task: Tuple[Callable[..., R], Tuple[Any, ...]]) -> R:
    function, arguments = task
    return function(*arguments)
