"""`make fly` refuses arguments that roslaunch would ignore, and bounds its logs."""

from __future__ import annotations

import os
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FLY = runpy.run_path(str(ROOT / "scripts" / "fly"))
faults = FLY["argument_faults"]


@pytest.mark.parametrize(
    ("launch_file", "argument", "hint"),
    [
        ("two_quads.launch", "confg:=tutorial", "; did you mean config:=?"),
        ("two_quads.launch", "rvis:=false", "; did you mean rviz:=?"),
        ("two_quads.launch", "config=tutorial", "; did you mean config:=?"),
        ("two_quads.launch", "tutorial", "; expected name:=value"),
        (
            "two_quads.launch",
            "robots:=3",
            '; fleet.launch has it: make fly ARGS="fleet.launch robots:=3"',
        ),
        (
            "two_quads.launch",
            "nav1:=move_base",
            '; fleet.launch has it: make fly ARGS="fleet.launch nav1:=move_base"',
        ),
        (
            "fleet.launch",
            "override0:=x.yaml",
            '; two_quads.launch has it: make fly ARGS="two_quads.launch override0:=x.yaml"',
        ),
        ("vehicles.launch", "vehicle:=x.yaml", "; did you mean vehicles:=?"),
        ("fleet.launch", "folder:=x", "; expected name:=value"),
        (
            "two_quads.launch",
            "fleet.launch",
            '; the launch file is the first one: make fly ARGS="fleet.launch ..."',
        ),
    ],
)
def test_an_argument_that_the_launch_file_lacks_is_refused(launch_file, argument, hint):
    (fault,) = faults(launch_file, ["rate:=2", argument])
    assert fault == f"{argument}: is not an argument of {launch_file}{hint}"


@pytest.mark.parametrize(
    ("launch_file", "arguments"),
    [
        ("two_quads.launch", "config:=tutorial override1:=x nav:=move_base rate:=2 web:=true"),
        ("fleet.launch", "robots:=12 nav11:=move_base nav3:=quad only_host:=0 hosts:=2 --screen"),
        ("vehicles.launch", "vehicles:=x robots:=1 arm:=true seed:=3 nav0:=quad"),
        ("no_such.launch", "anything:=1"),
    ],
)
def test_arguments_of_a_launch_file_and_of_those_it_includes_pass(launch_file, arguments):
    assert faults(launch_file, arguments.split()) == []


def test_the_logs_of_the_last_flights_are_kept(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))
    (tmp_path / "another").mkdir()
    for number in range(30):
        (tmp_path / "quad-flights" / f"20250101-0000{number:02}-7").mkdir(parents=True)
    FLY["set_log_folder"]()
    own = Path(os.environ["ROS_LOG_DIR"])
    own.mkdir()  # as roslaunch does
    kept = sorted(path.name for path in own.parent.iterdir())
    assert (len(kept), kept[0], kept[-1]) == (20, "20250101-000011-7", own.name)
    assert (tmp_path / "another").is_dir()


@pytest.mark.parametrize("content", [None, b"", b"not a library"])
def test_a_library_that_cannot_be_loaded_is_one_line(content, tmp_path, monkeypatch, capfd):
    library = tmp_path / "libquad_loopback.so"
    if content is not None:
        library.write_bytes(content)
    monkeypatch.setitem(FLY["set_network"].__globals__, "LOOPBACK_LIBRARY", library)
    monkeypatch.delenv("LD_PRELOAD", raising=False)
    monkeypatch.setenv("ROS_HOSTNAME", "elsewhere")
    FLY["set_network"]("")
    assert os.environ["ROS_HOSTNAME"] == "localhost"
    assert "LD_PRELOAD" not in os.environ
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith(f"quad: {library}: cannot be loaded; ")


def test_an_unknown_address_is_told_in_one_line():
    with pytest.raises(SystemExit, match="quad: no.such.name.invalid: .*; expected a line for it"):
        FLY["free_port"]("no.such.name.invalid")
