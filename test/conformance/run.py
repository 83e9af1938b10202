#!/usr/bin/env python3
"""Compares this package with what the original computed, on any folder of recordings.

    test/conformance/run.py [FOLDER]

Exit status: 0 when every case agrees, 1 when one does not or was not compared, 2 when there
is no folder or nothing in it.

A case is not compared when nothing here knows its family, when it cannot be read, when the
index names it and there is no file, or when there is a file and the index does not name it.
Each is named, and counted among the cases.
"""

from __future__ import annotations

import argparse
import sys
import traceback
from dataclasses import dataclass, field
from pathlib import Path
from typing import List, Tuple

import tabulate

_TEST = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(_TEST.parent / "src"), str(_TEST)]

from families import DATA, FAMILIES, Difference, InvalidValue, cases, missing_cases  # noqa: E402
from families.case import recordings_in  # noqa: E402

EXIT_AGREES, EXIT_DIFFERS, EXIT_UNUSABLE = 0, 1, 2


@dataclass
class Result:
    """A family's outcome: the cases that failed, each with its first difference, and why
    others were not compared."""

    family: str
    cases: int = 0
    passed: int = 0
    failed: List[Tuple[str, Difference]] = field(default_factory=list)
    not_compared: List[str] = field(default_factory=list)
    note: str = ""

    def row(self) -> List[object]:
        if self.note:
            return [self.family, self.cases or "-", "-", self.note, "", ""]
        case, difference = self.failed[0] if self.failed else ("", Difference("", ""))
        return [self.family, self.cases, self.passed, case, difference.field, difference.text]


def run_family(family: str, data: Path) -> Result:
    """Compares every case of a family."""
    try:
        paths, missing = cases(family, data), missing_cases(family, data)
    except InvalidValue as error:
        return _not_compared(family, data, f"{error}", "cannot be read, not compared")
    if not paths and not missing:
        return Result(family, note="not in this folder")
    result = Result(family, len(paths) + len(missing), not_compared=missing)
    for path in paths:
        try:
            differences = FAMILIES[family](path)
        except InvalidValue as error:
            result.not_compared.append(f"{path}: {error}")
            continue
        except Exception as error:  # what ours raises, whatever it is, is a failure of the case
            traceback.print_exc()
            differences = [Difference("(raised)", f"{type(error).__name__}: {error}")]
        if differences:
            result.failed.append((path.stem, differences[0]))
        else:
            result.passed += 1
    return result


def unknown_families(data: Path) -> List[Result]:
    """Folders of recordings that nothing here compares."""
    return [
        _not_compared(path.name, data, f"{path}: unknown family", "unknown family, not compared")
        for path in sorted(data.iterdir())
        if path.name not in FAMILIES
        if (path / "index.json").is_file() or recordings_in(path)
    ]


def _not_compared(family: str, data: Path, reason: str, note: str) -> Result:
    """The result of a family of which no case was compared: it counts as one at least."""
    count = max(1, len(recordings_in(data / family)))
    return Result(family, count, not_compared=[f"{reason} ({count} cases)"], note=note)


def run(data: Path) -> int:
    """Runs all families over a folder, prints the outcome and returns the exit status."""
    if not data.is_dir():
        print(f"{data}: no such folder; expected one of recordings", file=sys.stderr)
        return EXIT_UNUSABLE
    results = [run_family(family, data) for family in FAMILIES] + unknown_families(data)
    print(
        tabulate.tabulate(
            [result.row() for result in results],
            ["family", "cases", "passed", "first failure", "field", "difference"],
            tablefmt="simple",
            maxcolwidths=[None, None, None, 28, 20, 30],
            colalign=("left", "right", "right", "left", "left", "left"),
            disable_numparse=True,
        )
    )
    total, passed = sum(r.cases for r in results), sum(r.passed for r in results)
    if not total:
        print(f"{data}: there are no recordings in it that could be compared", file=sys.stderr)
        return EXIT_UNUSABLE
    not_compared = total - passed - sum(len(result.failed) for result in results)
    rest = f", {not_compared} were not compared" if not_compared else ""
    print(f"\n{passed} of {total} cases agree{rest}.")
    for line in (line for result in results for line in result.not_compared):
        print(f"not compared: {line}", file=sys.stderr)
    return EXIT_AGREES if passed == total else EXIT_DIFFERS


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "folder",
        nargs="?",
        type=Path,
        default=DATA,
        help="recordings: a folder for each family (default: %(default)s)",
    )
    return run(parser.parse_args().folder)


if __name__ == "__main__":
    sys.exit(main())
