"""Search space: parameters of move_base, and the values that each may have.

A space is a YAML file, one entry for each parameter's path:

    TrajectoryPlannerROS/max_vel_x: {range: [0.2, 0.6]}
    TrajectoryPlannerROS/occdist_scale: {range: [0.0003, 0.03], log: true}
    TrajectoryPlannerROS/vx_samples: {range: [3, 30], integer: true}
    TrajectoryPlannerROS/dwa: {choices: [true, false]}
    "*_costmap/inflation_radius": {range: [0.4, 1.2]}     # both costmaps
    TrajectoryPlannerROS/max_vel_theta:
      range: [0.5, 1.5]
      follow: {TrajectoryPlannerROS/min_vel_theta: -1}    # times that
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import yaml

from quad_nav.errors import InputError
from quad_nav.files import plain_yaml
from quad_nav.files.document import yaml_fault
from quad_nav.files.user_files import read_text
from quad_nav.files.values import is_number

COSTMAPS = ("global_costmap", "local_costmap")
BOTH = "*_costmap"
_KEYS = {"range", "log", "integer", "choices", "follow"}
_DIGITS = 3

Values = Mapping[str, Any]
"""Path -> value, for the parameters of a space or some of them."""
Assignments = Tuple[Tuple[str, Any], ...]
"""(path, value) as move_base has them: each costmap by its own name."""


@dataclass(frozen=True)
class Dimension:
    """Searched parameter: one of ``choices``, or a number from ``low`` to ``high``.

    ``follow`` holds (path, factor) pairs of parameters whose value is this one's times the factor.
    """

    path: str
    low: float = 0.0
    high: float = 0.0
    log: bool = False
    integer: bool = False
    choices: Tuple[Any, ...] = ()
    follow: Tuple[Tuple[str, float], ...] = ()

    def rounded(self, value: Any) -> Any:
        """Round to three digits within the range."""
        if self.choices:
            return value
        if self.integer:
            return int(min(max(round(value), self.low), self.high))
        digits = _DIGITS - 1 - math.floor(math.log10(abs(value))) if value else 0
        return float(min(max(round(float(value), digits), self.low), self.high))

    def nearest(self, value: Any) -> Any:
        """Return the value of this dimension closest to ``value``."""
        if self.choices:
            return value if value in self.choices else self.choices[0]
        return self.rounded(value)


@dataclass(frozen=True)
class SearchSpace:
    """Searched parameters; ``name`` is the file's, for error messages."""

    name: str
    dimensions: Tuple[Dimension, ...]

    @property
    def paths(self) -> Tuple[str, ...]:
        """Paths of the parameters."""
        return tuple(dimension.path for dimension in self.dimensions)

    def without(self, fixed: Sequence[str]) -> SearchSpace:
        """Return the space without fixed parameters; followers among them are dropped."""
        names = {path for given in fixed for path in costmap_paths(given)}
        kept = []
        for dimension in self.dimensions:
            if not names.issuperset(costmap_paths(dimension.path)):
                follow = tuple(pair for pair in dimension.follow if pair[0] not in names)
                kept.append(replace(dimension, follow=follow))
        return replace(self, dimensions=tuple(kept))

    def assignments(self, values: Values) -> Assignments:
        """Return the values and their followers, for each costmap by its own name."""
        found: Dict[str, Any] = {}
        for dimension in self.dimensions:
            if dimension.path in values:
                value = values[dimension.path]
                found.update(dict.fromkeys(costmap_paths(dimension.path), value))
                for path, factor in dimension.follow:
                    found.update(dict.fromkeys(costmap_paths(path), _times(value, factor)))
        return tuple(found.items())

    def corners(self) -> Tuple[Dict[str, Any], Dict[str, Any]]:
        """Return the lowest and the highest values of all parameters."""
        low = {
            dimension.path: dimension.choices[0]
            if dimension.choices
            else dimension.rounded(dimension.low)
            for dimension in self.dimensions
        }
        high = {
            dimension.path: dimension.choices[-1]
            if dimension.choices
            else dimension.rounded(dimension.high)
            for dimension in self.dimensions
        }
        return low, high


def costmap_paths(path: str) -> Tuple[str, ...]:
    """Expand ``*_costmap/x`` to the path in each costmap; other paths stay alone."""
    path = "/".join(word for word in path.split("/") if word)
    first, _, rest = path.partition("/")
    return tuple(f"{name}/{rest}" for name in COSTMAPS) if first == BOTH else (path,)


