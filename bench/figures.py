"""Figures of a bench run in a file, and the comparison of two such files.

    python bench/figures.py before.json after.json

A script adds what it has measured: a name, a unit, whether smaller or larger is better, and the
value of every repetition. Several scripts write into one file, which also has the machine, the
commit and the versions.

The comparison shows the medians. A figure's spread is half the range between the quartiles of its
repetitions. A change counts if it is larger than both files' spreads together and larger than the
tolerance. A figure with one repetition has no spread: the tolerance alone decides.

Exit status: 0 if nothing got slower, 1 if something did, 2 if a file cannot be compared.
"""

from __future__ import annotations

import json
import math
import os
import platform
import statistics
import subprocess
import sys
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

import click
from tabulate import tabulate

from quad_nav.errors import printable
from quad_nav.versions import versions

ROOT = Path(__file__).resolve().parents[1]
FORMAT = "quad bench 1"
JSON_HELP = "Add the figures to this file, see bench/figures.py."
SMALLER, LARGER = "smaller", "larger"
TOLERANCE_PERCENT = 5.0
LOADED = 0.5  # load average per core from which times are in doubt
WORDS = {"MB": ("larger", "smaller")}  # worse and better; else slower and faster


class BadFile(Exception):
    """A file that has no figures to compare."""


@dataclass(frozen=True)
class Figure:
    """One measured quantity.

    Attributes:
        name: Unique in its script.
        unit: Of the values: "ms", "MB", "1/s", ...; "" for a ratio.
        better: ``SMALLER`` or ``LARGER``.
        values: One for each repetition.
    """

    name: str
    unit: str
    better: str
    values: Tuple[float, ...]

    def __post_init__(self) -> None:
        if self.better not in (SMALLER, LARGER):
            raise ValueError(f"{self.name}: better is {self.better!r}, not smaller or larger")
        if not self.values or not all(math.isfinite(value) for value in self.values):
            raise ValueError(f"{self.name}: expected finite values")

    @property
    def median(self) -> float:
        """Median of the repetitions."""
        return statistics.median(self.values)

    @property
    def spread(self) -> float:
        """Half the range between the quartiles; 0 for one repetition."""
        if len(self.values) == 1:
            return 0.0
        low, _, high = statistics.quantiles(self.values, n=4, method="inclusive")
        return (high - low) / 2.0


class Figures:
    """The figures of one run of a script."""

    def __init__(self, script: str) -> None:
        """Begin a run, with the load average before it."""
        self.script = script
        self.load_average = os.getloadavg()[0]
        self.figures: List[Figure] = []

    def add(self, name: str, unit: str, values: Sequence[float], better: str = SMALLER) -> float:
        """Add a figure with the value of each repetition; return the median."""
        figure = Figure(name, unit, better, tuple(float(value) for value in values))
        self.figures.append(figure)
        return figure.median

    def write(self, file: Optional[Path]) -> None:
        """Add the figures to a file, in place of those of the same script; None writes nothing.

        A new file is made. Exits with status 2 if the file is of another commit, or no such file.
        """
        if file is None:
            return
        facts = run_facts()
        if file.exists():
            try:
                kept = load(file)
            except BadFile as error:
                stop(str(error))
            if kept["commit"] != facts["commit"]:
                stop(f"{file} has figures of commit {kept['commit']}, this is {facts['commit']}")
            facts = kept
        facts["scripts"][self.script] = {
            "load_average": self.load_average,
            "figures": [
                {**asdict(one), "median": one.median, "spread": one.spread} for one in self.figures
            ],
        }
        file.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")


def stop(reason: str) -> None:
    """Exit with status 2."""
    print(f"bench: {printable(reason)}", file=sys.stderr)
    sys.exit(2)


def run_facts() -> Dict[str, Any]:
    """Return a file's content without figures: format, date, commit, versions and machine."""
    return {
        "format": FORMAT,
        "date": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "commit": git("rev-parse", "HEAD"),
        "uncommitted_changes": bool(git("status", "--porcelain", "--untracked-files=no")),
        "versions": versions(),
        "machine": {
            "cpu": cpu_model(),
            "cores": len(os.sched_getaffinity(0)),
            "memory_mb": os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 10**6,
            "system": f"{platform.system()} {platform.release()}",
        },
        "scripts": {},
    }


def git(*arguments: str) -> str:
    """Return what a git command prints, "" outside of a checkout."""
    try:
        run = subprocess.run(
            ["git", "-C", str(ROOT), *arguments], capture_output=True, text=True, check=False
        )
    except FileNotFoundError:
        return ""
    return run.stdout.strip()


def cpu_model() -> str:
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.machine()


def load(file: Path) -> Dict[str, Any]:
    """Read a file.

    Raises:
        BadFile: It cannot be read, or it is of another format.
    """
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadFile(f"{file}: {error}") from error
    is_ours = isinstance(content, dict) and content.get("format") == FORMAT
    if not is_ours or not isinstance(content.get("machine"), dict):
        raise BadFile(f"{file}: expected a file of `make bench`, with the format {FORMAT!r}")
    return content


