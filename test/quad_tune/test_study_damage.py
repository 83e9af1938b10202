"""Damaged, locked and read-only files of studies and caches are refused before anything flies."""

from __future__ import annotations

import os
import shutil
import sqlite3
import sys
import tempfile
from contextlib import closing
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from small_mission import write_mission
from study_flights import SYNTHETIC_SPACE
from test_tuning_search import IDENTITY, run

from quad_nav.errors import InputError
from quad_tune.cli.sweep import sweep
from quad_tune.flight_cache import FlightCache
from quad_tune.study import open_study

FUZZ = Path(__file__).parents[1] / "fuzz"
sys.path.insert(0, str(FUZZ))

import targets  # noqa: E402

RESULT = '{"goals": 2, "reached": 2, "contacts": 0, "time_s": 40.0, "straight_m": 10.0}'


def result(**fields):
    """SQL that replaces fields of the second flight's result."""
    pairs = ", ".join(f"'$.{name}', {value}" for name, value in fields.items())
    return f"UPDATE flights SET result = json_set(result, {pairs}) WHERE rowid = 2"


ROW = "UPDATE flights SET {} WHERE rowid = 2"
IN_FLIGHTS = {
    "no JSON": ROW.format("result = 'x'"),
    "a deep list": ROW.format(f"result = '{'[' * 40000}'"),
    "a blob": ROW.format("result = x'ff00'"),
    "a number as result": ROW.format("result = 5"),
    "a text as seed": ROW.format("seed = 'first'"),
    "a view": "CREATE VIEW endless AS SELECT * FROM flights",
    "a field too few": "UPDATE flights SET result = json_remove(result, '$.goals') WHERE rowid = 2",
    "a field too many": result(extra=1),
    "a text as time": result(time_s="'long'"),
    "more reached than goals": result(reached=7),
    "a NaN": ROW.format(f"result = '{RESULT.replace('40.0', 'NaN')}'"),
    "a column too few": "ALTER TABLE flights RENAME COLUMN result TO results",
}
IN_TRIALS = {
    "no study": "DELETE FROM studies",
    "the highest cost": "UPDATE study_directions SET direction = 'MAXIMIZE'",
    "no table of values": "DROP TABLE trial_values",
    "a trial that still runs": "UPDATE trials SET state = 'RUNNING' WHERE number = 3",
    "a trial left out": "DELETE FROM trials WHERE number = 3",
    "a number twice": "UPDATE trials SET number = 2 WHERE number = 3",
    "no cost": "UPDATE trial_values SET value = NULL WHERE trial_id = 3",
    "an infinite cost": "UPDATE trial_values SET value_type = 'INF_POS' WHERE trial_id = 3",
    "no costs of rounds": "DELETE FROM trial_intermediate_values",
    "a parameter outside of its range": "UPDATE trial_params SET param_value = 7.0",
    "another parameter": "UPDATE trial_params SET param_name = 'other' WHERE param_name = 'speed'",
    "statistics that are none": "UPDATE trial_user_attributes SET value_json = '{}'",
    "no options": "DELETE FROM study_user_attributes",
    "another version": "UPDATE alembic_version SET version_num = 'x'",
}
FILES = {
    "no database": lambda path: path.write_bytes(b"no database, but long enough" * 100),
    "a short text": lambda path: path.write_bytes(b"x"),
    "half of the file": lambda path: os.truncate(path, path.stat().st_size // 2),
    "a page of rubbish": lambda path: overwrite(path, 8192, b"\xa5" * 4096),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
    "a pipe": lambda path: (path.unlink(), os.mkfifo(path)),
}
HARMLESS = {
    "another column": "ALTER TABLE flights ADD COLUMN remark TEXT",
    "older results": "UPDATE flights SET result = json_remove(result, '$.recoveries', '$.reason')",
    "a row of another study": f"INSERT INTO flights VALUES ('{{}}', 'other', 0, '{RESULT}')",
}


def overwrite(path, at, data):
    """Replace bytes of a file."""
    with path.open("r+b") as file:
        file.seek(at)
        file.write(data)


def damage(path, how):
    """Apply SQL, or a function of the path."""
    if callable(how):
        how(path)
        return
    with closing(sqlite3.connect(path)) as database, database:
        database.executescript(how)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A study of 32 candidates in a folder, its trials and its flights."""
    folder = tmp_path_factory.mktemp("whole")
    trials, _ = run(folder)
    return folder, trials, dict(FlightCache(folder / "study.db")._flights)


@pytest.fixture
def study(whole, tmp_path):
    """A copy of the study's file."""
    shutil.copytree(whole[0], tmp_path / "study")
    return tmp_path / "study" / "study.db"


def refused(call, path):
    """The message of a refusal, which names the file and what was expected."""
    with pytest.raises(InputError) as raised:
        call()
    for line in raised.value.problems:
        assert str(path.parent) in line
        assert "expected" in line or "delete the row" in line
    return str(raised.value)


@pytest.mark.parametrize("how", [*IN_FLIGHTS, *IN_TRIALS, *FILES])
def test_tune_refuses_a_damaged_study_before_it_flies(study, how):
    damage(study, {**IN_FLIGHTS, **IN_TRIALS, **FILES}[how])

    def open_and_close():
        with open_study(study.parent, IDENTITY, SYNTHETIC_SPACE):
            pass

    refused(open_and_close, study)


@pytest.mark.parametrize("how", ["no JSON", "a folder", "half of the file"])
def test_sweep_refuses_a_damaged_cache_before_it_flies(study, how):
    damage(study, {**IN_FLIGHTS, **FILES}[how])
    mission = write_mission(study.parent)
    arguments = ["--scene", str(mission.scene), "--goals", str(mission.goals)]
    over = ["--over", "TrajectoryPlannerROS/max_vel_x=0.4", "--cache", str(study)]
    done = CliRunner().invoke(sweep, [*arguments, *over, "--flights", "1"])
    assert (done.exit_code, str(study) in done.output) == (2, True), done.output


@pytest.mark.parametrize("how", HARMLESS)
def test_a_study_with_harmless_changes_is_resumed(study, whole, how):
    damage(study, HARMLESS[how])
    trials, flown = run(study.parent)
    assert (trials, flown) == (whole[1], [])


def test_a_row_is_named_and_deleting_it_flies_the_flight_again(study, whole):
    damage(study, IN_FLIGHTS["no JSON"])
    assert "row 2 of flights: result is not JSON" in refused(lambda: FlightCache(study), study)
    damage(study, "DELETE FROM flights WHERE rowid = 2")
    trials, flown = run(study.parent)
    assert (trials, len(flown)) == (whole[1], 1)


def test_an_empty_file_is_a_new_study(tmp_path, whole):
    (tmp_path / "study.db").touch()
    assert run(tmp_path)[0] == whole[1]


def test_a_file_that_another_program_locks_is_refused(study, monkeypatch):
    monkeypatch.setattr("quad_tune.study_database.LOCK_TIMEOUT_S", 0.0)
    with closing(sqlite3.connect(study, isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        assert "locked; expected that no other program" in refused(
            lambda: FlightCache(study), study
        )


@pytest.fixture
def readable_folder():
    """A folder that every user may enter, which those of pytest are not."""
    folder = Path(tempfile.mkdtemp(prefix="quad-study-"))
    folder.chmod(0o777)
    yield folder
    shutil.rmtree(folder)


def test_a_file_that_cannot_be_written_is_refused(study, readable_folder):
    path = readable_folder / "study.db"
    shutil.copy(study, path)
    path.chmod(0o444)
    readable_folder.chmod(0o555)
    user = os.geteuid()
    if user == 0:
        os.seteuid(65534)  # root may write everywhere
    try:
        message = refused(lambda: FlightCache(path), path)
    finally:
        os.seteuid(user)
    assert "readonly database; expected a file and a folder that can be written" in message


edits = st.tuples(
    st.integers(0, 255),
    st.integers(0, 255),
    st.integers(0, 7),
    st.integers(0, 5),
    st.sampled_from([b"", b"x", b"null", b"{}", b"[]", b"-1", b"1e300", b"9" * 30, b"\xff", b"["])
    | st.binary(max_size=20).map(lambda value: value.replace(b"\n", b"")),
)


@pytest.mark.slow
@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(edits, min_size=1, max_size=3))
def test_changed_values_are_used_or_refused(changes):
    lines = [bytes(numbers) + value for *numbers, value in changes]
    targets.run("study", b"\n".join(lines))


@pytest.mark.slow
@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.data())
def test_changed_bytes_are_used_or_refused(data):
    content = bytearray((FUZZ / "corpus" / "study" / "usual.db").read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    targets.run("study", bytes(content))
