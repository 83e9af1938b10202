"""Scenes in YAML.

    name: two rooms                # optional, else the file's name
    size: [12.0, 12.0]             # arena along x and y, m
    altitude: 1.0                  # that all quadcopters fly at, m; default 1.0
    walls: {height: 2.0, thickness: 0.1}        # optional; these are the defaults
    obstacles:
      - {name: crate, shape: box, centre: [2.2, 4.0], size: [0.8, 0.8], height: 2.0, yaw: 0.3}
      - {name: pillar, shape: cylinder, centre: [6.0, 6.0], radius: 0.4, height: 2.0}
    starts:                        # x, y, yaw of quadcopter 0, 1, ...; yaw may be left out
      - [1.5, 1.5, 0.0]

``bottom`` (default 0) lifts an obstacle off the floor. A file is refused as a
whole: every fault is listed at once in one ``InputError``.
"""
from __future__ import annotations

import difflib
import math
from pathlib import Path
from typing import Any, Dict, Hashable, List, Optional, Sequence, Tuple, Union

import yaml

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.sim.scene import BODY_RADIUS_M, Box, Cylinder, Obstacle, Scene, Walls

_SHAPE_KEYS = {"box": ["name", "shape", "centre", "size", "height", "yaw", "bottom"],
               "cylinder": ["name", "shape", "centre", "radius", "height", "bottom"]}


