"""Time that many flights take: what is said at the start, and how it is refined."""

from __future__ import annotations

import pytest
from click.testing import CliRunner
from small_mission import write_mission
from study_flights import FLOWN, PaperWorkers, tune_setup, without_flying

from quad_nav.cli.progress import FlightPace, duration_text, processes_text
from quad_tune.cli.flights_bar import FlightsBar
from quad_tune.cli.sweep import sweep
from quad_tune.evaluation import StudyObserver
from quad_tune.tune import run_tune


class Clock:
    """A clock that the test advances."""

    def __init__(self):
        self.now_s = 100.0

    def __call__(self):
        return self.now_s


def pace(processes, *times_s):
    """The pace after flights that ended at these times after the start."""
    clock = Clock()
    found = FlightPace(processes, clock)
    for time_s in times_s:
        clock.now_s = 100.0 + time_s
        found.on_flight()
    return found


def test_the_first_flight_of_each_process_does_not_count():
    """Processes that need 5 s to start, and flights of 2 s."""
    found = pace(2, 7.0, 7.0, 9.0, 9.0, 11.0, 11.0)
    assert found.flight_s == pytest.approx(2.0)
    assert found.left_text(840) == "about 14 minutes"  # 840 x 2 s / 2 processes
    assert found.estimate(840) == "2.0 s per flight; 840 left, about 14 minutes"
    assert found.per_minute == pytest.approx(6 * 60.0 / 11.0)


def test_an_estimate_needs_two_flights_of_each_process_or_ten_seconds():
    assert pace(2).flight_s is None and not pace(2).is_known
    assert not pace(2, 7.0, 7.0, 9.0).is_known
    assert pace(2, 7.0, 7.0, 9.0, 9.0).is_known
    assert not pace(2, 9.9).is_known
    assert pace(2, 30.0).is_known and pace(2, 30.0).flight_s == 30.0


@pytest.mark.parametrize(
    "seconds, words",
    [
        (45.4, "about 45 seconds"),
        (150.0, "about 2.5 minutes"),
        (840.0, "about 14 minutes"),
        (7300.0, "about 2.0 hours"),
    ],
)
def test_durations(seconds, words):
    assert duration_text(seconds) == words


def test_the_estimate_is_printed_once_and_leaves_stored_flights_out(capsys):
    bar = FlightsBar("tune", 1, False)
    bar.on_stored(3)
    bar.on_remaining(20)
    for _ in range(2):
        bar.on_flight(FLOWN, True)
    for _ in range(4):
        bar.on_flight(FLOWN, False)
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["tune: 0.0 s per flight; 15 left, about 1 second"]  # 20 - 3 stored - 2
    assert bar.left == 13
    bar.on_remaining(5)  # candidates were pruned
    assert bar.left == 4  # one of them is stored


class Planned(StudyObserver):
    """Records the estimates of a study beside the flights that it flies."""

    def __init__(self):
        self.done, self.totals = 0, []

    def on_remaining(self, flights):
        self.totals.append(self.done + flights)

    def on_flight(self, flight, cached):
        self.done += 1


def test_the_plan_of_a_study_ends_at_its_flights(tmp_path):
    setup = tune_setup(tmp_path, tmp_path / "out", candidates=5)
    observer = Planned()
    run_tune(setup, PaperWorkers(), observer)
    # Base 2, 5 candidates of 2, 3 changes alone 3 x 2, without all 2, gains 3 x 2, held out 2.
    assert observer.totals[0] == setup.planned_flights == 28
    assert observer.totals[-1] == observer.done
    assert observer.totals == sorted(observer.totals, reverse=True)


def test_a_sweep_says_how_many_flights_it_flies(tmp_path, monkeypatch):
    without_flying(monkeypatch, "sweep_flights")
    mission = write_mission(tmp_path)
    over = ["--over", "TrajectoryPlannerROS/max_vel_x=0.3,0.4", "--flights", "4"]
    files = ["--scene", str(mission.scene), "--goals", str(mission.goals)]
    done = CliRunner().invoke(sweep, [*over, *files])
    assert done.exit_code == 0, done.output
    assert "sweep: 2 points x 4 flights = 8 flights on 1 process\n" in done.output
    assert "sweep: 0.0 s per flight; 6 left, about 1 second\n" in done.output
    assert processes_text(2) == "2 processes"
