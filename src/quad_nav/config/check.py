"""What is to be said about somebody's move_base parameters, as a table: ``quad check``."""

from __future__ import annotations

import os
import re
import textwrap
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import tabulate

from quad_nav.config import Remark, load, load_files
from quad_nav.config.file_sets import FileSet, file_sets
from quad_nav.config.files import PlacedFile
from quad_nav.config.notes import ERROR, ParameterError
from quad_nav.errors import InputError

_COSTMAPS = ("global_costmap/", "local_costmap/")
_BOTH = "*_costmap/"
_GAP = 2  # characters between the columns of a table
_ROOM = 50  # characters for place and what, below which there is no column of nearest names


@dataclass(frozen=True)
class Report:
    """One set of files: every fault first, then every remark; what a common file brings into
    both costmaps once."""

    files: FileSet
    lines: Tuple[Remark, ...]

    @property
    def errors(self) -> int:
        return sum(line.kind == ERROR for line in self.lines)

    @property
    def warnings(self) -> int:
        return len(self.lines) - self.errors


def check_folder(folder: Path, number: Optional[str] = None) -> Tuple[List[Report], List[Path]]:
    """A report on every set of files in a folder, and the YAML files that are in none.

    Raises:
        InputError: there are no move_base parameters in the folder.
    """
    sets, left = file_sets(folder, number)
    if not sets:
        raise InputError(
            [
                f"{folder}: no move_base parameters in it; expected files such as"
                " costmap_common_params.yaml"
            ]
        )
    return [check_set(file_set) for file_set in sets], left


def check_files(files: Sequence[PlacedFile], number: Optional[str] = None) -> Report:
    """A report on files that are loaded in this order."""
    return check_set(FileSet(None, "", tuple(files), number or "0"))


def check_set(file_set: FileSet) -> Report:
    """Loads a set as a navigator would, and keeps all that was said."""
    substitutions = {"i": file_set.number}
    faults: List[Remark] = []
    readable = []
    for file in file_set.files:
        try:
            load_files([file], substitutions)
            readable.append(file)
        except InputError as error:
            faults += [_fault_of_file(problem) for problem in error.problems]
    try:
        remarks = load(load_files(readable, substitutions)).remarks
    except ParameterError as error:
        faults += error.faults
        remarks = error.remarks
    # Without the files that cannot be read it can't be known what else is odd.
    lines = faults if len(readable) < len(file_set.files) else [*faults, *remarks]
    return Report(file_set, tuple(_merged(lines)))


def _fault_of_file(problem: str) -> Remark:
    """Faults in the writing of a file begin with its name and line."""
    origin, _, text = problem.partition(": ")
    return Remark("", ERROR, text, origin)


def report_text(report: Report, width: int = 100) -> str:
    """The report with its heading and its files, in at most ``width`` columns."""
    files = report.files
    names = ", ".join(_seen_from(_root(files), str(file.path)) for file in files.files)
    parts = [
        f"{_title(files)}: {counts([report])}",
        textwrap.fill(
            names,
            width,
            initial_indent="  ",
            subsequent_indent="  ",
            break_long_words=False,
            break_on_hyphens=False,
        ),
    ]
    if report.lines:
        parts.append("\n" + table(report.lines, _root(files), width))
    return "\n".join(parts)


def counts(reports: Sequence[Report]) -> str:
    """As in "no errors, 1 remark"."""
    errors, remarks = sum(r.errors for r in reports), sum(r.warnings for r in reports)
    return ", ".join(
        f"{number or 'no'} {noun}{'s' * (number != 1)}"
        for number, noun in ((errors, "error"), (remarks, "remark"))
    )


def table(lines: Sequence[Remark], root: str, width: int) -> str:
    """Place, kind, what, and the nearest known name if there is any and room for it.

    Files are named as they are seen from the folder ``root``.
    """
    header = ["place", "kind", "what", "nearest name"]
    kinds = _widest(header[1], [line.kind for line in lines])
    nearest = _widest(header[3], [line.nearest for line in lines])
    left = width - kinds - nearest - 3 * _GAP
    with_nearest = left >= _ROOM and any(line.nearest for line in lines)
    if not with_nearest:
        left += nearest + _GAP
        lines = [
            replace(line, text=line.text + f"; did you mean {line.nearest}?")
            if line.nearest
            else line
            for line in lines
        ]
    whats = _widest(header[2], [_what(line) for line in lines])
    places = _widest(header[0], [part for line in lines for part in _place(line, root, left)])
    # As wide as its longest piece that cannot be cut, and then as much as fits into that.
    place = min(places, max(left // 2, left - whats))
    for _ in range(2):
        cells = [_place(line, root, place) for line in lines]
        place = _widest(header[0], [part for cell in cells for part in cell])
    left -= place
    rows = [
        ["\n".join(cell), line.kind, textwrap.fill(_what(line), max(left, 20)), line.nearest]
        for cell, line in zip(cells, lines)
    ]
    columns = 4 if with_nearest else 3
    return tabulate.tabulate(
        [row[:columns] for row in rows], header[:columns], tablefmt="simple", disable_numparse=True
    )


def _widest(header: str, cells: Sequence[str]) -> int:
    return max(len(header) + tabulate.MIN_PADDING, *map(len, cells))


def _place(line: Remark, root: str, width: int) -> List[str]:
    """The parameter's path and below it its file and line, cut at slashes where too long."""
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
    """The text without its kind, which stands beside it."""
    for prefix in (f"{line.kind}, ", f"{line.kind}: ", f"{line.kind} by move_base: "):
        if line.text.startswith(prefix):
            return line.text[len(prefix) :]
    return line.text


def _merged(lines: Sequence[Remark]) -> List[Remark]:
    """What a common file brings into both costmaps is told once."""
    merged: Dict[Tuple[str, ...], Remark] = {}
    for line in lines:
        place = line.place.lstrip("/")
        costmap = next((name for name in _COSTMAPS if place.startswith(name) and line.origin), "")
        general = (
            replace(
                line, place=_BOTH + place[len(costmap) :], text=line.text.replace(costmap, _BOTH)
            )
            if costmap
            else line
        )
        key = (general.place, general.kind, general.text, general.origin)
        if key not in merged:
            merged[key] = line
        elif merged[key] != line:
            merged[key] = general
    return list(merged.values())


def _title(files: FileSet) -> str:
    if files.folder is None:
        return f"{len(files.files)} file{'s' * (len(files.files) != 1)}"
    return f"{files.folder}, {files.name}" if files.name else str(files.folder)


def _root(files: FileSet) -> str:
    """The folder that holds all files of a set that was found; files given keep their names."""
    if files.folder is None:
        return ""
    return os.path.commonpath([file.path.parent for file in files.files])


def _seen_from(root: str, path: str) -> str:
    prefix = f"{root}/"
    return path[len(prefix) :] if root and path.startswith(prefix) else path