def load_scene(path: Union[str, Path]) -> Scene:
    """Read and check a scene file. Raises ``InputError`` with one line per fault."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError([f"{path}: cannot be read: {error}"]) from error
    try:
        document = yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        raise InputError([f"{path}: {_yaml_fault(error)}"]) from error
    return scene_from_document(document, str(path), path.stem)


def scene_from_document(document: Any, source: str, default_name: str = "scene") -> Scene:
    """Check a parsed document; ``source`` names it in messages. Raises ``InputError``."""
    check = _Checker(source)
    scene = _read_scene(check, document, default_name)
    if scene is None or check.problems:
        raise InputError(check.problems)
    return scene


def scene_document(scene: Scene) -> Dict[str, Any]:
    """The document that ``scene_from_document`` reads the same scene from."""
    walls = {"height": scene.walls.height_m, "thickness": scene.walls.thickness_m}
    return {"name": scene.name, "size": [scene.size_x_m, scene.size_y_m],
            "altitude": scene.altitude_m, "walls": walls,
            "obstacles": [_obstacle_document(solid) for solid in scene.obstacles],
            "starts": [[pose.x_m, pose.y_m, pose.yaw_rad] for pose in scene.starts]}


def write_scene(scene: Scene, path: Path) -> None:
    """Write a file that ``load_scene`` reads the same scene from, one obstacle a line."""
    document = scene_document(scene)
    head = {key: document[key] for key in ("name", "size", "altitude", "walls")}
    lines = [yaml.safe_dump(head, default_flow_style=None, sort_keys=False)]
    for key in ("obstacles", "starts"):
        lines.append(f"{key}:\n" if document[key] else f"{key}: []\n")
        lines += ["  - " + yaml.safe_dump(item, default_flow_style=True, sort_keys=False,
                                          width=math.inf) for item in document[key]]
    path.write_text("".join(lines), encoding="utf-8")


def _obstacle_document(solid: Obstacle) -> Dict[str, Any]:
    shape: Dict[str, Any] = (
        {"shape": "box", "size": [solid.size_x_m, solid.size_y_m], "yaw": solid.yaw_rad}
        if isinstance(solid, Box) else {"shape": "cylinder", "radius": solid.radius_m})
    bottom = {"bottom": solid.bottom_m} if solid.bottom_m else {}
    return {"name": solid.name, "centre": [solid.x_m, solid.y_m], **shape,
            "height": solid.height_m, **bottom}


def _read_scene(check: _Checker, document: Any, default_name: str) -> Optional[Scene]:
    fields = check.mapping(document, "", ["name", "size", "altitude", "walls", "obstacles",
                                          "starts"])
    if fields is None:
        return None
    faults_before = len(check.problems)
    size = check.numbers(fields, "size", "", 2, positive=True)
    altitude = check.number(fields, "altitude", "", 1.0, positive=True)
    walls = check.mapping(fields.get("walls", {}), "walls", ["height", "thickness"]) or {}
    height = check.number(walls, "height", "walls", 2.0, positive=True)
    thickness = check.number(walls, "thickness", "walls", 0.1, positive=True)
    arena_is_sound = len(check.problems) == faults_before
    obstacles = [_read_obstacle(check, entry, k)
                 for k, entry in enumerate(check.sequence(fields, "obstacles", []))]
    starts = [_read_start(check, entry, f"starts[{k}]")
              for k, entry in enumerate(check.sequence(fields, "starts"))]
    if fields.get("starts") == []:
        check.fault("starts", "no start pose, expected at least one [x, y, yaw]")
    scene = Scene(check.text(fields, "name", "", default_name), size[0], size[1], altitude,
                  Walls(height, thickness), tuple(o for o in obstacles if o is not None),
                  tuple(s for s in starts if s is not None))
    _check_names(check, scene)
    if arena_is_sound:
        _check_starts(check, scene, starts)
    return scene


def _read_obstacle(check: _Checker, entry: Any, number: int) -> Optional[Obstacle]:
    faults_before, place = len(check.problems), f"obstacles[{number}]"
    if not isinstance(entry, dict):
        check.fault(place, f"{_kind(entry)}, expected a mapping that describes an obstacle")
        return None
    shape = entry.get("shape")
    if not isinstance(shape, str) or shape not in _SHAPE_KEYS:
        check.fault(f"{place}.shape", f"{_kind(shape)}, expected box or cylinder")
        return None
    check.mapping(entry, place, _SHAPE_KEYS[shape])
    name = check.text(entry, "name", place, f"obstacle_{number}")
    x, y = check.numbers(entry, "centre", place, 2)
    height = check.number(entry, "height", place, positive=True)
    bottom = check.number(entry, "bottom", place, 0.0)
    if bottom < 0.0:
        check.fault(f"{place}.bottom", f"{bottom:g} m is below the floor, expected 0 or more")
    obstacle: Obstacle
    if shape == "cylinder":
        radius = check.number(entry, "radius", place, positive=True)
        obstacle = Cylinder(name, x, y, radius, height, bottom)
    else:
        size_x, size_y = check.numbers(entry, "size", place, 2, positive=True)
        yaw = check.number(entry, "yaw", place, 0.0)
        obstacle = Box(name, x, y, size_x, size_y, height, yaw, bottom)
    return obstacle if len(check.problems) == faults_before else None


def _read_start(check: _Checker, entry: Any, place: str) -> Optional[Pose2D]:
    faults_before = len(check.problems)
    if not isinstance(entry, list) or len(entry) not in (2, 3):
        check.fault(place, f"{_kind(entry)}, expected [x, y] or [x, y, yaw]")
        return None
    start = Pose2D(*[check.as_number(v, f"{place}[{k}]") for k, v in enumerate(entry)])
    return start if len(check.problems) == faults_before else None


def _check_names(check: _Checker, scene: Scene) -> None:
    """Names identify obstacles in contact reports, so they must differ."""
    taken = {wall.name for wall in scene.wall_boxes()} | {"floor"}
    for obstacle in scene.obstacles:
        if obstacle.name in taken:
            check.fault("obstacles", f"name {obstacle.name!r} is taken, expected unique names")
        taken.add(obstacle.name)


def _check_starts(check: _Checker, scene: Scene, starts: Sequence[Optional[Pose2D]]) -> None:
    """Every start must be free for a quadcopter; ``starts`` has None where unreadable."""
    readable = [(k, start) for k, start in enumerate(starts) if start is not None]
    for k, start in readable:
        problem = _start_problem(scene, start)
        if problem:
            check.fault(f"starts[{k}]", f"({start.x_m:g}, {start.y_m:g}) {problem}")
        for other_k, other in readable[:readable.index((k, start))]:
            distance_m = start.distance_to(other)
            if distance_m <= 2 * BODY_RADIUS_M:
                check.fault(f"starts[{k}]", f"is {distance_m:.2f} m from starts[{other_k}], "
                            f"expected more than two body radii, {2 * BODY_RADIUS_M:g} m")


def _start_problem(scene: Scene, start: Pose2D) -> Optional[str]:
    if not scene.contains(start.x_m, start.y_m):
        return (f"is outside the arena, expected 0 < x < {scene.size_x_m:g} "
                f"and 0 < y < {scene.size_y_m:g}")
    point = (start.x_m, start.y_m, scene.altitude_m)
    nearest = scene.nearest(*point)
    clearance_m = nearest.clearance_m(*point)
    if clearance_m <= BODY_RADIUS_M:
        return (f"is {clearance_m:.2f} m from {nearest.name}, expected more than "
                f"a quadcopter's radius, {BODY_RADIUS_M:g} m")
    return None


class _Checker:
    """Reads fields of a document and notes what is wrong with them.

    A faulty field reads as a harmless number, so that the checks go on.
    """

    def __init__(self, source: str):
        self.source = source
        self.problems: List[str] = []

    def fault(self, place: str, problem: str) -> None:
        self.problems.append(f"{self.source}: {place}: {problem}" if place
                             else f"{self.source}: {problem}")

    def mapping(self, value: Any, place: str, known: Sequence[str]) -> Optional[Dict[str, Any]]:
        if not isinstance(value, dict):
            self.fault(place, f"{_kind(value)}, expected a mapping with {', '.join(known)}")
            return None
        for key in value:
            if key not in known:
                near = difflib.get_close_matches(str(key), known, 1)
                hint = f"did you mean {near[0]}?" if near else f"known: {', '.join(known)}"
                self.fault(_join(place, key), f"unknown key; {hint}")
        return value

    def sequence(self, fields: Dict[str, Any], key: str,
                 default: Optional[List[Any]] = None) -> List[Any]:
        value = fields.get(key, default)
        if not isinstance(value, list):
            self.fault(key, f"{_kind(value)}, expected a list")
            return []
        return value

    def text(self, fields: Dict[str, Any], key: str, place: str, default: str) -> str:
        value = fields.get(key, default)
        if not isinstance(value, str) or not value:
            self.fault(_join(place, key), f"{value!r}, expected a text")
            return default
        return value

    def number(self, fields: Dict[str, Any], key: str, place: str,
               default: Optional[float] = None, positive: bool = False) -> float:
        if key not in fields and default is not None:
            return default
        return self.as_number(fields.get(key), _join(place, key), positive)

    def numbers(self, fields: Dict[str, Any], key: str, place: str, count: int,
                positive: bool = False) -> Tuple[float, ...]:
        value, where = fields.get(key), _join(place, key)
        if not isinstance(value, list) or len(value) != count:
            self.fault(where, f"{_kind(value)}, expected a list of {count} numbers")
            return (1.0,) * count
        return tuple(self.as_number(v, f"{where}[{k}]", positive) for k, v in enumerate(value))

    def as_number(self, value: Any, place: str, positive: bool = False) -> float:
        expected = "expected a number above 0" if positive else "expected a finite number"
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.fault(place, f"{_kind(value)}, {expected}")
            return 1.0
        if not math.isfinite(value) or (positive and value <= 0):
            self.fault(place, f"{value}, {expected}")
            return 1.0
        return float(value)


class _Loader(yaml.SafeLoader):
    """Refuses a key that is given twice, where YAML would silently keep the last."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False
                          ) -> Dict[Hashable, Any]:
        seen = set()
        for key_node, _ in node.value:
            if key_node.value in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"key {key_node.value!r} is given twice", key_node.start_mark)
            seen.add(key_node.value if isinstance(key_node.value, str) else id(key_node))
        return super().construct_mapping(node, deep)


def _yaml_fault(error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or str(error)
    if mark is None:
        return f"not YAML: {problem}"
    return f"line {mark.line + 1}, column {mark.column + 1}: {problem}"


def _kind(value: Any) -> str:
    """How to call a value that is of the wrong type."""
    if value is None:
        return "missing"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return "a mapping" if isinstance(value, dict) else repr(value)


def _join(place: str, key: Any) -> str:
    return f"{place}.{key}" if place else str(key)