def figures_of(file: Path, content: Dict[str, Any]) -> Dict[Tuple[str, str], Figure]:
    """Return the figures of a file by script and name.

    Raises:
        BadFile: A figure is incomplete.
    """
    found = {}
    try:
        for script, part in content["scripts"].items():
            float(part["load_average"])
            for one in part["figures"]:
                values = tuple(float(value) for value in one["values"])
                figure = Figure(str(one["name"]), str(one["unit"]), one["better"], values)
                found[script, figure.name] = figure
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise BadFile(f"{file}: a figure is incomplete: {error!r}") from error
    return found


@dataclass(frozen=True)
class Change:
    """A figure in two runs.

    Attributes:
        percent: Change of the median in percent of the earlier one.
        noise_percent: Both spreads together, in percent of the earlier median.
        verdict: -1 if it is worse, 1 if it is better, 0 if the change does not count.
    """

    percent: float
    noise_percent: float
    verdict: int


def change(before: Figure, after: Figure, tolerance_percent: float = TOLERANCE_PERCENT) -> Change:
    """Compare a figure of two runs."""
    difference, noise = after.median - before.median, before.spread + after.spread
    if before.median == 0.0:
        percent = math.copysign(math.inf, difference) if difference else 0.0
        noise_percent = math.inf if noise else 0.0
    else:
        percent = 100.0 * difference / abs(before.median)
        noise_percent = 100.0 * noise / abs(before.median)
    counts = abs(difference) > noise and abs(percent) > tolerance_percent
    is_better = (difference < 0.0) == (before.better == SMALLER)
    return Change(percent, noise_percent, (1 if is_better else -1) if counts else 0)


def compare(before_file: Path, after_file: Path, tolerance_percent: float) -> int:
    """Print a table of all figures that both files have; return the exit status.

    Raises:
        BadFile: A file cannot be read, or they have no figure in common.
    """
    contents = load(before_file), load(after_file)
    before, after = (
        figures_of(file, content) for file, content in zip((before_file, after_file), contents)
    )
    common = [key for key in before if key in after and before[key].unit == after[key].unit]
    if not common:
        raise BadFile(f"{before_file} and {after_file} have no figure in common")
    rows, counts = [], {-1: 0, 0: 0, 1: 0}
    for script, name in common:
        one, other = before[script, name], after[script, name]
        found = change(one, other, tolerance_percent)
        counts[found.verdict] += 1
        worse, better = WORDS.get(one.unit, ("slower", "faster"))
        rows.append(
            (
                printable(f"{script}: {name}" + (f", {one.unit}" if one.unit else "")),
                f"{one.median:.4g}",
                f"{other.median:.4g}",
                f"{found.percent:+.1f}",
                f"{found.noise_percent:.1f}",
                {-1: worse.upper(), 0: "", 1: better}[found.verdict],
            )
        )
    header = ("figure", "before", "after", "change %", "noise %", "")
    align = ("left", *["right"] * 4, "left")
    print(tabulate(rows, header, disable_numparse=True, colalign=align))
    print("\n".join(remarks(contents, [*(before.keys() ^ after.keys())])))
    print(
        f"{counts[-1]} worse, {counts[1]} better, {counts[0]} the same within "
        f"{tolerance_percent:g} % or the noise"
    )
    return 1 if counts[-1] else 0


def remarks(contents: Sequence[Dict[str, Any]], lone: Sequence[Tuple[str, str]]) -> List[str]:
    """Return what makes a comparison doubtful: other machines or versions, load, lone figures."""
    lines = []
    for title, content in zip(("before", "after"), contents):
        machine = content["machine"]
        lines.append(
            f"{title}: {content.get('date')}, commit {str(content.get('commit'))[:9]}"
            f"{' with changes' if content.get('uncommitted_changes') else ''}, "
            f"{machine.get('cores')} x {machine.get('cpu')}"
        )
        for script, part in content["scripts"].items():
            load_average = float(part["load_average"])
            if load_average > LOADED * float(machine.get("cores", 1)):
                lines.append(f"{title}: {script} began at a load average of {load_average:.1f}")
    for key in ("machine", "versions"):
        if contents[0].get(key) != contents[1].get(key):
            lines.append(f"not the same {key}: {contents[0].get(key)} and {contents[1].get(key)}")
    lines += [f"in one file alone: {script}: {name}" for script, name in sorted(lone)]
    return [printable(line) for line in lines]


@click.command(help=__doc__.split("\n\n")[3])
@click.argument("before", type=click.Path(path_type=Path))
@click.argument("after", type=click.Path(path_type=Path))
@click.option(
    "--tolerance",
    "tolerance_percent",
    type=click.FloatRange(min=0.0),
    default=TOLERANCE_PERCENT,
    show_default=True,
    help="A smaller change in percent does not count.",
)
def main(before: Path, after: Path, tolerance_percent: float) -> None:
    try:
        sys.exit(compare(before, after, tolerance_percent))
    except BadFile as error:
        stop(str(error))


if __name__ == "__main__":
    main()
