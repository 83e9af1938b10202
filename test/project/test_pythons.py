"""Pythons that quad does not support are refused at once, with the way out."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from quad_nav.versions import versions

ROOT = Path(__file__).resolve().parents[2]
CHECK = ROOT / "scripts" / "check_python.py"
refusal, has_wheel = map(runpy.run_path(str(CHECK)).get, ("refusal", "has_wheel"))


@pytest.mark.parametrize("minor", range(8, 14))
def test_supported_pythons_pass_and_are_classified(minor):
    assert refusal((3, minor, 1), "python") == ""
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert f'"Programming Language :: Python :: 3.{minor}",' in project


@pytest.mark.parametrize("version", [(2, 7, 18), (3, 7, 16), (3, 14, 0)])
def test_other_pythons_are_refused_with_the_way_out(version):
    reason = refusal(version, "/opt/python")
    assert reason.startswith(f"quad: Python {version[0]}.{version[1]} at /opt/python: expected ")
    assert "expected Python 3.8 to 3.13; " in reason
    for way in ("uv tool install --python 3.11 .", "conda create", "docker build --tag quad ."):
        assert f"\n    {way}" in reason


@pytest.fixture
def newer_python(tmp_path):
    """Act as a Python 3.14: ``sys.version_info`` is changed as soon as it starts."""
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.version_info = (3, 14, 0)\n")
    python = tmp_path / "python3.14"
    python.write_text(f'#!/bin/sh\nPYTHONPATH={tmp_path} exec {sys.executable} "$@"\n')
    python.chmod(0o755)
    return python


@pytest.mark.parametrize(
    "command",
    [["scripts/make_venv", "{folder}/venv", "requirements.txt"], ["{python}", "setup.py"]],
)
def test_environment_and_build_refuse_before_they_do_anything(command, newer_python):
    folder = newer_python.parent
    before = set(folder.iterdir())
    done = subprocess.run(
        [part.format(folder=folder, python=newer_python) for part in command],
        cwd=ROOT,
        env={**os.environ, "QUAD_PYTHON": str(newer_python)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("quad: Python 3.14 at ")
    assert done.stdout == ""
    assert {path for path in folder.iterdir() if path.name != "__pycache__"} == before


# Recorded: pip download --only-binary=:all: --no-deps --python-version 3.N --platform TAG ENGINE,
# with the tags manylinux2014_x86_64 and manylinux_2_28_x86_64, manylinux2014_aarch64 and
# manylinux_2_28_aarch64, macosx_14_0_arm64, macosx_14_0_x86_64, win_amd64, win_arm64.
WHEELS = {
    ("pybullet", "linux", "x86_64"): {8, 9, 10, 11},
    ("pybullet-arm64", "linux", "x86_64"): {10, 11, 12, 13},
    ("pybullet-arm64", "darwin", "arm64"): {10, 11, 12, 13},
    ("pybullet-arm64", "darwin", "x86_64"): {11, 12},
    ("pybullet-arm64", "win32", "AMD64"): {10, 11, 12, 13},
}
SYSTEMS = {
    "linux": ("x86_64", "aarch64"),
    "darwin": ("arm64", "x86_64"),
    "win32": ("AMD64", "ARM64"),
}


@pytest.mark.parametrize("minor", range(8, 14))
@pytest.mark.parametrize("system", SYSTEMS)
def test_every_python_has_one_engine_and_its_wheel_where_there_is_one(system, minor):
    """pybullet and its fork install the same module."""
    where = {"sys_platform": system, "python_version": f"3.{minor}"}
    lines = (ROOT / "requirements.txt").read_text(encoding="utf-8").splitlines()
    wanted = [Requirement(line) for line in lines if line.startswith("pybullet")]
    (engine,) = [one.name for one in wanted if one.marker.evaluate(where)]
    for machine in SYSTEMS[system]:
        is_there = minor in WHEELS.get((engine, system, machine), ())
        of_any = any(
            minor in pythons for (_, *at), pythons in WHEELS.items() if at == [system, machine]
        )
        assert is_there == of_any == has_wheel((3, minor), system, machine)


@pytest.mark.parametrize("compile, status", [("", 1), ("1", 0)])
def test_an_engine_without_wheel_is_compiled_only_if_asked(compile, status, tmp_path):
    (tmp_path / "sitecustomize.py").write_text("import platform; platform.machine = lambda: 'm68k'")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "QUAD_COMPILE": compile}
    done = subprocess.run(
        [sys.executable, str(CHECK)], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == status
    assert ("QUAD_COMPILE=1" in done.stderr) == (status == 1)


def test_versions_name_the_engine_by_its_module():
    assert re.fullmatch(r"[\d.]+", versions()["pybullet"])
