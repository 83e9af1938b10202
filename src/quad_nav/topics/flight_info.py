"""Facts about a flight that no standard message carries.

`/quad/flight` is latched and holds one JSON object; the objects of several publishers are merged.
`/quad/events` holds one JSON object for each action of a sequencer. Both are `std_msgs/String`;
`docs/topics.md` lists the keys. `/simulation/contacts` holds one
`diagnostic_msgs/DiagnosticStatus` for each contact; this module has its values.
"""

from __future__ import annotations

import json
from typing import Any, Dict, Mapping, Optional, Sequence

from quad_nav.config.differences import known_parameters
from quad_nav.mission.goal import goal_entry
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.mission.sequencer import Action, GoalEnded, SendGoal
from quad_nav.scenario.rules import START_S
from quad_nav.sim.contacts import Contact
from quad_nav.sim.scene import Scene
from quad_nav.sim.scene_writer import scene_document
from quad_nav.topics.validation import contact_problem
from quad_nav.versions import versions

FLIGHT_TOPIC, EVENTS_TOPIC = "/quad/flight", "/quad/events"
CONTACT_STATUS = "contact"
RESET_TOPIC = "/simulation/last_reset"
"""`std_msgs/Time`, latched: time on `/clock` of the simulation's last reset, if there was one."""

_MAX_DIGITS = 100


def simulation_info(scene: Scene, seed: int, jitter_m: float = 0.0) -> Dict[str, Any]:
    """Return the facts that the simulator publishes: scene, seed, jitter, start time, versions."""
    return {
        "scene": scene_document(scene),
        "seed": seed,
        "jitter_m": jitter_m,
        "start_s": START_S,
        "versions": versions(),
    }


def mission_info(
    sequences: Mapping[str, GoalSequence],
    parameters: Sequence[Mapping[str, Any]],
    robot_radius_m: float,
) -> Dict[str, Any]:
    """Return the facts that the sequencer publishes: goals, parameters, robot radius.

    Args:
        sequences: Goals by the robot's name.
        parameters: move_base's parameter tree of each robot, in the same order. Only known ones
            are published.
        robot_radius_m: Radius of a robot's hull.
    """
    robots = [
        {
            "name": name,
            "goals": [goal_entry(goal) for goal in sequence.goals],
            "parameters": known_parameters(tree),
        }
        for (name, sequence), tree in zip(sequences.items(), parameters)
    ]
    return {"robots": robots, "robot_radius_m": robot_radius_m}


def event(robot: int, clock_s: float, action: Action) -> Dict[str, Any]:
    """Return the JSON object of a sequencer's action."""
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
            "why": action.resend_reason,
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
            "yaw_error_rad": action.yaw_error_rad,
        }
    return {**fields, "event": "done"}


def to_text(info: Mapping[str, Any]) -> str:
    """Encode an object as JSON with sorted keys."""
    return json.dumps(info, sort_keys=True)


def from_text(text: str) -> Optional[Dict[str, Any]]:
    """Decode a JSON object; return None for any other text."""
    try:
        info = json.loads(text, parse_int=_whole_number)
    except (ValueError, RecursionError):
        return None
    return info if isinstance(info, dict) else None


def _whole_number(digits: str) -> int:
    if len(digits) > _MAX_DIGITS:
        raise ValueError(f"a number with more than {_MAX_DIGITS} digits")
    return int(digits)


def text_values(**entries: object) -> Dict[str, str]:
    """Format entries as diagnostic values: floats with six significant digits."""
    return {
        key: f"{value:.6g}" if isinstance(value, float) else str(value)
        for key, value in entries.items()
    }


def contact_values(contact: Contact, clock_s: float) -> Dict[str, str]:
    """Return the diagnostic values of a contact, its numbers with all their digits.

    Args:
        contact: The contact as the simulation logs it.
        clock_s: Time on `/clock` at the contact.
    """
    return {
        "time_s": repr(float(clock_s)),
        "robot": contact.robot,
        "with": contact.other,
        "x_m": repr(float(contact.x_m)),
        "y_m": repr(float(contact.y_m)),
    }


def contact_from_values(robot: str, values: Mapping[str, str]) -> Contact:
    """Read a contact from its diagnostic values.

    Args:
        robot: Name of the robot that reports the contact.
        values: Values by their keys.

    Raises:
        ValueError: If a value is missing, not a number or out of its range.
    """
    try:
        contact = Contact(
            float(values["time_s"]),
            robot,
            values["with"],
            float(values["x_m"]),
            float(values["y_m"]),
        )
    except (KeyError, ValueError) as error:
        raise ValueError(
            f"contact has no valid {error}; expected the values time_s, with, x_m, y_m"
        ) from error
    problem = contact_problem(contact)
    if problem:
        raise ValueError(f"contact with {problem}")
    return contact
