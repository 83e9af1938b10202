"""A disk that is full, or a file that another program locks, while studies and sweeps fly."""

from __future__ import annotations

import sqlite3
from contextlib import closing

import pytest
from click.testing import CliRunner
from small_mission import write_mission
from study_flights import (
    FLOWN,
    SPACE,
    PaperWorkers,
    trials_as_data,
    tune_setup,
    without_flying,
)
from test_outputs import FULL, assert_output_is_checked_first, full_disk, run  # noqa: F401

from quad_nav.errors import InputError
from quad_tune.cli.sweep import sweep
from quad_tune.cli.tune import tune
from quad_tune.evaluation import StudyObserver
from quad_tune.flight_cache import FlightCache
from quad_tune.study import open_study
from quad_tune.study_database import NotStored
from quad_tune.tune import StudyStopped, run_tune


def fill_disk(monkeypatch, pages):
    """Let no database of this process have more pages, as on a full disk."""
    connect = sqlite3.connect

    def connect_with_limit(*args, **kwargs):
        database = connect(*args, **kwargs)
        database.execute(f"PRAGMA max_page_count = {pages}")
        return database

    monkeypatch.setattr(sqlite3, "connect", connect_with_limit)
    monkeypatch.setattr(sqlite3.dbapi2, "connect", connect_with_limit)


def pages(path):
    """The number of pages of a database."""
    with closing(sqlite3.connect(path)) as database:
        return database.execute("PRAGMA page_count").fetchone()[0]


def new_study(folder):
    """The set-up and the file of a study without flights."""
    setup = tune_setup(folder, folder / "out", candidates=24)
    with open_study(setup.options.output, setup.identity, setup.space):
        pass
    return setup, folder / "out" / "study.db"


@pytest.mark.slow
@pytest.mark.parametrize("free_pages", [0, 3])
def test_a_study_stops_with_its_best_on_a_full_disk_and_resumes(tmp_path, monkeypatch, free_pages):
    setup, path = new_study(tmp_path)
    with monkeypatch.context() as patch:
        fill_disk(patch, pages(path) + free_pages)
        with pytest.raises(StudyStopped) as raised:
            run_tune(setup, PaperWorkers(), StudyObserver())
    first, best, *_ = str(raised.value).split("\n")
    assert first.startswith(f"study stopped: {path}: cannot store a ")
    assert "database or disk is full; expected free disk space for the file" in first
    assert best.startswith(("best so far: candidate ", "no best candidate yet: 0 of "))
    stored = len(FlightCache(path))
    workers = PaperWorkers()
    resumed = run_tune(setup, workers, StudyObserver())
    once = PaperWorkers()
    whole = run_tune(tune_setup(tmp_path, tmp_path / "whole", 24), once, StudyObserver())
    assert trials_as_data(resumed.trials) == trials_as_data(whole.trials)
    assert workers.flown + stored == once.flown


def tune_command(folder):
    """Arguments of a study of 24 candidates."""
    mission = write_mission(folder)
    (folder / "space.yaml").write_text(SPACE)
    files = ["--scene", str(mission.scene), "--goals", str(mission.goals)]
    search = ["--candidates", "24", "--flights", "2", "--space", str(folder / "space.yaml")]
    search += ["--free-speed"]
    return [*files, *search, "--output", str(folder / "out")]


def test_the_command_prints_the_best_and_ends_with_status_1(tmp_path, monkeypatch):
    without_flying(monkeypatch, "tune_study")
    fill_disk(monkeypatch, 40)
    done = CliRunner().invoke(tune, tune_command(tmp_path))
    assert done.exit_code == 1, done.output
    assert done.exception is None or isinstance(done.exception, SystemExit)
    assert "study.db: cannot store a" in done.output and "disk is full" in done.output
    assert "best so far: candidate 0 of" in done.output
    assert "TrajectoryPlannerROS/max_vel_x: 0.3" in done.output


