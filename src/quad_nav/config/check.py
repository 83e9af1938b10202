"""Check a configuration and report its faults and remarks as a table: ``quad check``."""

from __future__ import annotations

import os
import re
import textwrap
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import tabulate

from quad_nav.config import Configuration, Remark, load
from quad_nav.config.file_sets import FileSet
from quad_nav.config.files import ParameterTree, PlacedFile
from quad_nav.config.notes import ERROR, MAPPED, ParameterError
from quad_nav.config.other_robots import input_faults
from quad_nav.config.robot_tree import fitted
from quad_nav.config.sources import load_set, sets_of
from quad_nav.errors import InputError, printable

_COSTMAPS = ("global_costmap/", "local_costmap/")
_BOTH = "*_costmap/"
_GAP = 2  # characters between the columns of a table


@dataclass(frozen=True)
class Report:
    """Faults and remarks of one set of files.

    Faults come first. A fault or remark on both costmaps that comes from one file is one line.
    """

    files: FileSet
    lines: Tuple[Remark, ...]

    @property
    def errors(self) -> int:
        """Number of faults."""
        return sum(line.kind == ERROR for line in self.lines)

    @property
    def warnings(self) -> int:
        """Number of warnings; that something of another robot is mapped is none."""
        return sum(line.kind not in (ERROR, MAPPED) for line in self.lines)


def check_source(name: str, number: Optional[str] = None) -> Tuple[List[Report], List[Path]]:
    """Check every set of files that a name stands for; see ``sources``.

    Args:
        name: A shipped configuration, a folder with the folders below it, or files.
        number: Number of the robot; None for every robot that has files of its own.

    Returns:
        A report for each set, and the YAML files of a folder that are in none of them.

    Raises:
        InputError: There is no such file or folder, or it has no move_base parameters.
    """
    sets, left = sets_of(name, number)
    return [check_set(file_set) for file_set in sets], left


def check_files(files: Sequence[PlacedFile], number: Optional[str] = None) -> Report:
    """Check files that are loaded in this order."""
    return check_set(FileSet(None, "", tuple(files), number or "0"))


def check_set(file_set: FileSet) -> Report:
    """Load a set as a simulated quadcopter does and collect the faults and remarks."""
    faults: List[Remark] = []
    remarks: Sequence[Remark] = ()
    number = int(file_set.number)
    readable = _readable(file_set, faults)
    complete = len(readable.files) == len(file_set.files)
    try:
        tree = load_set(readable) if readable.files else ParameterTree()
        configuration = load(fitted(tree, number))
        remarks = configuration.remarks
        faults += _input_faults(configuration, number) if complete else []
    except ParameterError as error:
        faults += error.faults
        remarks = error.remarks
    # Remarks mean nothing while some of the files are missing from the tree.
    lines = [*faults, *remarks] if complete else faults
    return Report(file_set, tuple(map(_in_one_line, _merged(lines))))


def _readable(file_set: FileSet, faults: List[Remark]) -> FileSet:
    """Return the set without the files that cannot be read, and add their faults."""
    readable = []
    for file in file_set.files:
        try:
            load_set(replace(file_set, files=(file,)))
            readable.append(file)
        except InputError as error:
            faults += [_fault_of_file(problem) for problem in error.problems]
    return replace(file_set, files=tuple(readable))


def _input_faults(configuration: Configuration, number: int) -> List[Remark]:
    """Return the frames and sensors that the simulation does not have: no flight starts."""
    found = input_faults(configuration.costmaps, number)
    return [Remark(path, ERROR, problem) for path, problem in dict.fromkeys(found)]


def _in_one_line(line: Remark) -> Remark:
    """Escape line ends in keys and values: each text is a cell of a table."""
    texts = (line.place, line.kind, line.text, line.origin, line.nearest)
    return Remark(*map(printable, texts))


def _fault_of_file(problem: str) -> Remark:
    """Convert a syntax error, which begins with the file's name and line."""
    origin, _, text = problem.partition(": ")
    return Remark("", ERROR, text, origin)


