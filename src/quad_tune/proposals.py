"""Propose candidates from earlier trials with Optuna's TPE sampler, and prune candidates.

Candidates come in generations of a fixed size. A generation depends only on the seed, its number
and the trials of earlier generations. So neither the number of workers nor an interruption
changes the study.

Source: J. Bergstra et al., "Algorithms for Hyper-Parameter Optimization", NIPS 2011.
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

from quad_tune.space import Dimension, SearchSpace

STARTUP_TRIALS = 16
"""Number of candidates that are drawn at random before the sampler learns from trials."""
PRUNING_FROM_TRIALS = 5
"""No pruning before this many candidates have completed."""

optuna.logging.set_verbosity(logging.WARNING)


def distributions(space: SearchSpace) -> Dict[str, BaseDistribution]:
    """Convert the space to Optuna's distributions."""
    return {dimension.path: _distribution(dimension) for dimension in space.dimensions}


def propose(
    space: SearchSpace, history: Sequence[FrozenTrial], generation: int, size: int, seed: int
) -> List[Dict[str, Any]]:
    """Return the candidates of a generation; ``history`` holds all earlier trials."""
    study = _study(history, seed, generation)
    wanted = distributions(space)
    trials = [study.ask(wanted) for _ in range(size)]
    return [
        {
            dimension.path: dimension.rounded(trial.params[dimension.path])
            for dimension in space.dimensions
        }
        for trial in trials
    ]


def should_prune(history: Sequence[FrozenTrial], flights: int, running_mean: float) -> bool:
    """Return true if a candidate is worse than the median at the same flight.

    The median is that of the trials that completed all flights; all fly the same cases. Optuna's
    pruner would compare a candidate's best mean so far, which rewards luck in the first flights.
    It gets only the newest mean here.

    Args:
        history: Earlier trials.
        flights: Flights that the candidate has flown.
        running_mean: Its mean cost over them.
    """
    pruner = optuna.pruners.MedianPruner(
        n_startup_trials=PRUNING_FROM_TRIALS, n_min_trials=PRUNING_FROM_TRIALS
    )
    trial = optuna.create_trial(
        state=TrialState.RUNNING, intermediate_values={flights: running_mean}
    )
    return pruner.prune(_study(history, 0, 0), trial)


def _study(history: Sequence[FrozenTrial], seed: int, generation: int) -> optuna.Study:
    """Create a study in memory with the sampler of a generation."""
    number = int(np.random.SeedSequence([seed, generation]).generate_state(1)[0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        sampler = optuna.samplers.TPESampler(
            n_startup_trials=STARTUP_TRIALS, multivariate=True, constant_liar=True, seed=number
        )
    study = optuna.create_study(sampler=sampler)
    study.add_trials(history)
    return study


def _distribution(dimension: Dimension) -> BaseDistribution:
    if dimension.choices:
        return CategoricalDistribution(dimension.choices)
    if dimension.integer:
        return IntDistribution(int(dimension.low), int(dimension.high), log=dimension.log)
    return FloatDistribution(dimension.low, dimension.high, log=dimension.log)
