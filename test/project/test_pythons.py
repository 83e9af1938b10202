"""Pythons that quad does not support are refused at once, with the way out."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from quad_nav.versions import versions

ROOT = Path(__file__).resolve().parents[2]
CHECK = ROOT / "scripts" / "check_python.py"
refusal = runpy.run_path(str(CHECK))["refusal"]


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


def test_requirements_have_an_engine_for_every_python():
    """pybullet and its fork install the same module, so that one of them is required."""
    text = (ROOT / "requirements.txt").read_text(encoding="utf-8")
    assert re.search(r'^pybullet>=\S+; python_version < "3.12"$', text, re.M)
    assert re.search(r'^pybullet-arm64>=\S+; python_version >= "3.12"$', text, re.M)


def test_versions_name_the_engine_by_its_module():
    assert re.fullmatch(r"[\d.]+", versions()["pybullet"])
