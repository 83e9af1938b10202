"""What ``bench/fleet.py`` and ``bench/original.py`` make of two moments of a flight."""

import json
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

BENCH = Path(__file__).resolve().parents[2] / "bench"
sys.path.insert(0, str(BENCH))

import fleet  # noqa: E402
import original  # noqa: E402
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


@pytest.mark.parametrize(("wall_s", "marked"), [(10.5, "0.95"), (10.6, "0.94 too slow")])
def test_a_run_on_a_busy_machine_is_marked(wall_s, marked):
    def used(cpu_s):
        return {"move_base0": (cpu_s, 70.0), "move_base1": (3 * cpu_s, 80.0), "simulator": (9, 9)}

    seen = [Snapshot(6.0, 0.0, 0, used(1.0)), Snapshot(16.0, wall_s, 20, used(1.2))]
    assert original.row("quad", seen) == ["quad", "40.0", "75", "1.0", marked]


def test_a_configuration_that_is_not_there_is_refused_before_anything_starts(monkeypatch):
    monkeypatch.setattr(original, "snapshots", None)
    result = CliRunner().invoke(original.main, ["--config", "nosuch"])
    assert result.exit_code == 2
    assert "nosuch" in result.output
