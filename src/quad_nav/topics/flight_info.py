"""What a recording says about a flight besides its messages, as JSON.

``/quad/flight`` is latched, one object with what is known; several publishers' objects
add up. ``/quad/events`` has one object for each thing that a sequencer does. Both are
``std_msgs/String``; ``docs/recording.md`` lists the keys.
"""

from __future__ import annotations

import json
from typing import Any, Dict, Mapping, Optional, Sequence

from quad_nav.mission.goal_sequence import GoalSequence
from quad_nav.mission.sequencer import Action, GoalEnded, SendGoal
from quad_nav.sim.scene import Scene
from quad_nav.sim.scene_document import scene_document
from quad_nav.versions import versions

FLIGHT_TOPIC, EVENTS_TOPIC = "/quad/flight", "/quad/events"

_MOST_DIGITS = 100
START_S = 1.0
"""What ``/clock`` says at a simulation's start: nodes take 0 for a clock that stands."""


def simulation_info(scene: Scene, seed: int) -> Dict[str, Any]:
    """What the simulation knows."""
    return {
        "scene": scene_document(scene),
        "seed": seed,
        "start_s": START_S,
        "versions": versions(),
    }


def mission_info(
    sequences: Mapping[str, GoalSequence],
    parameters: Sequence[Mapping[str, Any]],
    robot_radius_m: float,
) -> Dict[str, Any]:
    """What the mission knows; ``parameters`` are the quadcopters' trees for move_base."""
    robots = [
        {"name": name, "goals": [_goal(goal) for goal in sequence.goals], "parameters": tree}
        for (name, sequence), tree in zip(sequences.items(), parameters)
    ]
    return {"robots": robots, "robot_radius_m": robot_radius_m}


def event(robot: int, clock_s: float, action: Action) -> Dict[str, Any]:
    """A sequencer's action."""
    fields: Dict[str, Any] = {"robot": robot, "time_s": clock_s}
    if isinstance(action, SendGoal):
        pose = action.pose
        return {
            **fields,
            "event": "sent",
            "goal": action.index,
            "lap": action.lap,
            "x_m": pose.x_m,
            "y_m": pose.y_m,
            "yaw_rad": pose.yaw_rad,
            "attempt": action.attempt,
            "why": action.why,
        }
    if isinstance(action, GoalEnded):
        return {
            **fields,
            "event": "ended",
            "goal": action.index,
            "lap": action.lap,
            "reached": action.reached,
            "attempts": action.attempts,
            "reason": action.reason,
        }
    return {**fields, "event": "done"}


def to_text(info: Mapping[str, Any]) -> str:
    return json.dumps(info, sort_keys=True)


def from_text(text: str) -> Optional[Dict[str, Any]]:
    """None for what is no object in JSON."""
    try:
        info = json.loads(text, parse_int=_whole_number)
    except (ValueError, RecursionError):
        return None
    return info if isinstance(info, dict) else None


def _whole_number(digits: str) -> int:
    if len(digits) > _MOST_DIGITS:
        raise ValueError("a number with too many digits")
    return int(digits)


def _goal(goal: Any) -> Sequence[float]:
    at = [goal.x_m, goal.y_m]
    return at if goal.yaw_rad is None else [*at, goal.yaw_rad]
