"""Nothing outside of ROS assumes what Windows or macOS lack."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

SOURCES = Path(__file__).resolve().parents[2] / "src"
MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "termios", "tty"}
NAMES = {
    "os": "fork forkpty geteuid getegid getuid getgid getpgid getsid setuid setgid setsid setpgid"
    " killpg pread pwrite preadv pwritev sched_getaffinity mkfifo mknod chown lchown fchown fchmod"
    " chroot nice uname wait wait3 wait4 statvfs fstatvfs getloadavg sysconf confstr openpty"
    " posix_fallocate register_at_fork O_NONBLOCK O_CLOEXEC O_NOFOLLOW O_DIRECTORY O_SYNC",
    "signal": "SIGHUP SIGKILL SIGUSR1 SIGUSR2 SIGSTOP SIGCONT SIGCHLD SIGALRM SIGPIPE SIGQUIT"
    " SIGTSTP alarm setitimer pthread_sigmask pthread_kill sigwait siginterrupt",
}
# (file, name): where the module does without, and ROS alone uses the last ones.
ASKED_FOR = {
    ("quad_nav/files/system.py", "fcntl"),
    ("quad_nav/files/system.py", "os.geteuid"),
    ("quad_nav/files/user_files.py", "resource"),
    ("quad_nav/files/user_files.py", "/proc/self/statm"),
    ("quad_nav/loop/worker_process.py", "os.sched_getaffinity"),
    ("quad_nav/mission/journal.py", "os.pwrite"),
    ("quad_nav/mission/respawn.py", "/proc/"),
}
OF_ROS = ("quad_nav.mission.journal", "quad_nav.mission.respawn")


def trees():
    """Yield each module outside of ROS: its path below src, and its syntax tree."""
    for path in sorted(SOURCES.rglob("*.py")):
        if "ros" not in path.relative_to(SOURCES).parts:
            text = path.read_text(encoding="utf-8")
            yield path.relative_to(SOURCES).as_posix(), ast.parse(text)


def assumptions(tree):
    """Yield the names in a module that not every system has."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            names = [getattr(node, "module", None), *(alias.name for alias in node.names)]
            yield from MODULES.intersection(names)
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.attr in NAMES.get(node.value.id, "").split():
                yield f"{node.value.id}.{node.attr}"
        elif isinstance(node, ast.Constant) and str(node.value).startswith("/proc/"):
            yield node.value


def test_what_a_system_may_lack_is_asked_for_first():
    found = {(path, name) for path, tree in trees() for name in assumptions(tree)}
    assert found == ASKED_FOR


def test_modules_for_ros_are_used_by_ros_alone():
    users = {
        path
        for path, tree in trees()
        for node in ast.walk(tree)
        if isinstance(node, (ast.Import, ast.ImportFrom))
        and {getattr(node, "module", None), *(alias.name for alias in node.names)} & set(OF_ROS)
    }
    assert users == set()


# Removes what Windows lacks before anything of quad is imported, and after all that is not ours.
AS_WINDOWS = f"""
import os, pathlib, signal, sys
import joblib, lz4.frame, matplotlib.backends.backend_agg, numba, PIL.Image, plotly.offline
import pybullet, rich.progress, rosbags.rosbag1, rosbags.typesys
for name in {sorted(MODULES - {"posix"})}:
    sys.modules[name] = None
for module, names in ((os, {NAMES["os"].split()}), (signal, {NAMES["signal"].split()})):
    for name in names:
        if hasattr(module, name):
            delattr(module, name)
from quad_nav.loop import worker_process
worker_process.sys = type("sys", (), {{"platform": "win32"}})
import quad_nav.files.user_files as user_files
user_files._STATM = pathlib.Path("nowhere")
"""


def test_a_flight_does_without_what_windows_lacks(tmp_path):
    (tmp_path / "quad0_goals.json").write_text('{"goals": [[2.0, 1.5]]}')
    page = tmp_path / "flight.html"
    words = ["fly", "--goals", str(tmp_path), "--report", str(page), "--processes", "1"]
    code = AS_WINDOWS + f"from quad_nav.cli import main; main({words}, prog_name='quad')"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(SOURCES)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert page.stat().st_size > 100_000
