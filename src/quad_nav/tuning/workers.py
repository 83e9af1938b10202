"""Flights at the same time: on the cores of this machine, or on a Ray cluster.

Both are backends of joblib. Results come as flights end, in any order; nothing of them depends
on who flew. A worker that dies costs the flights that were in the air, and they are flown again.
"""

from __future__ import annotations

import signal
from typing import Any, Iterable, Iterator, Optional, Protocol, Sequence, Tuple

import joblib
from joblib.externals.loky.process_executor import TerminatedWorkerError

from quad_nav.errors import InputError, QuadError
from quad_nav.tuning.flight_result import FlightResult, FlightTask, fly_task

MOST_DEATHS = 3
_RAY_BACKEND = "quad_ray"

Numbered = Tuple[int, FlightTask]
NumberedResult = Tuple[int, FlightResult]


class WorkersLost(QuadError):
    """Workers die again and again without finishing a single flight."""


class _WorkerDied(Exception):
    """Flights that were in the air are lost."""


class Workers(Protocol):
    """Who flies."""

    count: int

    def fly(self, tasks: Iterable[Numbered]) -> Iterator[NumberedResult]:
        """Each flight with its number, as soon as it is over."""


class LocalWorkers:
    """Processes on this machine; with one there is no other process than this."""

    def __init__(self, count: Optional[int] = None):
        self.count = int(joblib.cpu_count()) if count is None else count

    def fly(self, tasks: Iterable[Numbered]) -> Iterator[NumberedResult]:
        if self.count == 1:
            yield from ((number, fly_task(task)) for number, task in tasks)
            return
        parallel = joblib.Parallel(
            self.count, backend="loky", batch_size=1, return_as="generator_unordered"
        )
        try:
            yield from parallel(joblib.delayed(_fly_in_worker)(*task) for task in tasks)
        except TerminatedWorkerError as error:
            raise _WorkerDied from error


class RayWorkers:
    """Workers on a Ray cluster, as many as it has cores unless ``count`` says otherwise.

    Raises:
        InputError: Ray is not installed, or there is no cluster at the address.
    """

    def __init__(self, address: str, count: Optional[int] = None):
        try:
            import ray
        except ImportError as error:
            raise InputError(
                ["--ray: Ray is not installed; expected it from pip install 'quad-nav[ray]'"]
            ) from error
        try:
            ray.init(address=address, logging_level="ERROR", log_to_driver=False)
        except (ConnectionError, OSError, RuntimeError, ValueError) as error:
            raise InputError(
                [
                    f"--ray {address}: {error}; expected the address of a running "
                    "cluster, as 10.0.0.1:6379"
                ]
            ) from error
        self._died: Any = ray.exceptions.RayError
        self._register()
        self.count = count or int(ray.cluster_resources().get("CPU", 1))

    @staticmethod
    def _register() -> None:
        """Ray's own backend of joblib, which can hand over results one by one as well."""
        from ray.util.joblib.ray_backend import RayBackend

        class StreamingRayBackend(RayBackend):
            # Its pool calls back for every result, which is all that this needs.
            supports_return_generator = True

        joblib.register_parallel_backend(_RAY_BACKEND, StreamingRayBackend)

    def fly(self, tasks: Iterable[Numbered]) -> Iterator[NumberedResult]:
        try:
            with joblib.parallel_config(_RAY_BACKEND):
                parallel = joblib.Parallel(
                    self.count, batch_size=1, return_as="generator_unordered"
                )
                yield from parallel(joblib.delayed(_fly_in_worker)(*task) for task in tasks)
        except self._died as error:
            raise _WorkerDied from error


def fly_all(workers: Workers, tasks: Sequence[Numbered]) -> Iterator[NumberedResult]:
    """Every flight once, also when workers die.

    Raises:
        WorkersLost: they died ``MOST_DEATHS`` times without finishing a flight.
    """
    left = dict(tasks)
    deaths = 0
    while left:
        try:
            for number, result in workers.fly(list(left.items())):
                del left[number]
                deaths = 0
                yield number, result
        except _WorkerDied as error:
            deaths += 1
            if deaths == MOST_DEATHS:
                raise WorkersLost(
                    f"workers died {deaths} times without finishing any of {len(left)} flights: "
                    "is there enough memory for so many at a time?"
                ) from error


def _fly_in_worker(number: int, task: FlightTask) -> NumberedResult:
    # Ctrl-C reaches every process of the terminal; the first one ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return number, fly_task(task)
