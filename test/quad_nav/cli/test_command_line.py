"""Start of the command line: its help without the engine, suggestions, and a quiet flight."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from quad_nav.cli import COMMANDS, main
from quad_nav.cli.fly import LIDAR_CASTERS
from quad_nav.files.shipped import config_names
from quad_nav.sim import simulation_params

SOURCES = Path(__file__).resolve().parents[3] / "src"
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
    for name, (package, line) in COMMANDS.items():
        assert f"  {name:{max(map(len, COMMANDS))}}  {line}\n" in text
        if importlib.util.find_spec(package) is None:
            continue
        command = main.get_command(click.Context(main), name)
        assert command is not None and command.name == name


def test_help_has_groups_an_example_and_every_configuration():
    text = CliRunner().invoke(main, ["fly", "--help"], env={"COLUMNS": "80"}).output
    assert re.findall(r"^(\w[\w ]*):$", text, re.MULTILINE) == [
        "Mission",
        "Robots",
        "Simulation",
        "Output",
        "Page in the browser",
    ]
    assert "\n    quad fly --scene office.yaml" in text and "docs/offline.md" in text
    assert all(f"'{name}'" in text for name in config_names())


@pytest.mark.parametrize(
    "words, fault",
    [
        ("fly --robots abc", "'abc' is not a valid integer."),
        ("circle --radius abc", "'abc' is not a valid number."),
        ("fly --report x.txt", "flight not started, invalid input:\n  --report: x.txt: expected a"),
        ("report nope.bag -o x.txt", "--output: x.txt: expected a name that ends in .html or .htm"),
        (
            "fly --odom-drift perm=1",
            "perm=1: expected any of per_m=, per_rad=, speed=, turn=, slip= ",
        ),
        ("sweep", "sweep not started, invalid input:\n  expected --over"),
        ("preview -o x.txt", "preview not made, invalid input:\n  --output: x.txt: expected a"),
        ("check defalt", "config: defalt: expected a folder, a YAML file, a launch file, or the"),
        ("check defalt", "did you mean default?"),
        ("check nope", "there are barn, default, localized, moving, people, tutorial"),
        ("check nope.yaml", "cannot be read: No such file or directory"),
    ],
)
def test_what_is_refused_and_why(words, fault):
    done = CliRunner().invoke(main, words.split())
    assert done.exit_code == 2 and fault in done.output


def test_ctrl_c_before_the_flight(monkeypatch):
    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr("quad_nav.cli.offline_flight.read_setup", interrupt)
    done = CliRunner().invoke(main, ["fly"])
    assert (done.exit_code, done.output) == (130, "interrupted\n")


def test_constants_of_the_options_are_those_of_the_engine():
    assert simulation_params.LIDAR_CASTERS == LIDAR_CASTERS


@pytest.mark.parametrize("word, hint", [("fli", "did you mean 'fly'?"), ("zzz", "see quad --help")])
def test_unknown_command_names_the_nearest(word, hint):
    done = CliRunner().invoke(main, [word])
    assert done.exit_code == 2
    assert done.output.splitlines()[-1] == f"Error: no command {word!r}; {hint}"


def test_engine_prints_nothing_when_it_is_imported_also_without_standard_error():
    for close in ("", "import os; os.close(2); "):
        done = python(f"{close}import quad_nav.sim.body; print(1)")
        assert (done.returncode, done.stdout, done.stderr) == (0, "1\n", "")


WITHOUT_EFFECT = [
    ("TrajectoryPlannerROS/max_vel_xx=0.2", "did you mean max_vel_x?"),
    ("global_costmap/inflation_radus=0.5", "did you mean inflation_radius?"),
    ("nowhere/width=3", "/nowhere"),
    ("DWAPlannerROS/max_vel_x=0.3", "unused: base_local_planner is"),
]


@pytest.mark.parametrize("parameter, fault", WITHOUT_EFFECT)
def test_parameters_without_effect_are_refused(parameter, fault):
    assert_refused("fly", parameter, fault)


def assert_refused(command, parameter, fault):
    done = CliRunner().invoke(main, [*command.split(), "--set", parameter, "-q"])
    assert done.exit_code == 2, done.output
    assert fault in done.output and " not started, invalid input:" in done.output


@pytest.mark.parametrize(
    "words, fault",
    [
        ("--robots 1000", "robots: is 1000; expected a whole number, 1 to 100"),
        ("--robots 3 --size 10000", "size: is 10000.0; expected a number of metres, 0 to 250"),
    ],
)
def test_missions_that_take_minutes_to_make_are_refused(words, fault):
    done = CliRunner().invoke(main, ["fly", *words.split()])
    assert done.exit_code == 2 and fault in done.output


@pytest.mark.parametrize("quiet", [[], ["-q"]])
def test_every_output_is_announced(tmp_path, quiet):
    summary, recording = tmp_path / "flight.json", tmp_path / "flight.bag"
    command = ["fly", "--time-limit", "0.1", "--json", str(summary), "--record", str(recording)]
    done = CliRunner().invoke(main, [*command, *quiet])
    assert summary.exists() and recording.exists()
    lines = done.output.splitlines()
    announced = [f"json: {summary}", f"record: {recording}"]
    assert [line for line in lines if line in announced] == ([] if quiet else announced)
    assert lines == [] or not quiet
