"""``quad report``: what it reads and writes, and what it says about flights that it can't read."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from hand_made_traces import fleet

from quad_nav.cli import main
from quad_nav.errors import InputError


def read_trace(path: Path):
    """Stands for the reader of bags: "good" is a flight of two."""
    if "good" not in path.name:
        raise InputError([f"{path.name}: is no recording"])
    return fleet(2)


@pytest.fixture
def report(monkeypatch, tmp_path):
    """Runs ``quad report`` with arguments in an empty folder."""
    monkeypatch.setitem(sys.modules, "quad_nav.offline.bag_trace",
                        SimpleNamespace(read_trace=read_trace))
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(main, ["report", *arguments])


def test_one_flight(report, tmp_path):
    result = report("good.bag")
    assert (result.exit_code, result.output) == (0, "report: report.html\n")
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<h1>good.bag</h1>" in html
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_pictures_and_animation(report, tmp_path):
    result = report("good.bag", "-o", "new/one.html", "--png", "png", "--animate", "new/one.gif")
    assert result.output == "report: new/one.html\nanimation: new/one.gif\n"
    assert (tmp_path / "png" / "paths.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "new" / "one.gif").read_bytes().startswith(b"GIF89a")


def test_several_flights(report, tmp_path):
    assert report("good1.bag", "good2.bag", "-o", "both.html").exit_code == 0
    html = (tmp_path / "both.html").read_text(encoding="utf-8")
    assert "2 flights compared" in html and "good1.bag" in html and "good2.bag" in html


def test_every_fault_is_told_and_nothing_written(report, tmp_path):
    result = report("good.bag", "bad.bag", "worse.bag", "--animate", "one.avi")
    assert result.exit_code == 2
    assert result.output == (
        "no report:\n"
        "  animation: 3 flights, expected one\n"
        "  animation: one.avi, expected a name that ends in .gif or .mp4\n"
        "  bad.bag: is no recording\n"
        "  worse.bag: is no recording\n")
    assert list(tmp_path.iterdir()) == []


def test_a_good_flight_with_a_bad_animation_writes_nothing(report, tmp_path):
    assert report("good.bag", "--animate", "one.avi").exit_code == 2
    assert list(tmp_path.iterdir()) == []