def load_space(path: Path) -> SearchSpace:
    """Read a space from a file.

    Raises:
        InputError: Lists every fault of the file.
    """
    try:
        entries = plain_yaml.load(read_text(path, plain_yaml.MAX_BYTES))
    except yaml.YAMLError as error:
        raise InputError([f"{path}: cannot read: {yaml_fault(error)}"]) from error
    if not isinstance(entries, dict) or not entries:
        raise InputError(
            [
                f"{path}: expected parameters with their ranges, as "
                "TrajectoryPlannerROS/max_vel_x: {range: [0.2, 0.6]}"
            ]
        )
    problems: List[str] = []
    found = [_dimension(str(name), entry, path, problems) for name, entry in entries.items()]
    dimensions = [dimension for dimension in found if dimension is not None]
    problems += _set_twice(dimensions, path)
    if problems:
        raise InputError(problems)
    return SearchSpace(str(path), tuple(dimensions))


def _dimension(name: str, entry: Any, path: Path, problems: List[str]) -> Optional[Dimension]:
    place = f"{path}: {name}"
    if not isinstance(entry, dict) or ("range" in entry) == ("choices" in entry):
        problems.append(
            f"{place}: {entry!r}, expected {{range: [low, high]}} or {{choices: [a, b]}}"
        )
        return None
    faults = [
        f"{place}: unknown key {key}; expected {', '.join(sorted(_KEYS))}"
        for key in entry
        if key not in _KEYS
    ]
    faults += [
        f"{place}: {key}: {entry[key]!r}, expected true or false"
        for key in ("log", "integer")
        if not isinstance(entry.get(key, False), bool)
    ]
    follow = entry.get("follow", {})
    if not isinstance(follow, dict) or not all(is_number(value) for value in follow.values()):
        faults.append(f"{place}: follow: {follow!r}, expected {{path: factor}}")
    faults += _range_faults(entry, place) if "range" in entry else _choice_faults(entry, place)
    if faults:
        problems += faults
        return None
    pairs = tuple((str(other), float(factor)) for other, factor in follow.items())
    if "choices" in entry:
        return Dimension(name, choices=tuple(entry["choices"]), follow=pairs)
    low, high = map(float, entry["range"])
    return Dimension(
        name, low, high, entry.get("log", False), entry.get("integer", False), follow=pairs
    )


def _range_faults(entry: Mapping[str, Any], place: str) -> List[str]:
    bounds = entry["range"]
    if not (
        isinstance(bounds, list)
        and len(bounds) == 2
        and all(map(is_number, bounds))
        and bounds[0] < bounds[1]
    ):
        return [f"{place}: range: {bounds!r}, expected [low, high] with low < high"]
    faults = []
    if entry.get("log") is True and bounds[0] <= 0:
        faults.append(f"{place}: range: {bounds!r}, expected numbers above 0 with log: true")
    if entry.get("integer") is True and any(bound != int(bound) for bound in bounds):
        faults.append(f"{place}: range: {bounds!r}, expected whole numbers with integer: true")
    return faults


def _choice_faults(entry: Mapping[str, Any], place: str) -> List[str]:
    choices = entry["choices"]
    faults = []
    if not (
        isinstance(choices, list)
        and len(choices) > 1
        and all(isinstance(choice, (bool, int, float, str)) for choice in choices)
    ):
        faults.append(f"{place}: choices: {choices!r}, expected two values or more")
    elif entry.get("follow") and not all(map(is_number, choices)):
        faults.append(f"{place}: follow: expected choices that are numbers")
    faults += [f"{place}: {key} goes with a range" for key in ("log", "integer") if key in entry]
    return faults


def _set_twice(dimensions: Sequence[Dimension], path: Path) -> List[str]:
    """Return a fault for every parameter that more than one entry sets."""
    places: Dict[str, str] = {}
    problems = []
    for dimension in dimensions:
        for name in (dimension.path, *(other for other, _ in dimension.follow)):
            for single in costmap_paths(name):
                if single in places:
                    problems.append(
                        f"{path}: {dimension.path}: {single} is also set by "
                        f"{places[single]}; expected one entry for it"
                    )
                places.setdefault(single, dimension.path)
    return problems


def _times(value: Any, factor: float) -> Any:
    return value if factor == 1 else float(f"{value * factor:.12g}")
