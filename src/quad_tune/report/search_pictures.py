"""Pictures of a search: costs of the candidates, importances and values of the parameters."""

from __future__ import annotations

import math
import warnings
from typing import Any, Dict, List, Sequence, Tuple

import numpy as np
import optuna
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from optuna.trial import FrozenTrial

from quad_nav.report.style import ALARM, QUIET, colour, label_log, new_figure, robot_legend
from quad_tune.search import is_complete
from quad_tune.space import Dimension, SearchSpace

_COLUMNS = 3
_LEAST_FOR_IMPORTANCES = 20
_TOP = 1.15  # upper end of the axis, in parts of the usual range of costs


def history_picture(trials: Sequence[FrozenTrial], reference: float) -> Figure:
    """Draw the cost of each candidate in order, the best so far, and the base's."""
    figure = new_figure(3.4)
    axes = figure.subplots()
    top = _top(trials, reference)
    _draw_costs(axes, [trial.number for trial in trials], trials, top)
    costs = [_value(trial) if is_complete(trial) else math.inf for trial in trials]
    axes.step(
        [trial.number for trial in trials],
        np.minimum.accumulate(costs),
        where="post",
        color=colour(0),
        lw=1.6,
        label="best so far",
    )
    axes.axhline(reference, color="black", ls="--", lw=1.0, label="base")
    axes.set(xlabel="candidate", ylabel="mean cost", ylim=(_bottom(trials, reference), top))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    robot_legend(figure, (), [*_dots(), *axes.get_legend_handles_labels()[0]])
    return figure


def importances(trials: Sequence[FrozenTrial], space: SearchSpace) -> Dict[str, float]:
    """Return how much each parameter separates good candidates, largest first, sum 1.

    Empty if there are too few candidates.

    Source: S. Watanabe, A. Bansal, F. Hutter, "PED-ANOVA: Efficiently Quantifying Hyperparameter
    Importance in Arbitrary Subspaces", IJCAI 2023.
    """
    complete = [trial for trial in trials if is_complete(trial)]
    if len(complete) < _LEAST_FOR_IMPORTANCES or len(space.dimensions) < 2:
        return {}
    study = optuna.create_study()
    study.add_trials(complete)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        evaluator = optuna.importance.PedAnovaImportanceEvaluator()
    found = optuna.importance.get_param_importances(
        study, evaluator=evaluator, params=list(space.paths)
    )
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))


def importance_picture(found: Dict[str, float]) -> Figure:
    """Draw a bar for each parameter."""
    figure = new_figure(0.9 + 0.24 * len(found))
    axes = figure.subplots()
    names = list(found)
    axes.barh(range(len(names)), list(found.values()), color=colour(0), height=0.65)
    axes.set(xlabel="importance", ylim=(len(names) - 0.4, -0.6), yticks=range(len(names)))
    axes.set_yticklabels(names)
    axes.grid(axis="y", visible=False)
    return figure


def slice_picture(
    trials: Sequence[FrozenTrial],
    space: SearchSpace,
    order: Sequence[str],
    chosen: Dict[str, Any],
    base: Dict[str, Any],
    reference: float,
) -> Figure:
    """Draw the cost of each candidate over the value of each parameter.

    Args:
        trials: Candidates.
        space: Searched parameters.
        order: Paths of the parameters, most important first.
        chosen: Tuned values.
        base: Values of the base.
        reference: Cost of the base.
    """
    rows = -(-len(order) // _COLUMNS)
    figure = new_figure(0.6 + 1.75 * rows)
    by_path = {dimension.path: dimension for dimension in space.dimensions}
    top, bottom = _top(trials, reference), _bottom(trials, reference)
    panels: List[Axes] = list(figure.subplots(rows, _COLUMNS, squeeze=False).flat)
    for axes, path in zip(panels, order):
        dimension = by_path[path]
        _draw_costs(axes, [_place(dimension, trial.params[path]) for trial in trials], trials, top)
        for value, style in ((base.get(path), "--"), (chosen.get(path), "-")):
            if value is not None:
                axes.axvline(_place(dimension, value), color="black", ls=style, lw=1.0, zorder=1)
        axes.set_title("\n".join(_two_lines(path)), fontsize=7.5)
        axes.set_ylim(bottom, top)
        _scale(axes, dimension)
    for axes in panels[len(order) :]:
        axes.axis("off")
    robot_legend(
        figure,
        (),
        [*_dots(), *(_line(style, name) for style, name in (("--", "base"), ("-", "tuned")))],
    )
    return figure


def cost_axis(trials: Sequence[FrozenTrial], reference: float) -> Tuple[float, float]:
    """Return the ends of the axis of costs, which does not start at 0."""
    return _bottom(trials, reference), _top(trials, reference)


def is_off_scale(trial: FrozenTrial, top: float) -> bool:
    """Return true if a cost is drawn at the axis's upper end."""
    return _value(trial) >= top


def _draw_costs(
    axes: Axes, places: Sequence[float], trials: Sequence[FrozenTrial], top: float
) -> None:
    """Draw the costs; costs beyond the axis are drawn at its upper end."""
    for is_through, marker, face in ((True, "o", colour(0)), (False, "x", QUIET)):
        points = [
            (place, min(_value(trial), top))
            for place, trial in zip(places, trials)
            if is_complete(trial) is is_through
        ]
        if points:
            above = [cost >= top for _, cost in points]
            x, y = zip(*points)
            axes.scatter(
                x,
                y,
                s=20,
                marker=marker,
                zorder=3,
                clip_on=False,
                linewidths=1.0,
                color=[ALARM if is_above else face for is_above in above],
            )


def _dots() -> List[Any]:
    return [
        _line("", "completed all flights", marker="o", color=colour(0)),
        _line("", "pruned", marker="x", color=QUIET),
        _line("", "off the scale", marker="o", color=ALARM),
    ]


def _line(style: str, name: str, **more: Any) -> Any:
    return Line2D([], [], ls=style, label=name, **{"color": "black", "lw": 1.0, "ms": 5, **more})


def _value(trial: FrozenTrial) -> float:
    assert trial.value is not None  # every trial has flown at least one round
    return trial.value


def _top(trials: Sequence[FrozenTrial], reference: float) -> float:
    """Return the upper end of the axis; failures, hundreds of times as expensive, are beyond it."""
    costs = sorted([_value(trial) for trial in trials] + [reference])
    low = costs[0]
    usual = [cost for cost in costs if cost < 4.0 * low] or costs
    return low + _TOP * max(usual[-1] - low, 0.05 * low)


def _bottom(trials: Sequence[FrozenTrial], reference: float) -> float:
    low = min([_value(trial) for trial in trials] + [reference])
    return low - 0.08 * (_top(trials, reference) - low)


def _place(dimension: Dimension, value: Any) -> float:
    """Return the position of a value on the axis; choices are numbered."""
    if not dimension.choices:
        return float(value)
    return float(dimension.choices.index(value)) if value in dimension.choices else -0.5


def _scale(axes: Axes, dimension: Dimension) -> None:
    if dimension.log:
        axes.set_xscale("log")
        label_log(axes.xaxis)
    if dimension.choices:
        axes.set_xticks(range(len(dimension.choices)))
        axes.set_xticklabels(list(map(str, dimension.choices)))
    axes.tick_params(labelsize=7.5)


def _two_lines(path: str) -> Tuple[str, str]:
    above, _, name = path.rpartition("/")
    return above, name
