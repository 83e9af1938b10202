"""A node that a signal kills is restarted; one that exits is not."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Dies at first, prints its arguments the second time, and exits with 3.
DIES_ONCE = """
import os, signal, sys
if sys.argv[-1] != "--respawned":
    os.kill(os.getpid(), signal.SIGKILL)
print(sys.argv[1:], flush=True)
sys.exit(3)
"""
WAITS = "import signal; print('here', flush=True); signal.pause()"


def respawned(program: str, *arguments: str) -> subprocess.Popen:
    return subprocess.Popen(
        [
            sys.executable,
            "-m",
            "quad_nav.mission.respawn",
            sys.executable,
            "-c",
            program,
            *arguments,
        ],
        env={"PYTHONPATH": str(ROOT / "src")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        universal_newlines=True,
    )


def test_a_killed_node_is_restarted_until_it_exits():
    stdout, stderr = (process := respawned(DIES_ONCE, "_robots:=2")).communicate(timeout=60)
    assert stdout == "['_robots:=2', '--respawned']\n"
    assert "killed by SIGKILL, restarting" in stderr
    assert process.returncode == 3


def test_a_node_that_exits_is_not_restarted():
    process = respawned("import sys; print('once'); sys.exit(2)")
    assert process.communicate(timeout=60)[0] == "once\n" and process.returncode == 2


def test_signals_are_passed_on():
    process = respawned(WAITS)
    assert process.stdout.readline() == "here\n"
    process.send_signal(signal.SIGTERM)
    assert process.communicate(timeout=60)[0] == ""
    assert process.returncode == 128 + signal.SIGTERM


def test_the_command_ends_with_its_supervisor():
    process = respawned("import os, signal; print(os.getpid(), flush=True); signal.pause()")
    child = int(process.stdout.readline())
    process.kill()
    process.communicate(timeout=60)  # the child's end closes the pipe
    assert not Path(f"/proc/{child}/cmdline").exists() or (
        Path(f"/proc/{child}/cmdline").read_bytes() == b""
    )