def test_the_command_refuses_a_disk_that_is_full_already(tmp_path, monkeypatch):
    without_flying(monkeypatch, "tune_study")
    for most in (1, 2, 10):
        with monkeypatch.context() as patch:
            fill_disk(patch, most)
            done = CliRunner().invoke(tune, tune_command(tmp_path / str(most)))
        assert done.exit_code == 2, done.output
        assert "study.db: " in done.output and "full; expected free disk space" in done.output


def test_a_sweep_flies_on_without_storing(tmp_path, monkeypatch):
    without_flying(monkeypatch, "sweep_flights")
    mission, path = write_mission(tmp_path), tmp_path / "flights.db"
    arguments = ["--scene", str(mission.scene), "--goals", str(mission.goals), "--flights", "30"]
    arguments += ["--over", "TrajectoryPlannerROS/max_vel_x=0.3,0.4", "--cache", str(path)]
    with monkeypatch.context() as patch:
        fill_disk(patch, 5)
        done = CliRunner().invoke(sweep, arguments)
    assert done.exit_code == 1, done.output
    assert done.output.count("the sweep continues without storing its flights") == 1
    assert f"{path}: cannot store a flight: database or disk is full" in done.output
    rows = [line.split() for line in done.output.splitlines()]
    assert [row[:3] for row in rows if row[:1] in (["0.3"], ["0.4"])] == [
        ["0.3", "30", "100"],
        ["0.4", "30", "100"],
    ]
    assert 0 < len(FlightCache(path)) < 60


def test_a_flight_that_cannot_be_stored_stays_in_memory(tmp_path, monkeypatch):
    monkeypatch.setattr("quad_tune.flight_cache._TIMEOUT_S", 0.0)
    cache, key = FlightCache(tmp_path / "f.db"), ("{}", "m", 0)
    with closing(sqlite3.connect(tmp_path / "f.db", isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        with pytest.raises(NotStored, match="locked; expected that no other program uses"):
            cache.add(key, FLOWN)
    assert (cache[key], cache.is_broken) == (FLOWN, True)
    with pytest.raises(InputError, match="that can be written"):
        FlightCache(tmp_path / "nowhere" / "f.db")


@pytest.mark.parametrize(
    "command, option",
    [("sweep --over TrajectoryPlannerROS/max_vel_x=0.3", "--pictures"), ("tune", "--output")],
)
def test_every_output_is_checked_first(tmp_path, command, option):
    assert_output_is_checked_first(tmp_path, command, option, "x")


def test_a_sweep_prints_what_it_cannot_write(tmp_path, monkeypatch, full_disk):  # noqa: F811
    without_flying(monkeypatch, "sweep_flights")
    mission = write_mission(tmp_path / "mission")
    over = ("--over", "TrajectoryPlannerROS/max_vel_x=0.3,0.4", "--flights", "2")
    files = [("--json", "x.json"), ("--csv", "x.csv"), ("--report", "x.html"), ("--pictures", "x")]
    given = [word for option, name in files for word in (option, tmp_path / name)]
    done = run("sweep", "--scene", mission.scene, "--goals", mission.goals, "-q", *over, *given)
    assert done.exit_code == 1
    for option, name in files:
        assert f"{option}: {tmp_path / name}: cannot be written: {FULL}; " in done.output
    assert '"figures": {' in done.output
    assert "TrajectoryPlannerROS/max_vel_x,flights," in done.output
    assert [path for path in tmp_path.rglob("*") if path.suffix in (".partial", ".html")] == []


def test_a_study_prints_what_it_cannot_write(tmp_path, monkeypatch, full_disk):  # noqa: F811
    without_flying(monkeypatch, "tune_study")
    out = tmp_path / "out"
    few = ["--candidates", "--flights", "--finalists", "--final-flights", "--held-out"]
    counts = [word for option in few for word in (option, "1")]
    done = run("tune", *tune_command(tmp_path), "-q", *counts)
    assert done.exit_code == 1, done.output
    line, *overview = done.output.splitlines()
    assert line == f"--output: {out}: cannot be written: {FULL}; printing the result instead"
    assert len(overview) > 5
    written = [path.name for path in out.iterdir()]
    assert [name for name in written if not name.startswith(("study.", ".", "lock"))] == []
