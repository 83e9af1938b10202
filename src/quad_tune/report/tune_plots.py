"""Interactive plots of a study: held-out flights in pairs, the search, and time against gap."""

from __future__ import annotations

from typing import Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np
from optuna.trial import FrozenTrial

from quad_nav.report.plot import ALARM, INK, QUIET, Json, Plot, axis, layout, plot_text, rgb
from quad_tune.flight_result import FlightResult
from quad_tune.report.outcome_pictures import Place, front, place
from quad_tune.report.search_pictures import cost_axis, is_off_scale
from quad_tune.search import is_complete
from quad_tune.statistics import FlightStatistics, mean_interval
from quad_tune.study_text import format_value
from quad_tune.tune import TuneResult

_Columns = Sequence[Sequence[Optional[float]]]

_SPREAD = 0.16  # half width of a column of flights
_SET = ("base", "tuned")


def held_out_plot(result: TuneResult) -> Plot:
    """Build the times and gaps of the held-out flights; a line joins a pair."""
    held_out = result.held_out
    sets = (held_out.base, held_out.tuned)
    times: _Columns = [[flight.time_s for flight in own] for own in sets]
    gaps: _Columns = [[flight.gap_m for flight in own] for own in sets]
    titles = ("Mission time (s)", "Min gap (m)")
    axes: Json = {}
    traces: List[Json] = []
    for k, values in enumerate((times, gaps)):
        suffix = ("", "2")[k]
        ticks = {"range": [-0.5, 1.5], "tickvals": [0, 1], "ticktext": list(_SET)}
        axes[f"xaxis{suffix}"] = axis("", domain=((0.0, 0.46), (0.54, 1.0))[k], **ticks)
        axes[f"yaxis{suffix}"] = axis(titles[k], rangemode="tozero", anchor=f"x{suffix}")
        traces += [
            {**trace, "xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}
            for trace in (_pair_lines(values), *_columns(result, values), *_means(values))
        ]
    return Plot(
        "held_out",
        "Times and gaps of the base and the tuned parameters",
        traces,
        layout(**axes, showlegend=False),
        height_px=400,
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
    bottom, top = cost_axis(trials, reference)
    traces = [
        _dots(trials, top, is_shown, name, marker)
        for is_shown, name, marker in (
            (lambda trial: is_complete(trial), "completed all flights", {"color": rgb(0)}),
            (lambda trial: not is_complete(trial), "pruned", {"color": QUIET, "symbol": "x"}),
        )
    ]
    costs = [
        np.inf if trial.value is None or not is_complete(trial) else trial.value for trial in trials
    ]
    best = [None if cost == np.inf else float(cost) for cost in np.minimum.accumulate(costs)]
    line = {"color": rgb(0), "width": 2, "shape": "hv"}
    x = [trial.number for trial in trials]
    traces.append(
        {"type": "scatter", "mode": "lines", "name": "best so far", "x": x, "y": best, "line": line}
    )
    base = {"color": INK, "width": 1.2, "dash": "dash"}
    ends = {"x": [x[0], x[-1]], "y": [reference] * 2}
    traces.append({"type": "scatter", "mode": "lines", "name": "base", **ends, "line": base})
    return Plot(
        "history",
        "Cost of each candidate",
        traces,
        layout(
            xaxis=axis("candidate"),
            yaxis=axis("mean cost", range=[bottom, top]),
            legend={"orientation": "h", "y": 1.12},
        ),
        height_px=400,
    )


def _dots(
    trials: Sequence[FrozenTrial],
    top: float,
    is_shown: Callable[[FrozenTrial], bool],
    name: str,
    marker: Json,
) -> Json:
    shown = [trial for trial in trials if is_shown(trial)]
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": [trial.number for trial in shown],
        "y": [min(trial.value or 0.0, top) for trial in shown],
        "marker": {
            "size": 9,
            **marker,
            "color": [ALARM if is_off_scale(trial, top) else marker["color"] for trial in shown],
        },
        "hovertext": [_trial_text(trial) for trial in shown],
        "hovertemplate": "%{hovertext}<extra></extra>",
    }


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
