"""Check that a change of the code leaves every flight as it was, bit for bit.

    python bench/same_flights.py record before.json --source ../before --barn worlds.npz
    python bench/same_flights.py compare before.json --barn worlds.npz

``record`` flies a fixed list of flights with the sources of a checkout and writes their summaries;
``compare`` flies them again and prints every value that differs. The flights are the tutorial's
mission with both configurations, each encounter, twelve robots with random goals, and five BARN
worlds if ``--barn`` names the file of worlds. Wall times and versions are not compared. A renamed
key of a summary is listed in ``RENAMED``.

Exit status: 0 if all flights are the same, 1 if one differs, 2 if one could not be flown.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

import click
import joblib

ROOT = Path(__file__).resolve().parents[1]
JITTER_M = 0.3
TIME_LIMIT_S = 600
BARN_WORLDS = "0,60,120,180,240"
NOT_COMPARED = {"wall_time_s", "real_time_factor", "versions", "differences"}  # times and prose
RENAMED: Dict[str, str] = {"params": "config"}  # key of a recorded summary -> key of today's

Summary = Dict[str, Any]


def flights(barn: Optional[Path]) -> Dict[str, List[str]]:
    """Return the arguments of ``quad`` for each flight, by the flight's name."""
    usual = ["--jitter", str(JITTER_M), "--time-limit", str(TIME_LIMIT_S)]
    listed = {
        f"mission {config} seed {seed}": ["fly", "--config", config, "--seed", str(seed), *usual]
        for config in ("default", "tutorial")
        for seed in range(1, 6)
    }
    for folder in sorted((ROOT / "goals" / "encounters").iterdir()):
        scene = ROOT / "scenes" / "encounters" / f"{folder.name}.yaml"
        if scene.exists():
            for seed in (1, 2):
                own = ["--scene", str(scene), "--goals", str(folder), "--seed", str(seed)]
                listed[f"{folder.name} seed {seed}"] = ["fly", *own, *usual]
    listed["12 robots seed 5"] = ["fly", "--robots", "12", "--seed", "5"]
    if barn is not None:
        listed["barn"] = ["barn", "--worlds", str(barn), "--only", BARN_WORLDS, "--workers", "1"]
    return listed


def fly(name: str, arguments: Sequence[str], source: Path) -> Tuple[str, Optional[Summary], str]:
    """Fly one flight with the sources of a checkout.

    Returns:
        The flight's name, its summary or None, and what ``quad`` wrote on standard error.
    """
    run = subprocess.run(
        [sys.executable, "-m", "quad_nav.cli", *arguments, "--json", "-", "--quiet"],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(source / "src")},
        check=False,
    )
    return name, json.loads(run.stdout) if run.stdout.startswith("{") else None, run.stderr


def differences(before: Any, after: Any, place: str = "") -> Iterator[str]:
    """Yield a line for each value that is not the same in two summaries."""
    if isinstance(before, dict) and isinstance(after, dict):
        before = {RENAMED.get(key, key): value for key, value in before.items()}
        for key in [*before, *(key for key in after if key not in before)]:
            if key not in NOT_COMPARED:
                yield from differences(
                    before.get(key, "absent"), after.get(key, "absent"), f"{place}/{key}"
                )
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for index, (one, other) in enumerate(zip(before, after)):
            yield from differences(one, other, f"{place}[{index}]")
    elif before != after:
        yield f"{place}: {before} before, {after} now"


def fly_all(barn: Optional[Path], source: Path, jobs: int, only: str) -> Dict[str, Summary]:
    """Fly the whole list; exit with status 2 if one of them could not be flown."""
    tasks = {name: arguments for name, arguments in flights(barn).items() if only in name}
    summaries: Dict[str, Summary] = {}
    parallel = joblib.Parallel(jobs, return_as="generator_unordered")
    for name, summary, errors in parallel(
        joblib.delayed(fly)(name, arguments, source.resolve()) for name, arguments in tasks.items()
    ):
        if summary is None:
            print(f"{name}: not flown\n{errors}", file=sys.stderr)
            sys.exit(2)
        summaries[name] = summary
    return {name: summaries[name] for name in tasks}


_FILE = click.Path(dir_okay=False, path_type=Path)
_FOLDER = click.Path(file_okay=False, path_type=Path)


@click.command()
@click.argument("action", type=click.Choice(["record", "compare"]))
@click.argument("file", type=_FILE)
@click.option("--source", type=_FOLDER, default=ROOT, help="The checkout whose sources fly.")
@click.option("--barn", type=_FILE, help="The file of the BARN worlds.")
@click.option("--jobs", type=int, default=joblib.cpu_count(), help="Flights at the same time.")
@click.option("--only", default="", metavar="TEXT", help="Flights with this text in their name.")
def main(action: str, file: Path, source: Path, barn: Optional[Path], jobs: int, only: str) -> None:
    """Record a list of flights in FILE, or compare today's with those in FILE."""
    recorded = json.loads(file.read_text(encoding="utf-8")) if action == "compare" else {}
    flown = fly_all(barn, source, jobs, only)
    if action == "record":
        file.write_text(json.dumps(flown, indent=1), encoding="utf-8")
        print(f"{len(flown)} flights recorded")
        return
    lines = [
        f"{name}{line}" for name in flown for line in differences(recorded.get(name), flown[name])
    ]
    print("\n".join([*lines, f"{len(flown)} flights, {len(lines)} values differ"]))
    sys.exit(bool(lines))


if __name__ == "__main__":
    main()
