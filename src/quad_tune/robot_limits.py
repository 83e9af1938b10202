"""Parameters that describe the robot and its task, which a search must not change.

Two groups, told apart by the parameter's name in any namespace, so that planners from plugins are
covered too:

* Limits of the robot: speeds, accelerations, and whether it flies sideways. A search that may raise
  them finds that faster is better. They are searched only with ``--free-speed``.
* Protected parameters: footprint, goal tolerances, checks of sensors and peers. The score cannot
  see what a search gains by weakening them: a goal that is reached less exactly counts as reached,
  and no sensor fails in the flights of a study. They are never searched.

The inflation of obstacles is in neither group: it is a preference, and the score measures contacts
and gaps in the simulated world.
"""

from __future__ import annotations

import re
from typing import List, NamedTuple, Sequence, Tuple

from quad_nav.config.fixes import GROUPS
from quad_tune.space import Dimension, SearchSpace

_SPEED = re.compile(
    r"(^|_)(vels?|velocity|velocities|speeds?|acc|accel|acceleration|decel|deceleration)(_|$)"
)
_OTHER_LIMITS = ("holonomic_robot", "base_local_planner")  # another planner has its own limits
_PROTECTED = re.compile(
    r"footprint.*|robot_radius|(in|circum)scribed_radius|.*tolerance|expected_update_rate"
    r"|(trans|rot|theta)_stopped_vel(ocity)?|scaling_speed|max_scaling_factor"
    r"|sensor_timeout|escape_collision|plan_inside_map|respect_meter_scoring|reject_implausible_scans"
    r"|progress_(timeout|distance)|stuck_cost_factor"
)


class HeldSpace(NamedTuple):
    """Search space without the limits of the robot, and the paths of these limits."""

    space: SearchSpace
    held: Tuple[str, ...]


def is_limit(path: str) -> bool:
    """Return true for a limit of the robot, such as ``TrajectoryPlannerROS/max_vel_x``."""
    name = path.rstrip("/").rpartition("/")[2]
    return not is_protected(path) and (name in _OTHER_LIMITS or bool(_SPEED.search(name)))


def is_protected(path: str) -> bool:
    """Return true for a parameter that is never searched, such as ``xy_goal_tolerance``."""
    words = [word for word in path.split("/") if word]
    return bool(words) and (words[0] in GROUPS or bool(_PROTECTED.fullmatch(words[-1])))


def hold_limits(space: SearchSpace) -> HeldSpace:
    """Remove the limits of the robot from a space, followers included."""
    held = tuple(path for path in _paths(space.dimensions) if is_limit(path))
    return HeldSpace(space.without(held), held)


def protected_faults(space: SearchSpace) -> List[str]:
    """Return a fault for each protected parameter that a space would change."""
    return [
        f"{space.name}: {path}: never searched, because the score cannot see what is lost; "
        f"remove it from the space, and set it with --set {path}=... if it must change"
        for path in _paths(space.dimensions)
        if is_protected(path)
    ]


def _paths(dimensions: Sequence[Dimension]) -> List[str]:
    return [
        path
        for dimension in dimensions
        for path in (dimension.path, *(other for other, _ in dimension.follow))
    ]
