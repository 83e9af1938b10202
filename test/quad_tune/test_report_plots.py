"""Plots of studies and sweeps: what they show, where their axes start, and the same on paper."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from types import SimpleNamespace

import matplotlib
import plotly.graph_objects
import pytest
from matplotlib.collections import LineCollection
from matplotlib.text import Text
from optuna.trial import TrialState, create_trial
from study_flights import FLOWN, PaperWorkers, tune_setup

from quad_nav.report.panels import paper_figure
from quad_nav.report.style import png, styled
from quad_tune.evaluation import StudyObserver
from quad_tune.flight_result import FlightResult
from quad_tune.proposals import distributions
from quad_tune.report.sweep_measures import (
    MEASURES,
    Estimate,
    axis_note,
    is_log,
    is_numeric,
    starts_at_zero,
)
from quad_tune.report.sweep_plot import sweep_plot
from quad_tune.report.tune_plots import (
    front,
    held_out_plot,
    history_plot,
    importance_plot,
    pareto_plot,
    slices_plot,
)
from quad_tune.space import Dimension, SearchSpace
from quad_tune.statistics import flight_statistics
from quad_tune.sweep import SweepRow
from quad_tune.tune import run_tune

pytestmark = pytest.mark.filterwarnings("error")


def checked(plot):
    """The figure as plotly's own classes read it; it can be drawn on paper too."""
    with styled():
        assert png(paper_figure(plot)).startswith(b"\x89PNG")
    figure = json.loads(plot.json)
    return plotly.graph_objects.Figure({"data": figure["data"], "layout": figure["layout"]})


def panels(plot):
    """Axes by their titles, of a figure that was drawn on paper."""
    with styled():
        figure = paper_figure(plot)
        png(figure)
    return {axes.get_title(loc="left"): axes for axes in figure.axes}


# Sweeps.


def flown(time_s: float, gap_m: float, reached: int = 2, contacts: int = 0) -> FlightResult:
    return FlightResult(2, reached, contacts, time_s, 6.0, clearance_m=gap_m)


def luma(rgb):
    return sum(weight * part for weight, part in zip((0.299, 0.587, 0.114), rgb))


def test_map_over_two_parameters():
    """With b = 2 a third of the flights fails where a = 1, and all where a = 2."""
    flights = {
        (1, 1): (flown(20.0, 0.3), flown(21.0, 0.126)),
        (2, 1): (flown(10.0, 0.05), flown(11.0, 0.2)),
        (1, 2): (flown(30.0, 0.2), flown(32.0, 0.2), flown(50.0, 0.2, 1, contacts=1)),
        (2, 2): (flown(60.0, 0.004, 0, contacts=2),),
    }
    pairs = itertools.product((1, 2), repeat=2)
    shown = panels(sweep_plot([SweepRow({"a": a, "b": b}, flights[a, b]) for a, b in pairs]))
    numbers = {
        title: [text.get_text().split("\n")[0] for text in axes.texts]
        for title, axes in shown.items()
    }
    assert numbers == {
        "Completed missions (%)": ["100", "67", "100", "0"],
        "Flights with contacts (%)": ["0", "33", "0", "100"],
        "Mean mission time (s)": ["20.5", "31.0", "10.5", "–"],
        "Min gap (m)": ["0.13", "0.20", "0.05", "0.00"],
        "Roughness (m/s²)": ["0.00"] * 4,
        # (1, 2): 30, 32 and 50 s over 6 m, 1/3 for each gap, 7500 for a goal, 50 for a contact.
        "Cost": ["3.71", "2523.22", "2.33", "10085.99"],
    }
    for axes in shown.values():
        (image,) = axes.images
        for text, cell in zip(axes.texts, image.to_rgba(image.get_array()).reshape(-1, 4)):
            paper = 0.8 * luma(cell[:3]) + 0.2 if cell[3] else 1.0
            assert abs(paper - luma(matplotlib.colors.to_rgb(text.get_color()))) > 0.2


