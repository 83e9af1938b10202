"""Check for the positions of goals: a robot has to fit there."""

from __future__ import annotations

from typing import Callable, Optional

PlaceCheck = Callable[[float, float], Optional[str]]
"""Returns what is wrong with a position (x, y) in ``map``, or None if a robot fits there."""


def clearance_check(
    contains: Callable[[float, float], bool],
    clearance_m: Callable[[float, float], float],
    robot_radius_m: float,
    arena: str = "the arena",
) -> PlaceCheck:
    """Make a check for positions in the arena at least a robot's radius from everything.

    Args:
        contains: Test for a position (x, y) in the arena.
        clearance_m: Distance from a position (x, y) to the nearest surface, negative inside.
        robot_radius_m: The robot's radius.
        arena: Description of the arena, for messages.
    """

    def check(x_m: float, y_m: float) -> Optional[str]:
        if not contains(x_m, y_m):
            return f"is outside the arena; expected a place in {arena}"
        clearance = clearance_m(x_m, y_m)
        if clearance <= 0.0:
            return f"is inside an obstacle; expected {robot_radius_m:.2f} m of free space around it"
        if clearance < robot_radius_m:
            return (
                f"is {clearance:.2f} m from an obstacle or a wall; "
                f"expected at least the robot's radius, {robot_radius_m:.2f} m"
            )
        return None

    return check
