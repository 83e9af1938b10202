"""What ``bench/against_original.py`` makes of samples and summaries, and what it refuses."""

import os
import subprocess
import sys
from pathlib import Path

BENCH = Path(__file__).resolve().parents[2] / "bench"
sys.path.insert(0, str(BENCH))

import against_original  # noqa: E402
from against_original import ORIGINAL, OURS, Sample  # noqa: E402
from figures import Figures  # noqa: E402


def sample(now_s, cpu_s, memory_mb, commands, done=()):
    nodes = {"move_base1": (cpu_s, memory_mb), "simulator": (2.0 * cpu_s, 50.0)}
    return Sample(now_s, nodes, (0, commands), frozenset(done))


def test_a_navigator_counts_until_its_robot_has_no_goals_left():
    samples = [
        sample(1.0, 10.0, 100.0, 5),
        sample(3.0, 10.5, 120.0, 25),
        sample(11.0, 11.0, 110.0, 105),
        sample(21.0, 11.0, 500.0, 105, done=[1]),  # idle
        sample(31.0, 99.0, 500.0, 105, done=[0, 1]),
    ]
    assert against_original.used_by_nodes(samples) == {
        "CPU of move_base1": 100.0,  # 1 s in 10 s
        "memory of move_base1": 120.0,
        "commands to quad1": 10.0,
        "CPU of simulator": 100.0,  # 2 s in 20 s
        "memory of simulator": 50.0,
    }
    assert against_original.used_by_nodes(samples[:1]) == {}


def test_a_summary_gives_times_gaps_and_contacts():
    def robot(times_s, separation_m, clearance_m):
        goals = [{"reached": time_s is not None, "time_s": time_s} for time_s in times_s]
        return {
            "goals": goals,
            "recoveries": 1,
            "min_separation_m": separation_m,
            "min_clearance_m": clearance_m,
        }

    summary = {
        "sim_time_s": 90.0,
        "contacts": [{}],
        "robots": [robot([20.0, 30.0], 0.5, None), robot([40.0, None], 0.5, 0.2)],
    }
    assert against_original.flown(summary) == {
        "goals reached": 3.0,
        "time to a goal": 30.0,
        "flight": 90.0,
        "contacts": 1.0,
        "recoveries": 2.0,
        "smallest gap between the robots": 0.5,
        "smallest gap to an obstacle": 0.2,
    }


def test_the_table_has_ratios_of_medians_where_both_have_flown():
    flights = {
        OURS: [{"flight": 80.0, "contacts": 0.0}, {"flight": 90.0, "contacts": 0.0}],
        ORIGINAL: [{"flight": 100.0, "contacts": 0.0, "CPU of move_base0": 31.0}, {}],
    }
    assert against_original.table(flights, Figures("against_original")) == [
        ["CPU of move_base0, ms/s", "-", "31 (31 to 31)", "-"],
        ["flight, s", "85 (80 to 90)", "100 (100 to 100)", "0.85"],
        ["contacts", "0 (0 to 0)", "0 (0 to 0)", "-"],
    ]


def test_a_workspace_that_is_not_built_is_refused(tmp_path):
    script = [sys.executable, BENCH / "against_original.py", "--workspace", tmp_path]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    run = subprocess.run(script, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert "is it built?" in run.stderr
