"""Fuzz targets: the readers of files and texts of unknown origin, as functions of bytes.

A target returns for valid input and for input that its reader refuses with ``InputError``. Any
other exception is a fault. ``make fuzz`` calls the targets with bytes that atheris generates, the
unit tests call them with the files below ``corpus`` and mutations of these.
"""

from __future__ import annotations

import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Callable, Dict

import numpy as np
from PIL import Image
from study_target import study

from quad_nav import config
from quad_nav.cli.options import parameter
from quad_nav.config.files import REQUIRED
from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.mission.checkpoint import read_checkpoint
from quad_nav.mission.goal_file import parse_goals
from quad_nav.mission.journal import Journal
from quad_nav.recording import messages
from quad_nav.recording.bag_file import Message
from quad_nav.recording.bag_trace import TraceReader, _is_wanted, read_trace
from quad_nav.report.flight_metrics import flight_metrics
from quad_nav.report.flight_page import flight_page
from quad_nav.scenario.goal_checks import scene_check
from quad_nav.sim.scene_file import load_scene
from quad_nav.topics.flight_info import FLIGHT_TOPIC, FlightInfo, RobotInfo

MAX_FUZZED_CELLS = 250_000
"""Larger maps are valid, too, but too slow for a hundred calls per second."""
_MAP = (
    "image: map.png\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\n"
    "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
)


def goals(data: bytes) -> None:
    parse_goals(data, "goals.json", _arena_check())


def scene(data: bytes) -> None:
    load_scene(_written("scene.yaml", data))


def map_yaml(data: bytes) -> None:
    """A map's YAML, or a scene's, beside an image of 40 x 40 cells."""
    pixels = np.full((40, 40), 254, np.uint8)
    pixels[:4] = 0
    Image.fromarray(pixels).save(_folder() / "map.png")
    load_scene(_written("map.yaml", data))


def map_image(data: bytes) -> None:
    _written("map.png", data)
    load_scene(_written("map.yaml", _MAP.encode()))


def world(data: bytes) -> None:
    load_scene(_written("fuzz.world", data))


def parameters(data: bytes) -> None:
    """One of move_base's four files; the others are the tutorial's."""
    for name in REQUIRED:
        _written(f"{name}.yaml", shipped("config", f"tutorial/{name}.yaml").read_bytes())
    for name in REQUIRED:
        path = _folder() / f"{name}.yaml"
        usual = path.read_bytes()
        path.write_bytes(data)
        try:
            config.load(config.load_files(_folder(), {"i": "0"}))
        except InputError:
            pass
        path.write_bytes(usual)


def command_line(data: bytes) -> None:
    """``--set PATH=VALUE``."""
    parameter(data.decode("utf-8", "replace"))


def bag(data: bytes) -> None:
    flight_metrics(read_trace(_written("flight.bag", data)))


def flight_info(data: bytes) -> None:
    """Line by line the texts of ``/quad/flight``, see ``_flight_message``."""
    reading = _reading_with_odometry()
    try:
        reading.add(_flight_message(data))
    except ValueError:
        return  # read_trace makes an InputError of it
    flight_metrics(reading.trace(Path("flight.bag")))


def _flight_message(data: bytes) -> Message:
    """Return a message with a line each for scene, goals, parameters, title and robot's name."""
    lines = data.decode("utf-8", "replace").split("\n")
    scene, goals, parameters, title, name = (*lines, *[""] * 5)[:5]
    content = messages.flight_info(FlightInfo(title, robots=(RobotInfo(name),)))
    content.scene = scene
    content.robots[0].goals, content.robots[0].parameters = goals, parameters
    return Message(FLIGHT_TOPIC, "quad/FlightInfo", 0, content)


def journal(data: bytes) -> None:
    """The journal of a mission of two robots."""
    path = _written("journal.jsonl", data)
    read_checkpoint(Journal(path).resume(), ["quad0", "quad1"], "journal.jsonl")


def page(data: bytes) -> None:
    """The whole report of a flight that is told by ``flight_info``; slow."""
    reading = _reading_with_odometry()
    try:
        reading.add(_flight_message(data))
    except ValueError:
        return
    flight_page(reading.trace(Path("flight.bag")))


def robot_messages(data: bytes) -> None:
    """The first byte says which topic, the rest is a message as it comes over the wire."""
    topics = [
        ("/odom0", "nav_msgs/Odometry"),
        ("/cmd_vel0", "geometry_msgs/Twist"),
        ("/move_base0/NavfnROS/plan", "nav_msgs/Path"),
        ("/move_base0/state", "std_msgs/String"),
        ("/move_base0/feedback", "move_base_msgs/MoveBaseActionFeedback"),
        ("/move_base0/recovery_status", "move_base_msgs/RecoveryStatus"),
        ("/tf", "tf2_msgs/TFMessage"),
        ("/clock", "rosgraph_msgs/Clock"),
        ("/simulation/contacts", "quad/Contact"),
        (FLIGHT_TOPIC, "quad/FlightInfo"),
        ("/quad/events", "quad/MissionEvent"),
        ("/move_base0/right_of_way", "quad/RightOfWay"),
    ]
    topic, kind = topics[data[0] % len(topics) if data else 0]
    assert _is_wanted(topic, kind)
    try:
        content = messages.decode(data[1:], kind)
    except Exception:  # read_messages makes an InputError of whatever decoding raises
        return
    reading = _reading_with_odometry()
    try:
        reading.add(Message(topic, kind, 0, content))
    except ValueError:
        return
    flight_metrics(reading.trace(Path("flight.bag")))


TARGETS: Dict[str, Callable[[bytes], None]] = {
    target.__name__: target
    for target in (
        goals,
        scene,
        map_yaml,
        map_image,
        world,
        parameters,
        command_line,
        bag,
        flight_info,
        journal,
        page,
        robot_messages,
        study,
    )
}


def run(name: str, data: bytes) -> bool:
    """Return whether the input is valid; raise what is a fault."""
    try:
        TARGETS[name](data)
    except InputError as error:
        assert error.problems, "refused without a reason"
        return False
    return True


@lru_cache(maxsize=None)
def _arena_check():
    return scene_check(load_scene(shipped("scenes", "arena.yaml")), 0.3)


@lru_cache(maxsize=None)
def _folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="quad-fuzz-"))


def _written(name: str, data: bytes) -> Path:
    path = _folder() / name
    path.write_bytes(data)
    return path


def _reading_with_odometry() -> TraceReader:
    reading = TraceReader()
    for second in (1, 2, 3):
        reading.add(Message("/odom0", "nav_msgs/Odometry", 0, odometry(second, 1.0 + second)))
    return reading


def odometry(second: int, x_m: float):
    make = messages.message
    zeros = np.zeros(36)
    vector = make("geometry_msgs/Vector3", 0.0, 0.0, 0.0)
    pose = make(
        "geometry_msgs/Pose",
        make("geometry_msgs/Point", x_m, 1.0, 1.0),
        make("geometry_msgs/Quaternion", 0.0, 0.0, 0.0, 1.0),
    )
    return make(
        "nav_msgs/Odometry",
        make("std_msgs/Header", 0, messages.time(second * 10**9), "odom0"),
        "base_link0",
        make("geometry_msgs/PoseWithCovariance", pose, zeros),
        make(
            "geometry_msgs/TwistWithCovariance", make("geometry_msgs/Twist", vector, vector), zeros
        ),
    )
