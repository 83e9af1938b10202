"""Independent flights at the same time: on this machine's cores, or on a Ray cluster.

Both are backends of joblib. Results come as flights end, in any order; no result depends on the
worker. A worker that dies costs the flights that it was flying, and they are flown again.
"""

from __future__ import annotations

import os
import signal
from typing import Any, Callable, Iterable, Iterator, Optional, Sequence, Tuple, TypeVar, Union

import joblib
from joblib.externals.loky.process_executor import TerminatedWorkerError

from quad_nav.errors import InputError, QuadError
from quad_nav.files.user_files import in_folder, outside_current_folder

MAX_DEATHS = 3
_RAY_BACKEND = "quad_ray"

Task = TypeVar("Task")
Result = TypeVar("Result")


class WorkersLost(QuadError):
    """Workers died repeatedly without completing a single flight."""


class WorkerDied(Exception):
    """A worker died; its flights have no result."""


class LocalWorkers:
    """Processes on this machine, one per core by default; one worker is this process.

    Attributes:
        count: Number of tasks at the same time.
    """

    def __init__(self, count: Optional[int] = None) -> None:
        self.count = int(joblib.cpu_count()) if count is None else count

    def run(
        self, function: Callable[[Task], Result], tasks: Iterable[Tuple[int, Task]]
    ) -> Iterator[Tuple[int, Result]]:
        """Yield each task's number and result as soon as it is there.

        Raises:
            WorkerDied: A process died.
        """
        if self.count == 1:
            yield from ((number, function(task)) for number, task in tasks)
            return
        parallel = joblib.Parallel(
            self.count, backend="loky", batch_size=1, return_as="generator_unordered"
        )
        here = os.getcwd()
        calls = (
            joblib.delayed(in_folder)(here, _run_in_worker, function, number, task)
            for number, task in tasks
        )
        is_safe = "PYTHONSAFEPATH" in os.environ
        os.environ["PYTHONSAFEPATH"] = "1"  # for workers that joblib replaces, from Python 3.11 on
        try:
            with outside_current_folder():
                results = parallel(calls)  # starts the workers
            yield from results
        except TerminatedWorkerError as error:
            raise WorkerDied from error
        finally:
            if not is_safe:
                del os.environ["PYTHONSAFEPATH"]


class RayWorkers:
    """Workers on a Ray cluster, one per core by default."""

    def __init__(self, address: str, count: Optional[int] = None) -> None:
        """Connect to the cluster.

        Raises:
            InputError: Ray is not installed, or no cluster answers at the address.
        """
        try:
            import ray
        except ImportError as error:
            raise InputError(
                ["--ray: Ray is not installed; expected it from pip install 'quad-nav[ray]'"]
            ) from error
        try:
            with outside_current_folder():  # Ray's workers import from the driver's
                ray.init(address=address, logging_level="ERROR", log_to_driver=False)
        except (ConnectionError, OSError, RuntimeError, ValueError) as error:
            raise InputError(
                [
                    f"--ray {address}: {error}; expected the address of a running "
                    "cluster, as 10.0.0.1:6379"
                ]
            ) from error
        from ray.util.joblib.ray_backend import RayBackend

        class StreamingRayBackend(RayBackend):
            # Its pool calls back for every result, which is all that results one by one need.
            supports_return_generator = True

        joblib.register_parallel_backend(_RAY_BACKEND, StreamingRayBackend)
        self._ray_error: Any = ray.exceptions.RayError
        self.count = count or int(ray.cluster_resources().get("CPU", 1))

    def run(
        self, function: Callable[[Task], Result], tasks: Iterable[Tuple[int, Task]]
    ) -> Iterator[Tuple[int, Result]]:
        """See ``LocalWorkers.run``; a failure of the cluster counts as the death of a worker."""
        try:
            with joblib.parallel_config(_RAY_BACKEND):
                parallel = joblib.Parallel(
                    self.count, batch_size=1, return_as="generator_unordered"
                )
                yield from parallel(
                    joblib.delayed(_run_in_worker)(function, number, task) for number, task in tasks
                )
        except self._ray_error as error:
            raise WorkerDied from error


Workers = Union[LocalWorkers, RayWorkers]


def fly_all(
    workers: Workers, function: Callable[[Task], Result], tasks: Sequence[Tuple[int, Task]]
) -> Iterator[Tuple[int, Result]]:
    """Fly each numbered task once, also if workers die, and yield results as they come.

    Args:
        workers: Processes that fly.
        function: Flies a task; a function of a module, so that workers can import it.
        tasks: Numbered tasks.

    Yields:
        A task's number and its result.

    Raises:
        WorkersLost: Workers died ``MAX_DEATHS`` times without completing a flight.
    """
    left = dict(tasks)
    deaths = 0
    while left:
        try:
            for number, result in workers.run(function, list(left.items())):
                del left[number]
                deaths = 0
                yield number, result
        except WorkerDied as error:
            deaths += 1
            if deaths == MAX_DEATHS:
                raise WorkersLost(
                    f"workers died {deaths} times without completing any of {len(left)} flights; "
                    "check the memory, or fly fewer at the same time"
                ) from error


def _run_in_worker(
    function: Callable[[Task], Result], number: int, task: Task
) -> Tuple[int, Result]:
    # Ctrl-C reaches every process of the terminal; the main process ends the workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return number, function(task)
