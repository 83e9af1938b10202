"""What ``bench/fleet.py`` makes of two moments of a fleet's flight."""

import json
import sys
from pathlib import Path

import pytest

BENCH = Path(__file__).resolve().parents[2] / "bench"
sys.path.insert(0, str(BENCH))

import fleet  # noqa: E402
from fleet import Snapshot  # noqa: E402


def snapshots():
    """Ten robots: 20 ms per robot and second in the first 5 s, 40 ms in the next."""
    used_s = (3.0, 4.0, 6.0)
    return [
        Snapshot(
            10.0 + 5.0 * k,
            100.0 + 4.0 * k,
            250 * k,
            {"simulator": (used_s[k], 80.0 + k), "rosout": (1.0, 10.0)},
        )
        for k in range(3)
    ]


def test_cpu_counts_per_simulated_second():
    first, second, third = snapshots()
    assert fleet.cpu_of(first, second) == {"rosout": 0.0, "simulator": 0.2}
    assert fleet.rate_hz(10, first, second) == 10.0  # of five robots
    assert fleet.rate_hz(2, first, second) == 25.0
    assert fleet.factor(first, third) == 1.25


def test_the_line_and_the_file_have_the_cost_of_a_robot(tmp_path, capsys):
    first, _, third = snapshots()
    fleet.show(10, first, third)
    line = capsys.readouterr().out
    assert "10 robots, 0 hosts" in line and "(30 ms/robot)" in line and "10.0 commands/s" in line
    fleet.write(10, snapshots(), tmp_path / "a.json")
    written = json.loads((tmp_path / "a.json").read_text())["scripts"]["fleet 10"]["figures"]
    assert written[0]["values"] == pytest.approx([20.0, 40.0])
    assert [one["name"] for one in written][1:] == [
        "real-time factor",
        "commands",
        "memory of all nodes",
    ]
    assert written[3]["values"] == [92.0]