def test_curve_over_one_parameter():
    """Means as a line with intervals, every flight that arrived as a dot, and axes from 0."""
    rows = [
        SweepRow({"a": 0.5}, (flown(20.0, 0.3), flown(22.0, 0.1))),
        SweepRow({"a": 2.0}, (flown(10.0, 0.2), flown(90.0, 0.2, 1))),
    ]
    plot = sweep_plot(rows)
    dots, curve = [trace for trace in plot.traces if trace["yaxis"] == "y3"]  # the mean time
    assert (dots["x"], dots["y"]) == ([0.5, 0.5, 2.0], [20.0, 22.0, 10.0])
    assert (curve["mode"], curve["y"]) == ("lines+markers", [21.0, 10.0])
    assert curve["hovertext"][0] == "a: 0.5<br><b>21.0 (95 %: 20.0 to 22.0), 2 flights</b>"
    shown = panels(plot)
    drawn = shown["Mean mission time (s)"].collections
    (bars,) = [one for one in drawn if isinstance(one, LineCollection)]
    assert [bar.tolist() for bar in bars.get_segments()] == [  # one flight has no interval
        [[0.5, 20.0], [0.5, 22.0]],
        [[2.0, 10.0], [2.0, 10.0]],
    ]
    for panel in shown.values():
        assert panel.get_ylim()[0] == 0.0 and panel.get_xlim()[0] == 0.0


def test_axes_of_parameters_that_do_not_start_at_zero():
    assert not starts_at_zero([5.0, 6.0]) and starts_at_zero([0.2, 0.6])
    assert is_log([0.001, 0.1]) and not is_log([0.0, 1.0]) and not is_log([0.1, 1.0])
    assert axis_note("a", [0.001, 0.1]) == "The horizontal axis of a is logarithmic."
    assert axis_note("a", [5.0, 6.0]) == "The axis of a does not start at 0."
    assert axis_note("a", [0.2, 0.6]) == ""
    assert not is_numeric([True, False]) and not is_numeric(["a"]) and is_numeric([1, 2.5])


@pytest.mark.parametrize(
    "points, labels",
    [
        ([{"a": "p/Trajectory"}, {"a": "p/DWA"}], ["Trajectory", "DWA"]),
        ([{"a": True}, {"a": False}], ["true", "false"]),
        ([{"a": 1, "b": "<x>"}, {"a": 2, "b": "y"}], ["1, <x>", "2, y"]),
    ],
)
def test_values_without_order_are_bars_from_zero(points, labels):
    plot = sweep_plot([SweepRow(one, (flown(20.0, 0.3), flown(22.0, 0.1))) for one in points])
    assert all(trace["type"] == "bar" for trace in plot.traces) and "<x>" not in plot.json
    shown = panels(plot)
    bars = shown["Mean mission time (s)"].patches
    assert [(bar.get_x(), bar.get_width()) for bar in bars] == [(0.0, 21.0)] * 2
    texts = shown["Completed missions (%)"].get_yticklabels()  # the leftmost has them for all
    assert [text.get_text() for text in texts] == labels
    titles = [note["text"] for note in plot.layout["annotations"]]
    assert titles == [f"<b>{measure.title}</b>" for measure in MEASURES]
    assert all(trace.base is None for trace in checked(plot).data)


def test_shares_have_wilsons_interval_and_means_the_bootstraps():
    """4 of 4: Wilson's lower end is 1 / (1 + 1.96^2 / 4) = 51 %."""
    flights = tuple(flown(time_s, 0.2) for time_s in (20.0, 21.0, 22.0, 23.0))
    found = {measure.title: measure.estimate(flights) for measure in MEASURES}
    share = found["Completed missions (%)"]
    assert (share.flights, share.value, share.high) == (4, 100.0, pytest.approx(100.0))
    assert share.low == pytest.approx(51.0, abs=0.05)
    assert found["Mean mission time (s)"] == (4, 21.5, 20.0, 23.0)  # the tails reach both ends
    assert found["Min gap (m)"] == (4, 0.2, None, None)
    assert found["Mean mission time (s)"].text(1) == "21.5 (95 %: 20.0 to 23.0), 4 flights"
    assert Estimate(0).text(1) == "unknown, 0 flights"


# Studies.


def by_speed(task):
    """Faster with a higher speed; every third seed of the base has a contact."""
    speed = task.setup.configurations[0].to_tree()["TrajectoryPlannerROS"]["max_vel_x"]
    contacts = int(speed == 0.3 and task.setup.seed % 3 == 2)
    return replace(FLOWN, time_s=60.0 - 20.0 * speed, contacts=contacts)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """A study on paper."""
    folder = tmp_path_factory.mktemp("study")
    setup = tune_setup(folder, folder / "out", candidates=6, held_out=3)
    return run_tune(setup, PaperWorkers(by_speed), StudyObserver())


def test_held_out_flights_in_pairs_with_means(result):
    figure = checked(held_out_plot(result))
    assert figure.layout.yaxis.rangemode == figure.layout.yaxis2.rangemode == "tozero"
    lines, base, tuned, mean, *_ = figure.data
    assert [value for value in lines.y if value is not None] == [
        value for pair in zip(base.y, tuned.y) for value in pair
    ]
    assert base.y == (54.0,) * 3 and max(tuned.y) < 54.0
    assert base.marker.symbol.count("x") == 1  # of three seeds in a row, one has a contact
    assert "seed 1000000<br>2 of 2 goals, 54.0 s, gap 0.50 m, 0 contacts" in base.hovertext[0]
    assert (mean.y[0], mean.error_y.array, mean.error_y.arrayminus) == (54.0, (0.0,), (0.0,))


