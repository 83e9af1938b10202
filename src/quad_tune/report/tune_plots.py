"""Plots of a study: held-out flights in pairs, the search, and time against gap."""

from __future__ import annotations

import warnings
from typing import Any, Dict, List, Mapping, Optional, Sequence, Set, Tuple

import numpy as np
import optuna
from optuna.trial import FrozenTrial

from quad_nav.report.panels import Panel, panel_plot
from quad_nav.report.plot import ALARM, INK, QUIET, Json, Plot, axis, layout, plot_text, rgb
from quad_tune.flight_result import FlightResult
from quad_tune.search import is_complete
from quad_tune.space import Dimension, SearchSpace
from quad_tune.statistics import FlightStatistics, mean_interval
from quad_tune.study_text import format_value
from quad_tune.tune import TuneResult

_Columns = Sequence[Sequence[Optional[float]]]

_SPREAD = 0.16  # half width of a column of flights
_SET = ("base", "tuned")
_LEAST_FOR_IMPORTANCES = 20
_TOP = 1.15  # upper end of the axis of costs, in parts of the usual range
_SLICE_COLUMNS = 3
Place = Tuple[float, float]
"""Mean time in seconds, smallest gap in metres."""


def place(statistics: FlightStatistics) -> Optional[Place]:
    """Return (mean time, min gap); None if no mission was completed or nothing was near."""
    if statistics.mean_time_s is None or statistics.least_gap_m is None:
        return None
    return statistics.mean_time_s, statistics.least_gap_m


def front(places: Sequence[Place]) -> List[Place]:
    """Return the places that no other place beats in both time and gap, by time."""
    kept: List[Place] = []
    for time_s, gap_m in sorted(places, key=lambda point: (point[0], -point[1])):
        if not kept or gap_m > kept[-1][1]:
            kept.append((time_s, gap_m))
    return kept


def held_out_plot(result: TuneResult) -> Plot:
    """Build the times and gaps of the held-out flights; a line joins a pair."""
    sets = (result.held_out.base, result.held_out.tuned)
    times: _Columns = [[flight.time_s for flight in own] for own in sets]
    gaps: _Columns = [[flight.gap_m for flight in own] for own in sets]
    x = axis("", range=[-0.5, 1.5], tickvals=[0, 1], ticktext=list(_SET), showgrid=False)
    panels = [
        Panel(
            title,
            [_pair_lines(values), *_columns(result, values), *_means(values)],
            x,
            axis("", rangemode="tozero"),
        )
        for title, values in (("Mission time (s)", times), ("Min gap (m)", gaps))
    ]
    return panel_plot(
        "held_out", "Times and gaps of the base and the tuned parameters", panels, 2, 300
    )


def _places(count: int) -> List[float]:
    return np.linspace(-_SPREAD, _SPREAD, count).tolist() if count > 1 else [0.0]


def _pair_lines(values: _Columns) -> Json:
    x: List[Optional[float]] = []
    y: List[Optional[float]] = []
    for shift, before, after in zip(_places(len(values[0])), *values):
        x += [shift, 1.0 + shift, None]
        y += [before, after, None]
    line = {"color": QUIET, "width": 0.7}
    return {"type": "scatter", "mode": "lines", "x": x, "y": y, "line": line, "hoverinfo": "skip"}


def _columns(result: TuneResult, values: _Columns) -> List[Json]:
    """Return the flights of base and tuned parameters."""
    held_out = result.held_out
    return [
        {
            "type": "scatter",
            "mode": "markers",
            "x": [column + shift for shift in _places(len(flights))],
            "y": list(values[column]),
            "marker": {
                "size": [8 if flight.succeeded else 11 for flight in flights],
                "symbol": ["circle" if flight.succeeded else "x" for flight in flights],
                "color": [rgb(0) if flight.succeeded else ALARM for flight in flights],
            },
            "hovertext": [
                f"{name}, {plot_text(case.name)}, seed {case.seed}<br>{_flight_text(flight)}"
                for case, flight in zip(held_out.cases, flights)
            ],
            "hovertemplate": "%{hovertext}<extra></extra>",
        }
        for column, (name, flights) in enumerate(zip(_SET, (held_out.base, held_out.tuned)))
    ]


