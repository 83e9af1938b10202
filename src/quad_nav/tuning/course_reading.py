"""Which course the options ask for, read and checked."""

from __future__ import annotations

from dataclasses import replace
from typing import Sequence, Tuple, Union

from quad_nav.barn.setup import BarnOptions
from quad_nav.tuning.barn_course import BarnCourse
from quad_nav.tuning.courses import MissionCourse, MissionOptions, check_missions
from quad_nav.tuning.evaluation import Course

CourseOptions = Union[MissionOptions, BarnOptions]


def read_course(given: CourseOptions) -> Tuple[Course, Sequence[str]]:
    """What is flown, and the warnings about it.

    Raises:
        InputError: every fault.
    """
    if isinstance(given, BarnOptions):
        barn = BarnCourse(given)
        return barn, barn.warnings
    return MissionCourse(given), check_missions(given)


def with_config(given: CourseOptions, name: str) -> CourseOptions:
    """The same flights with another folder of parameters as it is."""
    if isinstance(given, BarnOptions):
        return replace(given, params=name, parameters=())
    return replace(given, config=name, parameters=())
