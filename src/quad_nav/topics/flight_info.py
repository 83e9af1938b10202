"""Facts about a flight that no standard message carries, as ``/quad/flight`` has them.

The topic holds latched ``quad/FlightInfo``. Each publisher leaves out what it does not know; a
reader merges the messages. The scene, the goals and the parameters are texts of files, as JSON.
"""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass, field
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple

from quad_nav.config.differences import differences, known_parameters
from quad_nav.errors import InputError
from quad_nav.mission.goal import Goal, goal_entry, goal_faults, read_goal
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.scenario.rules import START_S
from quad_nav.sim.scene import Scene
from quad_nav.sim.scene_file import scene_from_document
from quad_nav.sim.scene_writer import scene_document
from quad_nav.topics.validation import MAX_MAGNITUDE, MAX_TIME_S, shown_text
from quad_nav.versions import versions

FLIGHT_TOPIC = "/quad/flight"
RESET_TOPIC = "/simulation/last_reset"
"""`std_msgs/Time`, latched: time on `/clock` of the simulation's last reset, if there was one."""

MAX_ROBOTS = 100
MAX_GOALS = 100_000
_MAX_DIGITS = 100
_MOST_LEVELS = 50
_LARGEST_HZ = 1e6
_UNKNOWN_SEED = -1


@dataclass(frozen=True)
class RobotInfo:
    """Facts about one robot.

    Attributes:
        name: Name of the robot.
        goals: The goals of its file; empty if unknown.
        parameters: move_base's known parameters with ROS names; empty if unknown.
    """

    name: str
    goals: Tuple[Goal, ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)

    @property
    def fields(self) -> Dict[str, str]:
        """The fields of a ``quad/RobotInfo``."""
        return {
            "name": self.name,
            "goals": json.dumps([goal_entry(goal) for goal in self.goals]),
            "parameters": json.dumps(self.parameters, sort_keys=True),
        }


@dataclass(frozen=True)
class FlightInfo:
    """Facts about a flight; what is unknown is empty or None.

    Attributes:
        title: Name of the flight.
        config_name: Name or folder of the configuration.
        reason: Why the flight ended before its goals did.
        scene: The scene as a scene file has it, with every shape; nothing of it is checked.
        seed: Seed of jitter, noise and the random mission.
        jitter_m: Largest displacement of a start pose.
        start_s: Time on ``/clock`` at the start of the flight.
        versions: Versions of the package and of the libraries that compute a flight.
        robot_radius_m: Radius of the hulls.
        robots: The robots, by their numbers.
    """

    title: str = ""
    config_name: str = ""
    reason: str = ""
    scene: Any = None
    seed: Optional[int] = None
    jitter_m: Optional[float] = None
    start_s: Optional[float] = None
    versions: Mapping[str, str] = field(default_factory=dict)
    robot_radius_m: Optional[float] = None
    robots: Tuple[RobotInfo, ...] = ()

    def merged(self, other: FlightInfo) -> FlightInfo:
        """Return these facts, replaced by what another publisher knows."""
        names = [one.name for one in dataclasses.fields(other)]
        known = {name: getattr(other, name) for name in names}
        unknown: Sequence[Any] = (None, "", (), {})
        return dataclasses.replace(self, **{k: v for k, v in known.items() if v not in unknown})

    @property
    def fields(self) -> Dict[str, Any]:
        """The fields of a ``quad/FlightInfo``; ``robots`` are those of ``quad/RobotInfo``."""
        return {
            "title": self.title,
            "config": self.config_name,
            "reason": self.reason,
            "scene": "" if self.scene is None else json.dumps(self.scene, sort_keys=True),
            "seed": _UNKNOWN_SEED if self.seed is None else self.seed,
            "jitter": _or_nan(self.jitter_m),
            "start": _or_nan(self.start_s),
            "versions": [f"{name} {version}" for name, version in self.versions.items()],
            "robot_radius": _or_nan(self.robot_radius_m),
            "robots": [robot.fields for robot in self.robots],
        }

    def read_scene(self, place: str) -> Optional[Scene]:
        """Return the scene, None if it is unknown.

        Args:
            place: Where the facts come from, for messages.

        Raises:
            InputError: The scene is not valid, or refers to a file.
        """
        if self.scene is None:
            return None
        place = f"{place}: scene"
        if isinstance(self.scene, dict) and {"world", "map"} & set(self.scene):
            raise InputError([f"{place}: refers to another file, expected the complete scene"])
        return scene_from_document(self.scene, place)


def simulation_info(scene: Scene, seed: int, jitter_m: float = 0.0) -> FlightInfo:
    """Return the facts that the simulator publishes."""
    return FlightInfo(
        scene=scene_document(scene),
        seed=seed,
        jitter_m=jitter_m,
        start_s=START_S,
        versions=versions(),
    )