def _flight_text(flight: FlightResult) -> str:
    gap = "none near" if flight.gap_m is None else f"{flight.gap_m:.2f} m"
    return (
        f"{flight.reached} of {flight.goals} goals, {flight.time_s:.1f} s, gap {gap}, "
        f"{flight.contacts} contacts{plot_text(f', {flight.reason}' if flight.reason else '')}"
    )


def _means(values: _Columns) -> List[Json]:
    """Return the mean of each column with its 95 % interval."""
    found: List[Json] = []
    for column, own in enumerate(values):
        known = [value for value in own if value is not None]
        if not known:
            continue
        mean = sum(known) / len(known)
        low, high = mean_interval(known) or (mean, mean)
        found.append(
            {
                "type": "scatter",
                "mode": "markers",
                "x": [column + 0.28],
                "y": [mean],
                "error_y": {"symmetric": False, "array": [high - mean], "arrayminus": [mean - low]},
                "marker": {"symbol": "line-ew-open", "size": 16, "color": INK},
                "hovertemplate": f"mean of {len(known)} flights: {mean:.2f} (95 %: {low:.2f} to "
                f"{high:.2f})<extra></extra>",
            }
        )
    return found


def history_plot(result: TuneResult, reference: float) -> Plot:
    """Build the cost of each candidate in order, the best so far, and the base's."""
    trials = result.trials
    numbers = [trial.number for trial in trials]
    costs = [_value(trial) if is_complete(trial) else np.inf for trial in trials]
    best = [None if cost == np.inf else float(cost) for cost in np.minimum.accumulate(costs)]
    ends = {"x": [numbers[0], numbers[-1]], "y": [reference] * 2}
    traces = [
        *_costs(trials, numbers, reference),
        _line("best so far", {"x": numbers, "y": best}, rgb(0), shape="hv"),
        _line("base", ends, INK, dash="dash"),
    ]
    style = layout(
        xaxis=axis("candidate"),
        yaxis=axis("mean cost", range=cost_axis(trials, reference)),
        legend={"orientation": "h", "y": 1.12},
    )
    return Plot("history", "Cost of each candidate", traces, style, height_px=400)


def _line(name: str, points: Json, ink: str, **style: str) -> Json:
    line = {"color": ink, "width": 1.6, **style}
    return {"type": "scatter", "mode": "lines", "name": name, **points, "line": line}


def _costs(trials: Sequence[FrozenTrial], x: Sequence[float], reference: float) -> List[Json]:
    """Return the costs over some values; costs beyond the axis are drawn at its upper end."""
    _, top = cost_axis(trials, reference)
    traces = []
    for is_through, name, ink, symbol in (
        (True, "completed all flights", rgb(0), "circle"),
        (False, "pruned", QUIET, "x"),
    ):
        shown = [(trial, at) for trial, at in zip(trials, x) if is_complete(trial) is is_through]
        colours = [ALARM if _value(trial) >= top else ink for trial, _ in shown]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": name,
                "x": [at for _, at in shown],
                "y": [min(_value(trial), top) for trial, _ in shown],
                "marker": {"size": 9, "symbol": symbol, "color": colours},
                "hovertext": [_trial_text(trial) for trial, _ in shown],
                "hovertemplate": "%{hovertext}<extra></extra>",
            }
        )
    return traces


def cost_axis(trials: Sequence[FrozenTrial], reference: float) -> List[float]:
    """Return the ends of the axis of costs, which does not start at 0.

    Failures, hundreds of times as expensive, are beyond its upper end.
    """
    costs = sorted([_value(trial) for trial in trials] + [reference])
    low = costs[0]
    usual = [cost for cost in costs if cost < 4.0 * low] or costs
    top = low + _TOP * max(usual[-1] - low, 0.05 * low)
    return [low - 0.08 * (top - low), top]


def _value(trial: FrozenTrial) -> float:
    assert trial.value is not None  # every trial has flown at least one round
    return trial.value


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


def importance_plot(found: Mapping[str, float]) -> Plot:
    """Build a bar for each parameter."""
    names = list(found)
    rows = list(range(len(names)))
    trace = {
        "type": "bar",
        "orientation": "h",
        "y": rows,
        "x": list(found.values()),
        "width": 0.65,
        "marker": {"color": rgb(0)},
        "hovertemplate": "%{x:.2f}<extra></extra>",
    }
    texts = [plot_text(name) for name in names]
    y = axis("", range=[len(names) - 0.4, -0.6], tickvals=rows, ticktext=texts, showgrid=False)
    style = layout(xaxis=axis("importance"), yaxis=y, showlegend=False)
    height_px = 90 + 24 * len(names)
    return Plot("importances", "Importance of each parameter", [trace], style, height_px=height_px)


