"""What to fly next: candidates from those that were told, by Optuna's TPE sampler.

Bergstra et al., "Algorithms for Hyper-Parameter Optimization", 2011. Candidates come in
generations of a fixed size. A generation depends on the seed, its number and the trials of the
generations before it and on nothing else, so that neither the number of workers nor an
interruption changes the study.
"""

from __future__ import annotations

import logging
import warnings
from typing import Any, Dict, List, Sequence

import numpy as np
import optuna
from optuna.distributions import (
    BaseDistribution,
    CategoricalDistribution,
    FloatDistribution,
    IntDistribution,
)
from optuna.trial import FrozenTrial, TrialState

from quad_nav.tuning.space import Dimension, SearchSpace

RANDOM_TRIALS = 16
"""So many candidates are drawn at random before there is anything to learn from."""
JUDGED_FROM_TRIALS = 5
"""Nobody is dropped before so many candidates have flown everything."""

optuna.logging.set_verbosity(logging.WARNING)


def distributions(space: SearchSpace) -> Dict[str, BaseDistribution]:
    """The space in Optuna's words."""
    return {one.path: _distribution(one) for one in space.dimensions}


def propose(
    space: SearchSpace, told: Sequence[FrozenTrial], generation: int, size: int, seed: int
) -> List[Dict[str, Any]]:
    """The candidates of a generation; ``told`` are all trials of those before it."""
    study = _study(told, seed, generation)
    wanted = distributions(space)
    trials = [study.ask(wanted) for _ in range(size)]
    return [
        {one.path: one.rounded(trial.params[one.path]) for one in space.dimensions}
        for trial in trials
    ]


def is_hopeless(told: Sequence[FrozenTrial], flights: int, running_mean: float) -> bool:
    """Whether a candidate with this mean cost after so many flights is dropped.

    It is when it is worse than the median of those that have flown everything was at the same
    flight; all fly the same ones. Optuna's own pruner would take a candidate's best mean so far,
    its luck at the first flights, so it is shown the newest alone.
    """
    pruner = optuna.pruners.MedianPruner(
        n_startup_trials=JUDGED_FROM_TRIALS, n_min_trials=JUDGED_FROM_TRIALS
    )
    trial = optuna.create_trial(
        state=TrialState.RUNNING, intermediate_values={flights: running_mean}
    )
    return pruner.prune(_study(told, 0, 0), trial)


def _study(told: Sequence[FrozenTrial], seed: int, generation: int) -> optuna.Study:
    """The trials in memory, with the sampler of a generation."""
    number = int(np.random.SeedSequence([seed, generation]).generate_state(1)[0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        sampler = optuna.samplers.TPESampler(
            n_startup_trials=RANDOM_TRIALS, multivariate=True, constant_liar=True, seed=number
        )
    study = optuna.create_study(sampler=sampler)
    study.add_trials(told)
    return study


def _distribution(one: Dimension) -> BaseDistribution:
    if one.choices:
        return CategoricalDistribution(one.choices)
    if one.integer:
        return IntDistribution(int(one.low), int(one.high), log=one.log)
    return FloatDistribution(one.low, one.high, log=one.log)