def report_text(report: Report, width: int = 100) -> str:
    """Format a report with its heading and files, in at most ``width`` columns."""
    files = report.files
    names = ", ".join(_seen_from(_root(files), str(file.path)) for file in files.files)
    fill = textwrap.TextWrapper(width, "  ", "  ", break_long_words=False, break_on_hyphens=False)
    parts = [
        f"{printable(_title(files))}: {counts([report])}",
        fill.fill(printable(names)),
    ]
    if report.lines:
        parts.append("\n" + table(report.lines, _root(files), width))
    return "\n".join(parts)


def counts(reports: Sequence[Report]) -> str:
    """Format the counts of reports, such as "no errors, 1 warning"."""
    errors, warnings = sum(r.errors for r in reports), sum(r.warnings for r in reports)
    return ", ".join(
        f"{number or 'no'} {noun}{'s' * (number != 1)}"
        for number, noun in ((errors, "error"), (warnings, "warning"))
    )


def table(lines: Sequence[Remark], root: str, width: int) -> str:
    """Format lines as a table of place, kind and text; paths of files are relative to ``root``."""
    header = ["parameter", "kind", "message"]
    left = width - _widest(header[1], [line.kind for line in lines]) - 2 * _GAP
    texts = _widest(header[2], [_what(line) for line in lines])
    places = _widest(header[0], [part for line in lines for part in _place(line, root, left)])
    # The column is at least as wide as its longest piece, then as wide as fits.
    place = min(places, max(left // 2, left - texts))
    for _ in range(2):
        cells = [_place(line, root, place) for line in lines]
        place = _widest(header[0], [part for cell in cells for part in cell])
    rows = [
        ["\n".join(cell), line.kind, textwrap.fill(_what(line), max(left - place, 20))]
        for cell, line in zip(cells, lines)
    ]
    return tabulate.tabulate(rows, header, tablefmt="simple", disable_numparse=True)


def _widest(header: str, cells: Sequence[str]) -> int:
    return max(len(header) + tabulate.MIN_PADDING, *map(len, cells))


def _place(line: Remark, root: str, width: int) -> List[str]:
    """Wrap the parameter's path, and file and line below it, at slashes."""
    path = _wrapped_path(line.place.lstrip("/"), width)
    if not line.origin:
        return path
    return path + _wrapped_path("  " * bool(path) + _seen_from(root, line.origin), width)


def _wrapped_path(path: str, width: int) -> List[str]:
    lines = [""]
    for piece in re.findall("[^/]*/?", path):
        if lines[-1] and len(lines[-1]) + len(piece) > width:
            lines.append("    ")
        lines[-1] += piece
    return lines if path else []


def _what(line: Remark) -> str:
    """Return the text without its kind, which has a column of its own."""
    text = line.text + (f"; did you mean {line.nearest}?" if line.nearest else "")
    for prefix in (f"{line.kind}: ", f"{line.kind} parameter, ", f"{line.kind} by move_base: "):
        if text.startswith(prefix):
            return text[len(prefix) :]
    return text


def _merged(lines: Sequence[Remark]) -> List[Remark]:
    """Merge lines that one file causes in both costmaps."""
    merged: Dict[Tuple[str, ...], Remark] = {}
    for line in lines:
        place = line.place.lstrip("/")
        costmap = next((name for name in _COSTMAPS if place.startswith(name) and line.origin), "")
        general = line
        if costmap:
            text = line.text.replace(costmap, _BOTH)
            general = replace(line, place=_BOTH + place[len(costmap) :], text=text)
        key = (general.place, general.kind, general.text, general.origin)
        if key not in merged:
            merged[key] = line
        elif merged[key] != line:
            merged[key] = general
    return list(merged.values())


def _title(files: FileSet) -> str:
    if files.folder is None:
        return files.name or f"{len(files.files)} file{'s' * (len(files.files) != 1)}"
    return f"{files.folder}, {files.name}" if files.name else str(files.folder)


def _root(files: FileSet) -> str:
    """Return the folder of all files of a set, "" for files that were named."""
    if files.folder is None:
        return ""
    return os.path.commonpath([file.path.parent for file in files.files])


def _seen_from(root: str, path: str) -> str:
    prefix = f"{root}/"
    return path[len(prefix) :] if root and path.startswith(prefix) else path