def test_history_of_the_search(result):
    figure = checked(history_plot(result, 5.5))
    complete, pruned, best, base = figure.data
    assert len(complete.x) + len(pruned.x) == len(result.trials) == 6
    assert best.y[-1] == min(trial.value for trial in result.trials)
    assert base.y == (5.5, 5.5)
    assert "TrajectoryPlannerROS/max_vel_x: 0.3" in complete.hovertext[0]
    low, high = figure.layout.yaxis.range
    assert low < min(complete.y) and max(complete.y) <= high


def test_time_against_gap_of_candidates_without_failures():
    good = flight_statistics([FLOWN])
    slow = flight_statistics([replace(FLOWN, time_s=50.0, clearance_m=0.2)])
    failed = flight_statistics([replace(FLOWN, reached=0)])
    figure = checked(pareto_plot({0: good, 3: slow, 4: failed}, slow, good))
    edge, candidates, base, tuned = figure.data
    assert (edge.x, edge.y) == ((40.0,), (0.5,))
    assert candidates.text == ("candidate 0", "candidate 3")
    assert (base.x, tuned.x) == ((50.0,), (40.0,))
    without = checked(pareto_plot({4: failed}, failed, good))
    assert [trace.name for trace in without.data] == ["front", "candidate", "tuned"]


def test_the_front_holds_what_nothing_beats_in_both():
    places = [(3.0, 0.3), (1.0, 0.1), (2.0, 0.05), (4.0, 0.3), (2.5, 0.2), (1.0, 0.05)]
    assert front(places) == [(1.0, 0.1), (2.5, 0.2), (3.0, 0.3)]
    assert front([]) == []


SPACE = SearchSpace(
    "by hand",
    (
        Dimension("a/weight", 0.0003, 0.03, log=True),
        Dimension("*_costmap/scale", 1.0, 20.0, log=True),
        Dimension("a/speed", 0.2, 0.6),
        Dimension("rate", choices=(5.0, 10.0)),
    ),
)


def trial(number: int, cost: float, *values: float, state: TrialState = TrialState.COMPLETE):
    made = create_trial(
        state=state,
        value=cost,
        params=dict(zip(SPACE.paths, values)),
        distributions=distributions(SPACE),
        intermediate_values={1: cost} if state is TrialState.PRUNED else None,
    )
    made.number = number
    return made


def test_values_of_a_search_and_what_is_written_beside_them():
    trials = (
        trial(0, 5.0, 0.001, 4.0, 0.3, 10.0),
        trial(1, 9000.0, 0.0004, 18.0, 0.5, 5.0),
        trial(2, 4.0, 0.02, 1.5, 0.4, 10.0),
        trial(3, 6.0, 0.003, 9.0, 0.25, 5.0, state=TrialState.PRUNED),
    )
    base = {"a/weight": 0.001, "*_costmap/scale": 4.0, "a/speed": 0.3, "rate": 10.0}
    made = SimpleNamespace(
        trials=trials,
        setup=SimpleNamespace(space=SPACE, base=base),
        refined=SimpleNamespace(values={"a/weight": 0.02}),
    )
    figure = checked(slices_plot(made, SPACE.paths, 5.0))
    complete, pruned, before, after = figure.data[:4]
    assert (complete.x, pruned.x) == ((0.001, 0.0004, 0.02), (0.003,))
    assert before.x == (0.001, 0.001) and after.x == (0.02, 0.02)
    assert complete.marker.color[1] == "#c01020"  # off the scale
    assert figure.data[-1].x == (1.0, 1.0)  # the second choice is the base's
    drawn = []
    with styled():
        for plot in (history_plot(made, 5.0), slices_plot(made, SPACE.paths, 5.0)):
            paper = paper_figure(plot)
            png(paper)
            drawn += [text.get_text() for text in paper.findobj(Text) if text.get_visible()]
    assert {"0.001", "0.01", "10", "tuned"} <= set(drawn)
    assert [text for text in drawn if "$" in text] == []


def test_importances_are_bars():
    figure = checked(importance_plot({"a/weight": 0.7, "a/speed": 0.3}))
    assert figure.data[0].x == (0.7, 0.3)
    assert figure.layout.yaxis.ticktext == ("a/weight", "a/speed")
