"""Numbered goal spheres."""

from __future__ import annotations

from typing import List, Sequence

from quad_nav.mission.sequencer import Sequencer
from quad_nav.sim.colours import robot_rgba
from quad_nav.topics.markers import SPHERE, TEXT, Marker

DIAMETER_M, CURRENT_DIAMETER_M, TEXT_HEIGHT_M = 0.30, 0.45, 0.35
FLOWN_ALPHA, WAITING_ALPHA = 0.2, 0.75


def goal_markers(sequencers: Sequence[Sequencer], altitude_m: float) -> List[Marker]:
    """All robots' goals: flown ones dimmed, the one in flight larger and opaque.

    They take the place of all that were shown before.
    """
    return [
        marker
        for robot, sequencer in enumerate(sequencers)
        for index in range(len(sequencer.sequence.goals))
        for marker in _goal_markers(robot, index, sequencer, altitude_m)
    ]


def _goal_markers(robot: int, index: int, sequencer: Sequencer, altitude_m: float) -> List[Marker]:
    goal = sequencer.sequence.goals[index]
    is_current = sequencer.flight is not None and index == sequencer.index
    alpha = 1.0 if is_current else FLOWN_ALPHA if index < sequencer.index else WAITING_ALPHA
    diameter_m = CURRENT_DIAMETER_M if is_current else DIAMETER_M
    above_m = altitude_m + diameter_m / 2 + TEXT_HEIGHT_M / 2
    return [
        Marker(
            "map",
            f"goal{robot}",
            index,
            SPHERE,
            (goal.x_m, goal.y_m, altitude_m),
            (diameter_m, diameter_m, diameter_m),
            robot_rgba(robot, alpha),
        ),
        Marker(
            "map",
            f"goal{robot}_number",
            index,
            TEXT,
            (goal.x_m, goal.y_m, above_m),
            (0.0, 0.0, TEXT_HEIGHT_M),
            (0.1, 0.1, 0.1, max(alpha, 0.4)),
            text=str(index + 1),
        ),
    ]
