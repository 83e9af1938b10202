"""What many runs come to."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from typing import DefaultDict, List, Optional, Sequence, Tuple

from quad_nav.barn.protocol import Outcome, Run

_Z = 1.959963984540054
"""Of the normal distribution, 95 % on both sides."""


@dataclass(frozen=True)
class BarnStatistics:
    """Counts of outcomes, and means. ``gave_up`` of the time-outs ended before their time.

    ``mean_time_s``: of the successful runs of each world, and of that over the worlds, as the
    challenge has it; None without any. ``metric``: of all runs.
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
        """Within which the rate of success lies, with 95 % confidence."""
        return wilson_interval(self.successes, self.runs)


def barn_statistics(runs: Sequence[Run]) -> BarnStatistics:
    """Raises ValueError without any run."""
    if not runs:
        raise ValueError("no runs, no figures")
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


def wilson_interval(successes: int, trials: int) -> Tuple[float, float]:
    """Wilson's score interval of a rate, 95 %; it takes the trials for independent.

    E. B. Wilson, "Probable inference, the law of succession, and statistical inference",
    Journal of the American Statistical Association 22, 1927.
    """
    rate, weight = successes / trials, _Z * _Z / trials
    centre = (rate + weight / 2) / (1 + weight)
    half = _Z * math.sqrt(rate * (1 - rate) / trials + weight / (4 * trials)) / (1 + weight)
    return max(0.0, centre - half), min(1.0, centre + half)
