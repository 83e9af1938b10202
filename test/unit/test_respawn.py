"""A node that was killed is started again; one that has ended has not."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Dies at first, tells how it was called the second time, and ends with 3.
DIES_ONCE = """
import os, signal, sys
if sys.argv[-1] != "--respawned":
    os.kill(os.getpid(), signal.SIGKILL)
print(sys.argv[1:], flush=True)
sys.exit(3)
"""
WAITS = "import signal; print('here', flush=True); signal.pause()"


def again(program: str, *arguments: str) -> subprocess.Popen:
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


def test_what_was_killed_comes_again_and_ends_by_itself():
    told, said = (process := again(DIES_ONCE, "_robots:=2")).communicate(timeout=60)
    assert told == "['_robots:=2', '--respawned']\n"
    assert "killed by SIGKILL, restarting" in said
    assert process.returncode == 3


def test_what_has_ended_is_not_started_again():
    process = again("import sys; print('once'); sys.exit(2)")
    assert process.communicate(timeout=60)[0] == "once\n" and process.returncode == 2


def test_a_request_to_end_is_passed_on_and_heeded():
    process = again(WAITS)
    assert process.stdout.readline() == "here\n"
    process.send_signal(signal.SIGTERM)
    assert process.communicate(timeout=60)[0] == ""
    assert process.returncode == 128 + signal.SIGTERM


def test_the_command_ends_with_its_keeper():
    process = again("import os, signal; print(os.getpid(), flush=True); signal.pause()")
    child = int(process.stdout.readline())
    process.kill()
    process.communicate(timeout=60)  # the child's end closes the pipe
    assert not Path(f"/proc/{child}/cmdline").exists() or (
        Path(f"/proc/{child}/cmdline").read_bytes() == b""
    )
