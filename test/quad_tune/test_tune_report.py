"""Plots of a study's report: what they show, and where their axes start."""

from __future__ import annotations

import json
from dataclasses import replace

import plotly.graph_objects
import pytest
from study_flights import FLOWN, PaperWorkers, tune_setup

from quad_tune.evaluation import StudyObserver
from quad_tune.report.tune_plots import held_out_plot, history_plot, pareto_plot
from quad_tune.statistics import flight_statistics
from quad_tune.tune import run_tune


def flown(task):
    """Faster with a higher speed; every third seed of the base has a contact."""
    speed = task.setup.configurations[0].to_tree()["TrajectoryPlannerROS"]["max_vel_x"]
    contacts = int(speed == 0.3 and task.setup.seed % 3 == 2)
    return replace(FLOWN, time_s=60.0 - 20.0 * speed, contacts=contacts)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """A study on paper."""
    folder = tmp_path_factory.mktemp("study")
    setup = tune_setup(folder, folder / "out", candidates=6, held_out=3)
    return run_tune(setup, PaperWorkers(flown), StudyObserver())


def checked(plot):
    """The figure as plotly's own classes read it."""
    figure = json.loads(plot.json)
    return plotly.graph_objects.Figure({"data": figure["data"], "layout": figure["layout"]})


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
    front, candidates, base, tuned = figure.data
    assert (front.x, front.y) == ((40.0,), (0.5,))
    assert candidates.text == ("candidate 0", "candidate 3")
    assert (base.x, tuned.x) == ((50.0,), (40.0,))
    without = checked(pareto_plot({4: failed}, failed, good))
    assert [trace.name for trace in without.data] == ["front", "candidate", "tuned"]
