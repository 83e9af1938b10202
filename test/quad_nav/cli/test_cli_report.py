"""``quad report``: what it reads and writes, and what it says about flights that it can't read."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from quad_nav.cli import main
from quad_nav.files.shipped import shipped


@pytest.fixture(scope="module")
def bag(tmp_path_factory) -> Path:
    """Half a second of the tutorial's mission."""
    path = tmp_path_factory.mktemp("flight") / "good.bag"
    words = "fly --quiet --time-limit 0.5 --beams 64 --config tutorial".split()
    CliRunner().invoke(main, [*words, "--record", str(path)])
    return path


@pytest.fixture
def report(bag, monkeypatch, tmp_path):
    """Runs ``quad report`` in a folder with two good bags and two others, beside an empty one."""
    for name in ("good.bag", "good2.bag"):
        shutil.copy(bag, tmp_path / name)
    for name in ("bad.bag", "worse.bag"):
        (tmp_path / name).write_text("no recording")
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path / "out")
    return lambda *arguments: CliRunner().invoke(main, ["report", *arguments])


def test_one_flight(report, tmp_path):
    result = report("../good.bag")
    assert (result.exit_code, result.output) == (0, "report: report.html\n")
    html = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<h1>good.bag</h1>" in html and "0 of 6" in html
    assert "ended early (time limit of 0.5 s)" in html
    assert "TrajectoryPlannerROS/max_vel_x" in html
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["report.html"]


def test_pictures_and_animation(report, tmp_path):
    outputs = ("-o", "new/one.html", "--pictures", "paper", "--animate", "new/one.gif")
    result = report("../good.bag", *outputs)
    assert result.output == ("report: new/one.html\npictures: paper\nanimation: new/one.gif\n")
    assert (tmp_path / "out" / "paper" / "paths.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in (tmp_path / "out" / "paper" / "paths.svg").read_bytes()[:1000]
    assert (tmp_path / "out" / "new" / "one.gif").read_bytes().startswith(b"GIF89a")


def test_several_flights(report, tmp_path):
    assert report("../good.bag", "../good2.bag", "-o", "both.html").exit_code == 0
    html = (tmp_path / "out" / "both.html").read_text(encoding="utf-8")
    assert "2 flights compared" in html
    assert '<td class="name">good.bag</td><td class="name">tutorial</td>' in html
    assert '<td class="name">good2.bag</td>' in html
    assert "All flights have the same parameters and set-up." in html


def test_pictures_of_a_flight_as_it_is_flown(tmp_path):
    arguments = ["fly", "--time-limit", "0.2", "--beams", "64"]
    result = CliRunner().invoke(main, [*arguments, "--pictures", str(tmp_path / "paper")])
    assert f"pictures: {tmp_path / 'paper'}" in result.output
    names = {path.name for path in (tmp_path / "paper").iterdir()}
    assert {"paths.png", "paths.svg", "timeline.svg"} <= names
    assert not any(path.suffix == ".html" for path in tmp_path.iterdir())


def test_every_fault_is_listed_and_nothing_written(report, tmp_path):
    result = report("../good.bag", "../bad.bag", "../worse.bag", "--animate", "one.avi")
    assert result.exit_code == 2
    lines = result.output.splitlines()
    assert lines[:3] == [
        "no report written:",
        "  animation: 3 flights, expected one",
        "  animation: one.avi, expected a name that ends in .gif or .mp4",
    ]
    assert [line.split(":")[0] for line in lines[3:]] == ["  ../bad.bag", "  ../worse.bag"]
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize("name", [b"/odom0", b"nav_msgs/Odometry"])
def test_names_that_are_not_utf8_are_refused(report, tmp_path, name):
    """The index of a bag holds topics and types as they are."""
    content = (tmp_path / "good.bag").read_bytes()
    assert name in content
    (tmp_path / "odd.bag").write_bytes(content.replace(name, b"\xff" + name[1:]))
    result = report("../odd.bag")
    assert isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code == 2 and "odd.bag: " in result.output, result.output


def test_a_file_whose_name_is_not_utf8_is_reported(report, tmp_path):
    shutil.copy(tmp_path / "good.bag", tmp_path / os.fsdecode(b"fl\xff.bag"))
    result = report(os.fsdecode(b"../fl\xff.bag"))
    assert (result.exit_code, result.output) == (0, "report: report.html\n")
    assert b"<h1>fl" in (tmp_path / "out" / "report.html").read_bytes()


@pytest.mark.parametrize(
    "command, status",
    [
        ("fly -q --time-limit 0.2 --config {0}/k\xf6 --json {0}/\xe4 --report {0}/\xdf.html", 1),
        ("check {0}/k\xf6", 0),
        ("fly --scene {0}/no\xdf.yaml", 2),
    ],
)
def test_commands_run_in_a_locale_without_utf8(tmp_path, command, status):
    folder = tmp_path / "\u96f6"
    shutil.copytree(shipped("config", "tutorial"), folder / "k\xf6")
    locale = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = subprocess.run(
        [sys.executable, "-m", "quad_nav.cli", *command.format(folder).split()],
        env={**os.environ, **locale, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        check=False,
    )
    assert (done.returncode, b"Traceback" in done.stderr) == (status, False), done.stderr
