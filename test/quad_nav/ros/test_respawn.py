"""A node that a signal kills is restarted; one that exits is not."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
SUPERVISOR = (sys.executable, "-m", "quad_nav.mission.respawn")
# Dies at first, prints its arguments the second time, and exits with 3.
DIES_ONCE = """
import os, signal, sys
if sys.argv[-1] != "--respawned":
    os.kill(os.getpid(), signal.SIGKILL)
print(sys.argv[1:], flush=True)
sys.exit(3)
"""
WAITS = "import signal; print('here', flush=True); signal.pause()"


# Starts a program and waits for its end, or for Ctrl-C, which it passes on as roslaunch does.
PARENT = """
import signal, subprocess, sys
def end(*_):
    print("interrupted", flush=True)
    program.send_signal(signal.SIGINT)
signal.signal(signal.SIGINT, end)
program = subprocess.Popen(sys.argv[1:])
print(program.wait(), flush=True)
"""


def respawned(program: str, *arguments: str, options: tuple = ()) -> subprocess.Popen:
    return subprocess.Popen(
        [*SUPERVISOR, *options, sys.executable, "-c", program, *arguments],
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


@pytest.mark.parametrize("status", [0, 2])
def test_a_node_that_raises_is_restarted_if_asked_for(status):
    """Python ends with 1 after an exception; 2 is a fault of the files."""
    program = f"import sys; sys.exit({status} if sys.argv[1:] == ['--respawned'] else 1)"
    process = respawned(program, options=("--after-error",))
    assert "ended with an error, restarting" in process.communicate(timeout=60)[1]
    assert process.returncode == status


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


@pytest.mark.parametrize(
    "name, options, printed",
    [
        ("quiet_roslaunch", ["--end-roslaunch"], "interrupted\n3\n"),
        ("rostest", ["--end-roslaunch"], "3\n"),
        ("roslaunch", [], "3\n"),
    ],
)
def test_the_end_of_the_node_ends_roslaunch(tmp_path, name, options, printed):
    parent = tmp_path / name
    parent.write_text(PARENT)
    command = [*SUPERVISOR, *options, sys.executable, "-c", "raise SystemExit(3)"]
    done = subprocess.run(
        [sys.executable, str(parent), *command],
        env={"PYTHONPATH": str(ROOT / "src")},
        stdout=subprocess.PIPE,
        text=True,
        timeout=60,
        check=True,
    )
    assert done.stdout == printed
