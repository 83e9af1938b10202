"""Comparison with the recordings of upstream move_base, family by family.

A family is a folder of recorded cases, all of one kind. Its module here has
``check(path)``: it computes a case anew and returns the differences, none of
which is wanted. The tests and ``run.py`` both call it. For another family write
``<family>.py`` with a ``check`` in the way of ``inflation.py``, and name it in ``FAMILIES``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Callable, Dict, List

from families import (
    amcl,
    amcl_sequence,
    carrot_planner,
    defaults,
    dwa,
    global_planner,
    inflation,
    layered,
    navfn,
    occupancy,
    recovery,
    trajectory_planner,
)
from families.case import InvalidValue, named_in, recordings_in
from families.comparison import Difference

Check = Callable[[Path], List[Difference]]

FAMILIES: Dict[str, Check] = {
    "defaults": defaults.check,
    "inflation": inflation.check,
    "navfn": navfn.check,
    "obstacle": layered.check,
    "static": layered.check,
    "voxel": layered.check,
    "recovery": recovery.check,
    "occupancy": occupancy.check,
    "trajectory_planner": trajectory_planner.check,
    "dwa": dwa.check,
    "global_planner": global_planner.check,
    "carrot_planner": carrot_planner.check,
    "amcl_likelihood_field": amcl.check_field,
    "amcl_sensor": amcl.check_sensor,
    "amcl_motion": amcl.check_motion,
    "amcl_filter": amcl.check_filter,
    "amcl_sequence": amcl_sequence.check,
}
DATA = Path(__file__).resolve().parents[1] / "data"

__all__ = ["DATA", "FAMILIES", "Check", "Difference", "InvalidValue", "cases", "missing_cases"]


def cases(family: str, data: Path = DATA) -> List[Path]:
    """The files of a family's cases; none when ``data`` does not have the family.

    Raises:
        InvalidValue: the family is there and can't be read.
    """
    if family == "defaults":
        file = data / "defaults.json"
        return [file] if file.is_file() else []
    folder = data / family
    return [path for path in named_in(folder) if path.is_file()] if folder.is_dir() else []


def missing_cases(family: str, data: Path) -> List[str]:
    """Compare the index and the files of a family: a line for each case that one of them lacks.

    Raises:
        InvalidValue: the family is there and can't be read.
    """
    folder = data / family
    if family == "defaults" or not folder.is_dir():
        return []
    named = named_in(folder)
    return [
        *(
            f"{path}: the index names it, and there is no such file"
            for path in named
            if not path.is_file()
        ),
        *(
            f"{path}: the index does not name it"
            for path in recordings_in(folder)
            if path not in named
        ),
    ]