def slices_plot(result: TuneResult, order: Sequence[str], reference: float) -> Plot:
    """Build the cost of each candidate over the value of each parameter.

    Args:
        result: The study.
        order: Paths of the parameters, most important first.
        reference: Cost of the base.
    """
    trials, by_path = result.trials, {one.path: one for one in result.setup.space.dimensions}
    ends = cost_axis(trials, reference)
    panels: List[Panel] = []
    named: Set[str] = set()  # a value that only some panels have is named by the first of them
    for path in order:
        dimension = by_path[path]
        places = [_place(dimension, trial.params[path]) for trial in trials]
        lines = [
            _line(name, {"x": [_place(dimension, value)] * 2, "y": ends}, INK, dash=dash)
            for name, values, dash in (
                ("base", result.setup.base, "dash"),
                ("tuned", result.refined.values, "solid"),
            )
            for value in (values.get(path),)
            if value is not None
        ]
        traces = [*_costs(trials, places, reference), *lines]
        traces = [
            {**one, "legendgroup": one["name"], "showlegend": one["name"] not in named}
            for one in traces
        ]
        named.update(one["name"] for one in traces)
        title = "<br>".join(map(plot_text, path.rsplit("/", 1)))
        panels.append(Panel(title, traces, _value_axis(dimension), axis("", range=ends)))
    name = "Cost over the values of each parameter"
    return panel_plot("slices", name, panels, _SLICE_COLUMNS, 170, legend=True)


def _place(dimension: Dimension, value: Any) -> float:
    """Return the position of a value on the axis; choices are numbered."""
    if not dimension.choices:
        return float(value)
    return float(dimension.choices.index(value)) if value in dimension.choices else -0.5


def _value_axis(dimension: Dimension) -> Json:
    if dimension.choices:
        texts = [plot_text(format_value(one)) for one in dimension.choices]
        return axis("", tickvals=list(range(len(texts))), ticktext=texts)
    return axis("", type="log" if dimension.log else "linear")


def _trial_text(trial: FrozenTrial) -> str:
    flights = max(trial.intermediate_values, default=0)
    lines = [f"<b>candidate {trial.number}</b>: cost {trial.value:.3f}, {flights} flights"]
    values = trial.params.items()
    lines += [f"{plot_text(path)}: {plot_text(format_value(value))}" for path, value in values]
    return "<br>".join(lines)


def pareto_plot(
    candidates: Dict[int, FlightStatistics], base: FlightStatistics, tuned: FlightStatistics
) -> Plot:
    """Build mean time against smallest gap, of candidates without a failed flight.

    ``candidates`` holds statistics by the number of the candidate.
    """
    clean: List[Tuple[int, Place]] = [
        (number, found)
        for number, own in candidates.items()
        for found in (place(own),)
        if found is not None and own.succeeded == own.flights
    ]
    edge = front([found for _, found in clean])
    traces: List[Json] = [
        _places_trace("front", edge, {"size": 16, "symbol": "circle-open", "color": QUIET}, []),
        _places_trace(
            "candidate",
            [found for _, found in clean],
            {"size": 9, "color": rgb(0)},
            [f"candidate {number}" for number, _ in clean],
        ),
    ]
    for name, own, symbol, ink in (("base", base, "square", INK), ("tuned", tuned, "star", ALARM)):
        found = place(own)
        if found is not None:
            marker = {"size": 14, "symbol": symbol, "color": ink}
            traces.append(_places_trace(name, [found], marker, [name]))
    return Plot(
        "pareto",
        "Mean time and smallest gap of candidates",
        traces,
        layout(
            xaxis=axis("mean mission time (s)"),
            yaxis=axis("min gap (m)", rangemode="tozero"),
            legend={"orientation": "h", "y": 1.12},
        ),
        height_px=400,
    )


def _places_trace(name: str, places: Sequence[Place], marker: Json, names: Sequence[str]) -> Json:
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": [time_s for time_s, _ in places],
        "y": [gap_m for _, gap_m in places],
        "marker": marker,
        "text": list(names),
        "hovertemplate": "%{text}<br>%{x:.1f} s, %{y:.2f} m<extra></extra>",
    }
