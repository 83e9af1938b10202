"""Output files: checked before a flight; afterwards complete, or absent with a message."""

from __future__ import annotations

import errno
import json
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from size_limit import size_limit

from quad_nav.cli import main
from quad_nav.files import output
from quad_nav.files.output import folder_faults, output_faults, replacing, write_text
from quad_nav.mission.summary import MissionSummary

FULL = "No space left on device"
FLY = ("fly", "-q", "--time-limit", "0.2", "--beams", "64", "--config", "tutorial")


@pytest.fixture
def full_disk(monkeypatch):
    """Every file reaches the disk only when it is complete, and there is no space for it."""

    def sync(_):
        raise OSError(errno.ENOSPC, FULL)

    monkeypatch.setattr(output, "_sync", sync)


def run(*arguments: object):
    done = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done


def names(folder: Path):
    return sorted(path.name for path in folder.iterdir())


def refusal(path: Path, **options) -> str:
    (line,) = output_faults(path, "--json", **options)
    start = f"--json: {path}: cannot be written: "
    assert line.startswith(start) and line.endswith("; expected a file that can be written")
    return line[len(start) :].partition(";")[0]


def test_a_file_that_can_be_written_has_no_faults_and_is_not_made(tmp_path):
    (tmp_path / "older.json").write_text("older")
    for path in (tmp_path / "x.json", tmp_path / "new" / "er" / "x.json", tmp_path / "older.json"):
        assert output_faults(path, "--json") == []
    assert folder_faults(tmp_path / "new", "--png") == []
    assert names(tmp_path) == ["older.json"]
    assert (tmp_path / "older.json").read_text() == "older"


def test_files_that_cannot_be_written(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    assert refusal(tmp_path) == "is a folder"
    assert refusal(tmp_path / "file" / "x.json") == f"{tmp_path / 'file'} is not a folder"
    assert refusal(tmp_path / ("n" * 300)) == "File name too long"
    assert "embedded null " in refusal(tmp_path / "nul\0")
    assert refusal(Path("/dev/null"), any_kind=False) == "is a device or a pipe"
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write everything
    assert refusal(tmp_path / "file") == "is write-protected"


def test_a_full_disk_is_noticed_before(tmp_path):
    with size_limit(100):  # an empty file would fit
        assert refusal(tmp_path / "x.json") == "File too large"
        (line,) = folder_faults(tmp_path / "new", "--png")
    assert line == (
        f"--png: {tmp_path / 'new'}: cannot be written: File too large; expected a folder that can"
        " be written"
    )
    assert names(tmp_path) == []


def test_no_folder_is_made_in_the_root(tmp_path):
    missing = Path("/quad-nav-test-misspelled")
    for path in (missing / "x.json", missing / "deeper" / "x.json"):
        assert refusal(path) == f"there is no folder {missing}"
        with pytest.raises(FileNotFoundError):
            write_text(path, "text")
    assert folder_faults(missing, "--png") != []
    assert not missing.exists()


def test_a_pipe_is_written_and_not_replaced(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    assert refusal(path) == "No such device or address"  # without waiting for a reader
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    assert output_faults(path, "--json") == []
    write_text(path, "text")
    assert os.read(reader, 10) == b"text"
    os.close(reader)
    assert stat.S_ISFIFO(path.stat().st_mode)


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "file")
    write_text(tmp_path / "link", "text")
    assert (tmp_path / "file").read_text() == "text" and (tmp_path / "link").is_symlink()


def test_names_that_are_not_utf8_can_be_written_about(tmp_path):
    write_text(tmp_path / "x", os.fsdecode(b"fl\xffight"))
    assert (tmp_path / "x").read_bytes() == b"fl?ight"


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, FULL), KeyboardInterrupt()])
def test_whatever_fails_leaves_the_older_file_and_nothing_else(tmp_path, error):
    (tmp_path / "x").write_text("older")
    with pytest.raises(type(error)), replacing(tmp_path / "x") as partial:
        partial.write_text("half")
        raise error
    assert names(tmp_path) == ["x"] and (tmp_path / "x").read_text() == "older"


@pytest.mark.parametrize(
    "command, option, name",
    [
        ("fly", "--json", "x.json"),
        ("fly", "--report", "x.html"),
        ("fly", "--animate", "x.gif"),
        ("fly", "--record", "x.bag"),
        ("report flight.bag", "--output", "x.html"),
        ("report flight.bag", "--pictures", "x"),
        ("report flight.bag", "--animate", "x.gif"),
    ],
)
def test_every_output_is_checked_first(tmp_path, command, option, name):
    assert_output_is_checked_first(tmp_path, command, option, name)


def assert_output_is_checked_first(tmp_path, command, option, name):
    """Nothing is read, flown or written before; the bag does not even exist."""
    (tmp_path / "file").write_text("")
    places = {
        Path("/quad-nav-test-misspelled"): "there is no folder /quad-nav-test-misspelled",
        tmp_path / "file": f"{tmp_path / 'file'} is not a folder",
    }
    for folder, why in places.items():
        done = run(*command.split(), option, folder / name)
        assert done.exit_code == 2, done.output
        assert f"  {option}: {folder / name}: cannot be written: {why}; expected" in done.output
        assert not folder.is_dir()
    with size_limit(100):
        done = run(*command.split(), option, tmp_path / name)
    assert done.exit_code == 2 and "cannot be written: File too large" in done.output
    assert names(tmp_path) == ["file"]


def test_summary_is_printed_if_it_cannot_be_written(tmp_path, full_disk):
    path = tmp_path / "x.json"
    path.write_text("older")
    done = run(*FLY, "--json", path)
    assert done.exit_code == 1
    line, _, text = done.output.partition("\n")
    assert line == f"--json: {path}: cannot be written: {FULL}; printing the result instead"
    assert json.loads(text)["reason"] == "time limit of 0.2 s"
    assert names(tmp_path) == ["x.json"] and path.read_text() == "older"


def test_summary_of_a_successful_flight_ends_in_status_1(tmp_path, monkeypatch, full_disk):
    summary = MissionSummary(())
    assert summary.exit_status == 0
    monkeypatch.setattr("quad_nav.cli.offline_flight.fly_setup", lambda *_: summary)
    assert run("fly", "-q", "--json", tmp_path / "x.json").exit_code == 1


@pytest.mark.parametrize("option, name", [("--report", "x.html"), ("--animate", "x.gif")])
def test_table_is_printed_if_a_picture_cannot_be_written(tmp_path, full_disk, option, name):
    done = run(*FLY, option, tmp_path / name)
    assert done.exit_code == 1
    line, *table = done.output.splitlines()
    assert line == (
        f"{option}: {tmp_path / name}: cannot be written: {FULL}; printing the result instead"
    )
    assert "time limit of 0.2 s" in "\n".join(table)
    assert names(tmp_path) == []


def test_a_quiet_flight_tells_that_its_recording_failed(tmp_path):
    with size_limit(5_000):
        done = run(*FLY, "--record", tmp_path / "x.bag")
    assert (done.exit_code, done.output) == (
        1,
        "cannot write the recording: no room for a single chunk\n",
    )
    assert names(tmp_path) == []


def test_standard_output_on_a_full_disk_is_told():
    script = "from quad_nav.cli import main; main(['fly', '--help'])"
    with open("/dev/full", "wb") as full:
        done = subprocess.run(
            [sys.executable, "-c", script],
            stdout=full,
            stderr=subprocess.PIPE,
            check=False,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )
    assert done.returncode == 1
    assert done.stderr.decode().endswith(f"standard output: cannot be written: {FULL}\n")