def mission_info(
    sequences: Mapping[str, GoalSequence],
    parameters: Sequence[Mapping[str, Any]],
    robot_radius_m: float,
) -> FlightInfo:
    """Return the facts that the sequencer publishes.

    Args:
        sequences: Goals by the robot's name.
        parameters: move_base's parameter tree of each robot, in the same order. Only known ones
            are published.
        robot_radius_m: Radius of a robot's hull.
    """
    robots = tuple(
        RobotInfo(name, tuple(sequence.goals), known_parameters(tree))
        for (name, sequence), tree in zip(sequences.items(), parameters)
    )
    return FlightInfo(robot_radius_m=robot_radius_m, robots=robots)


def flight_info_from_message(message: Any) -> FlightInfo:
    """Read a ``quad/FlightInfo``, of rospy or of a recording; the scene is not checked.

    Raises:
        ValueError: A field is not valid.
    """
    if len(message.robots) > MAX_ROBOTS:
        raise ValueError(f"{len(message.robots)} robots, expected {MAX_ROBOTS} at most")
    radius_m = _number("robot_radius", message.robot_radius, MAX_MAGNITUDE)
    if radius_m is not None and radius_m <= 0.0:
        raise ValueError(f"robot_radius: {radius_m:g}, expected more than 0")
    pairs = (shown_text(one).partition(" ") for one in message.versions)
    return FlightInfo(
        shown_text(message.title),
        shown_text(message.config),
        shown_text(message.reason),
        _read_json("scene", message.scene),
        None if message.seed == _UNKNOWN_SEED else message.seed,
        _number("jitter", message.jitter, MAX_MAGNITUDE),
        _number("start", message.start, MAX_TIME_S),
        {name: version for name, _, version in pairs},
        radius_m,
        tuple(map(_robot_from_message, message.robots)),
    )


def _robot_from_message(message: Any) -> RobotInfo:
    goals = _read_json("goals", message.goals)
    parameters = _read_json("parameters", message.parameters)
    return RobotInfo(
        shown_text(message.name),
        _goals([] if goals is None else goals),
        _parameters({} if parameters is None else parameters),
    )


def _goals(entries: Any) -> Tuple[Goal, ...]:
    if not isinstance(entries, list) or len(entries) > MAX_GOALS:
        raise ValueError(f"goals: {_short(entries)}, expected a list of {MAX_GOALS} at most")
    for number, entry in enumerate(entries):
        fault = next(iter(goal_faults(entry)), "")
        if fault:
            raise ValueError(f"goals[{number}]{fault}")
    return tuple(map(read_goal, entries))


def _parameters(tree: Any) -> Mapping[str, Any]:
    if not isinstance(tree, dict):
        raise ValueError(f"parameters: {_short(tree)}, expected an object")
    _check_levels(tree, _MOST_LEVELS)
    frequency_hz = tree.get("controller_frequency", 1.0)
    is_number = isinstance(frequency_hz, (int, float)) and not isinstance(frequency_hz, bool)
    if not is_number or not 0.0 < frequency_hz <= _LARGEST_HZ:
        raise ValueError(
            f"controller_frequency: {_short(frequency_hz)}, expected a number above 0, up to"
            f" {_LARGEST_HZ:g}"
        )
    try:
        differences(tree)
    except (LookupError, TypeError, AttributeError, ValueError) as error:
        raise ValueError(f"parameters: {error!r}, expected move_base's tree") from error
    return tree


def _check_levels(value: Any, left: int) -> None:
    if left == 0:
        raise ValueError(f"parameters: nested more than {_MOST_LEVELS} levels deep, expected fewer")
    nested: Sequence[Any] = ()
    if isinstance(value, (dict, list)):
        nested = list(value.values()) if isinstance(value, dict) else value
    for entry in nested:
        _check_levels(entry, left - 1)


def _read_json(key: str, text: str) -> Any:
    """Decode a text; return None for an empty one."""
    if not text:
        return None
    try:
        return json.loads(text, parse_int=_whole_number)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{key}: {_short(text)}, expected JSON") from error


def _whole_number(digits: str) -> int:
    if len(digits) > _MAX_DIGITS:
        raise ValueError(f"a number with more than {_MAX_DIGITS} digits")
    return int(digits)


def _number(key: str, value: float, largest: float) -> Optional[float]:
    """Return a number, None for NaN."""
    if math.isnan(value):
        return None
    if abs(value) > largest:
        raise ValueError(f"{key}: {value:g}, expected a number up to {largest:g}, or NaN")
    return float(value)


def _or_nan(value: Optional[float]) -> float:
    return math.nan if value is None else value


def _short(value: Any) -> str:
    return repr(value)[:60]


def text_values(**entries: object) -> Dict[str, str]:
    """Format entries as diagnostic values: floats with six significant digits."""
    return {
        key: f"{value:.6g}" if isinstance(value, float) else str(value)
        for key, value in entries.items()
    }
