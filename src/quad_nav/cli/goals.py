"""``quad goals``: goal files out of other people's lists of waypoints."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import List, Optional, Tuple

import click

from quad_nav.cli import EXIT_BAD_INPUT, EXIT_SUCCESS
from quad_nav.cli.options import A_FILE, A_PATH, echo, echo_lines
from quad_nav.cli.outputs import Outputs
from quad_nav.errors import InputError
from quad_nav.files.output import write_text
from quad_nav.files.user_files import read_bytes
from quad_nav.mission.goal import goal_entry
from quad_nav.mission.goal_file import MAX_BYTES, GoalSequence, decoded, goals_of, load_goals
from quad_nav.mission.waypoint_list import read_waypoints


@click.group()
def goals() -> None:
    """Convert lists of waypoints to goal files."""


@goals.command()
@click.argument("file", type=A_FILE)
@click.option(
    "--output",
    "-o",
    type=A_PATH,
    required=True,
    metavar="FILE|FOLDER",
    help="Goal file to write; for the waypoints of several robots a folder.",
)
@click.option("--degrees", is_flag=True, help="Yaws without a unit are degrees.")
@click.option(
    "--datum",
    nargs=2,
    type=float,
    metavar="LAT LON",
    help="Position that is (0, 0) of the map. [default: home, or the first waypoint]",
)
def convert(file: Path, output: Path, degrees: bool, datum: Optional[Tuple[float, float]]) -> None:
    """Convert a list of waypoints: YAML, JSON, CSV, tuw_multi_robot or QGroundControl.

    The contents of FILE tell its format. The result flies as FILE does.

    Exit status: 0, or 1 if the output cannot be written, 2 for faults in FILE.
    """
    try:
        robots = _robots(file, degrees, datum)
        is_fleet = len(robots) > 1
        outputs = (
            Outputs({}, folders={"--output": output}) if is_fleet else Outputs({"--output": output})
        )
    except InputError as error:
        echo_lines("\n".join(error.problems), err=True)
        sys.exit(EXIT_BAD_INPUT)
    for number, sequence in enumerate(robots):
        echo(f"{file}: {sequence.read_as}", err=True)
        path = output / f"quad{number}_goals.json" if is_fleet else output
        entries = [json.dumps(goal_entry(goal)) for goal in sequence.goals]
        with outputs.attempt("--output", path):
            path.parent.mkdir(parents=True, exist_ok=True)
            write_text(path, '{"goals": [\n  ' + ",\n  ".join(entries) + "\n]}\n")
            outputs.announce("goals", path)
    sys.exit(outputs.exit_status(EXIT_SUCCESS))


def _robots(file: Path, degrees: bool, datum: Optional[Tuple[float, float]]) -> List[GoalSequence]:
    """Return the goals of each robot of a file.

    Raises:
        InputError: Every fault in it.
    """
    name = str(file)
    waypoints = read_waypoints(decoded(read_bytes(file, MAX_BYTES), name), name)
    if waypoints is None:
        load_goals(file)
        raise InputError([f"{file}: is a goal file already; expected a list of waypoints"])
    waypoints = replace(waypoints, degrees=degrees)
    if datum is not None and waypoints.datum is not None:
        waypoints = replace(waypoints, datum=datum, datum_is="--datum")
    robots: List[GoalSequence] = []
    problems: List[str] = []
    for number in range(len(waypoints.robots)):
        try:
            robots.append(goals_of(waypoints, name, robot=number))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return robots
