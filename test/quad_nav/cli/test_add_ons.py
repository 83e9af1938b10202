"""The command `quad` where the core is installed alone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SOURCES = Path(__file__).resolve().parents[3] / "src"


@pytest.fixture
def quad(tmp_path):
    """Run a command with no package of the project but the core."""
    (tmp_path / "quad_nav").symlink_to(SOURCES / "quad_nav")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}

    def run(*arguments):
        command = [sys.executable, "-m", "quad_nav.cli", *arguments]
        return subprocess.run(
            command, capture_output=True, text=True, env=environment, cwd=tmp_path
        )

    return run


@pytest.mark.parametrize(
    "command, package, extra",
    [("tune", "quad_tune", "[tune]"), ("barn", "quad_bench", ""), ("replay", "quad_web", "[web]")],
)
def test_a_command_of_an_add_on_says_how_to_get_it(quad, command, package, extra):
    refused = quad(command, "--help")
    assert refused.returncode == 1
    assert refused.stderr == (
        f"Error: quad {command}: {package} is not installed; "
        f"expected it from pip install 'quad-nav{extra}', or in a checkout from make venv\n"
    )


def test_the_page_of_a_flight_says_how_to_get_it(quad):
    refused = quad("fly", "--web")
    assert refused.returncode == 1
    assert "--web: quad_web is not installed" in refused.stderr


def test_commands_of_the_core_need_no_add_on(quad):
    listed = quad("--help").stdout
    assert "tune" in listed and "barn" in listed
    checked = quad("check", "tutorial")
    assert checked.returncode == 0, checked.stderr


@pytest.mark.parametrize("command", ["fly --report a.html", "report a.bag", "preview"])
def test_reports_say_how_to_get_what_they_draw_with(quad, command, tmp_path):
    (tmp_path / "matplotlib.py").write_text("raise ModuleNotFoundError(name='matplotlib')")
    (tmp_path / "a.bag").touch()
    refused = quad(*command.split())
    assert refused.returncode == 1
    assert "matplotlib is not installed; expected it from pip install " in refused.stderr
    assert refused.stdout == ""
