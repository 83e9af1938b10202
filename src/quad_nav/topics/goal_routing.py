"""RViz tools for a whole fleet: select a quadcopter, choose who gets a goal or a pose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import List, Mapping, Optional, Tuple

from quad_nav.topics.markers import CYLINDER, Marker

SELECT_WITHIN_M = 1.0
"""Largest distance of a click from the centre of the quadcopter that it selects."""
_DISC_DIAMETER_M = 1.1
_DISC_RGBA = (1.0, 0.78, 0.0, 0.5)

Positions = Mapping[int, Tuple[float, float]]
"""Position (x, y) in ``map`` of each quadcopter whose position is known, by its number."""


@dataclass(frozen=True)
class Route:
    """The quadcopter that gets a goal or a pose, and a phrase with the reason for the log."""

    robot: int
    reason: str


class GoalRouter:
    """Routes goals and poses to the selected quadcopter, or without a selection to the nearest one.

    Attributes:
        selected: Number of the selected quadcopter, or None.
    """

    def __init__(self) -> None:
        """Start without a selection."""
        self.selected: Optional[int] = None

    def click(self, x_m: float, y_m: float, positions: Positions) -> str:
        """Select the quadcopter at a position in ``map``; a second click there deselects it.

        Returns:
            A sentence for the log: what is selected, and where the next goals go.
        """
        found = _nearest(x_m, y_m, positions)
        before = self.selected
        if found is None or found[1] > SELECT_WITHIN_M:
            self.selected = None
            return (
                f"no quadcopter within {SELECT_WITHIN_M:g} m of the click at ({x_m:.2f}, "
                f"{y_m:.2f}) m, none selected; each goal or pose goes to the nearest"
            )
        if found[0] == before:
            self.selected = None
            return f"quad{before} deselected; each goal or pose goes to the nearest"
        self.selected = found[0]
        return f"quad{self.selected} selected; the next goals and poses go to it"

    def route(self, x_m: float, y_m: float, positions: Positions) -> Optional[Route]:
        """Choose who gets a goal at a position in ``map``; None if no position is known."""
        if self.selected is not None:
            return Route(self.selected, "selected")
        found = _nearest(x_m, y_m, positions)
        if found is None:
            return None
        return Route(found[0], f"nearest, {found[1]:.2f} m from it")

    def route_pose(
        self, x_m: float, y_m: float, positions: Positions, robots: int
    ) -> Optional[Route]:
        """Choose who is told to be at a position in ``map``; None if that is not clear.

        A quadcopter that does not know its place comes before one that does: a wrong pose would
        let that one err, too.
        """
        lost = sorted(set(range(robots)) - set(positions))
        if self.selected is not None or not lost:
            return self.route(x_m, y_m, positions)
        return Route(lost[0], "the only one without a place") if len(lost) == 1 else None


def _nearest(x_m: float, y_m: float, positions: Positions) -> Optional[Tuple[int, float]]:
    """Return the nearest quadcopter and its distance; the lower number if two are as near."""
    distances = [
        (math.hypot(x - x_m, y - y_m), robot) for robot, (x, y) in sorted(positions.items())
    ]
    if not distances:
        return None
    distance_m, robot = min(distances)
    return robot, distance_m


def selection_markers(selected: Optional[int]) -> List[Marker]:
    """Return a disc below the selected quadcopter, locked to its frame; [] without a selection."""
    if selected is None:
        return []
    size = (_DISC_DIAMETER_M, _DISC_DIAMETER_M, 0.02)
    frame = f"base_link{selected}"
    place = (0.0, 0.0, -0.1)
    return [Marker(frame, "selection", 0, CYLINDER, place, size, _DISC_RGBA, frame_locked=True)]
