"""The scripts that set a checkout up say at once what they wait for, or what they cannot do."""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NOBODY = 65534
SET_UPS = (
    ["scripts/install_packages"],
    ["scripts/make_venv", ".venv", "requirements.txt"],
    ["scripts/build_workspace"],
)


@pytest.fixture
def checkout():
    """Copy what a set-up reads to a folder that every user may read."""
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        copy_checkout(Path(folder) / "quad")
        yield Path(folder) / "quad"


def copy_checkout(folder):
    shutil.copytree(ROOT / "scripts", folder / "scripts")
    for name in ("requirements.txt", "pyproject.toml", "package.xml", "CMakeLists.txt", "setup.py"):
        shutil.copy(ROOT / name, folder)
    for name in ("action", "msg", "network", "nodes", "src", "test/ros"):
        (folder / name).mkdir(parents=True)
        (folder / name / "file").touch()


def run(command, folder, **options):
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, **options
    )


def complete_venv(checkout):
    """Make what `make_venv` takes for an environment with everything in it."""
    venv = checkout / ".venv"
    (venv / "bin").mkdir(parents=True)
    (venv / "installed").mkdir()
    (venv / "bin" / "python3").symlink_to(sys.executable)
    (venv / "installed" / "python").write_text("{}.{}\n".format(*sys.version_info[:2]))
    shutil.copy(checkout / "requirements.txt", venv / "installed")
    return venv


def become_nobody():
    if os.geteuid() == 0:
        os.setuid(NOBODY)


@pytest.mark.parametrize("command", SET_UPS, ids=lambda command: command[0])
@pytest.mark.parametrize("name", ["my quad", "quad:2", "it's"])
def test_a_path_that_catkin_does_not_survive_is_refused(command, name, tmp_path):
    copy_checkout(tmp_path / name)
    before = sorted((tmp_path / name).iterdir())
    done = run(command, tmp_path / name)
    assert done.returncode == 1
    assert done.stderr.startswith(f"quad: {tmp_path / name}: a path with a space, a quote or ")
    assert done.stdout == ""
    assert sorted((tmp_path / name).iterdir()) == before


def test_a_second_set_up_waits_for_the_first(checkout):
    venv = complete_venv(checkout)
    folder = os.open(venv, os.O_RDONLY)
    fcntl.flock(folder, fcntl.LOCK_EX)
    second = subprocess.Popen(
        SET_UPS[1],
        cwd=checkout,
        env={**os.environ, "QUAD_PYTHON": sys.executable},
        stdout=subprocess.PIPE,
        text=True,
    )
    with second:
        assert second.stdout.readline().startswith("quad: waiting for another set-up ")
        os.close(folder)
    assert second.returncode == 0


@pytest.mark.parametrize("command", SET_UPS[1:], ids=lambda command: command[0])
def test_a_checkout_that_cannot_be_written_is_named_with_what_to_do(command, checkout):
    checkout.chmod(0o555)
    environment = {**os.environ, "QUAD_PYTHON": "/usr/bin/python3"}
    done = run(command, checkout, env=environment, preexec_fn=become_nobody)
    checkout.chmod(0o755)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith(f"quad: {checkout}: cannot be written by ")
    assert "its owner runs the same command there" in done.stderr


def test_a_complete_environment_of_somebody_else_is_used(checkout):
    complete_venv(checkout).chmod(0o555)
    environment = {**os.environ, "QUAD_PYTHON": sys.executable}
    done = run(SET_UPS[1], checkout, env=environment)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.parametrize("sudo", ["", "exit 1"])
def test_without_sudo_there_is_a_line_for_an_administrator(sudo, checkout, tmp_path):
    commands = {"id": "echo 1000", "dpkg-query": "", "apt-get": "", "sudo": sudo}
    for name, body in commands.items():
        if body or name != "sudo":
            (tmp_path / name).write_text(f"#!/bin/sh\n{body}\n")
            (tmp_path / name).chmod(0o755)
    for name in ("bash", "dirname", "grep", "sed", "flock", "rviz"):
        if shutil.which(name):
            (tmp_path / name).symlink_to(shutil.which(name))
    done = run([shutil.which("bash"), *SET_UPS[0]], checkout, env={"PATH": str(tmp_path)})
    assert done.returncode == 1
    assert "ask an administrator to run 'apt-get install build-essential " in done.stderr
    assert done.stderr.endswith("or install quad without ROS: pip install .\n")
