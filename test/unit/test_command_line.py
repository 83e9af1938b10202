"""Start of the command line: its help without the engine, suggestions, and a quiet flight."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from quad_nav.cli import COMMANDS, main
from quad_nav.cli.fly import LIDAR_CASTERS, MAX_DRIFT
from quad_nav.sim import odometry, simulation

SOURCES = Path(__file__).resolve().parents[2] / "src"
ENGINE = ("numpy", "numba", "pybullet", "scipy", "matplotlib", "joblib", "optuna", "rich.progress")

_MODULES = """
import sys
from quad_nav.cli import main
try:
    main({arguments!r}, prog_name="quad")
except SystemExit as ended:
    print(ended.code, *(name for name in {engine!r} if name in sys.modules), file=sys.stderr)
"""


def python(code, **options):
    """Run code in a new interpreter with the sources."""
    code = f"import sys; sys.path.insert(0, {str(SOURCES)!r})\n{code}"
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, **options
    )


@pytest.mark.parametrize("arguments", [[], ["--help"], ["--version"], ["fli"], ["fly", "--help"]])
def test_help_does_not_import_the_engine(arguments):
    done = python(_MODULES.format(arguments=arguments, engine=ENGINE))
    status = "2" if arguments == ["fli"] else "0"
    assert done.stderr.splitlines()[-1] == status, done.stderr


def test_every_command_is_listed_with_its_own_text():
    text = CliRunner().invoke(main, []).output
    for name, line in COMMANDS.items():
        assert f"  {name:7}  {line}\n" in text
        command = main.get_command(click.Context(main), name)
        assert command is not None and command.name == name


def test_constants_of_the_options_are_those_of_the_engine():
    assert simulation.LIDAR_CASTERS == LIDAR_CASTERS
    assert odometry.MAX_DRIFT == MAX_DRIFT


@pytest.mark.parametrize(
    "word, hint",
    [
        ("fli", "no command 'fli'; did you mean 'fly'?"),
        ("reprot", "no command 'reprot'; did you mean 'report'?"),
        ("zzz", "no command 'zzz'; see quad --help"),
    ],
)
def test_unknown_command_names_the_nearest(word, hint):
    done = CliRunner().invoke(main, [word])
    assert (done.exit_code, done.output.splitlines()[-1]) == (2, f"Error: {hint}")


def test_engine_prints_nothing_when_it_is_imported():
    done = python("import quad_nav.sim.body")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_engine_is_imported_without_standard_error():
    done = python("import os; os.close(2); import quad_nav.sim.body; print(1)")
    assert (done.returncode, done.stdout) == (0, "1\n")
