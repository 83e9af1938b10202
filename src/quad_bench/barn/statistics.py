"""Statistics of many runs."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import DefaultDict, List, Optional, Sequence, Tuple

from quad_bench.barn.protocol import Outcome, Run
from quad_nav.report.results import wilson_interval


@dataclass(frozen=True)
class BarnStatistics:
    """Counts of outcomes, and means.

    Attributes:
        worlds: Number of worlds.
        runs: Number of runs.
        successes: Runs that reached the goal without contact.
        collisions: Runs that ended with a contact.
        time_outs: Runs that reached the time limit, or whose goal the navigator aborted.
        gave_up: Time-outs whose goal the navigator aborted.
        mean_time_s: Mean over the worlds of each world's mean time of successful runs, as in the
            challenge; None without a success.
        metric: Mean score of all runs.
    """

    worlds: int
    runs: int
    successes: int
    collisions: int
    time_outs: int
    gave_up: int
    mean_time_s: Optional[float]
    metric: float

    @property
    def success_interval(self) -> Tuple[float, float]:
        """The 95 % confidence interval of the success rate."""
        return wilson_interval(self.successes, self.runs)


def barn_statistics(runs: Sequence[Run]) -> BarnStatistics:
    """Compute the statistics of runs.

    Raises:
        ValueError: There are no runs.
    """
    if not runs:
        raise ValueError("no runs, expected at least one")
    counts = {outcome: sum(run.outcome is outcome for run in runs) for outcome in Outcome}
    times_s: DefaultDict[int, List[float]] = defaultdict(list)
    for run in runs:
        if run.outcome is Outcome.SUCCESS:
            times_s[run.world].append(run.time_s)
    means_s = [sum(times) / len(times) for _, times in sorted(times_s.items())]
    return BarnStatistics(
        len({run.world for run in runs}),
        len(runs),
        counts[Outcome.SUCCESS],
        counts[Outcome.COLLISION],
        counts[Outcome.TIME_OUT],
        sum(bool(r.gave_up) for r in runs),
        sum(means_s) / len(means_s) if means_s else None,
        sum(run.metric for run in runs) / len(runs),
    )
