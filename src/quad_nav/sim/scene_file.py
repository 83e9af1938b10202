"""Scenes from files: ``quad``'s own YAML, worlds of Gazebo and Stage, ``map_server`` maps.

    name: two rooms                # optional, else the file's name
    size: [12.0, 12.0]             # arena along x and y, m
    origin: [0.0, 0.0]             # its lower left corner in map, m; default 0, 0
    altitude: 1.0                  # flying altitude of all quadcopters, m; default 1.0
    walls: {height: 2.0, thickness: 0.1}        # optional; these are the defaults
    obstacles:
      - {name: crate, shape: box, centre: [2.2, 4.0], size: [0.8, 0.8], height: 2.0, yaw: 0.3}
      - {name: pillar, shape: cylinder, centre: [6.0, 6.0], radius: 0.4, height: 2.0}
      - {name: ball, shape: sphere, centre: [9.0, 3.0], radius: 0.5, bottom: 0.5}
    starts:                        # x, y, yaw of quadcopter 0, 1, ...; yaw may be left out
      - [1.5, 1.5, 0.0]

``bottom`` (default 0) lifts an obstacle off the floor. Obstacles with ``motion`` move, and
``walkers`` are people who walk, see ``motion_file``. A scene may also import a world or a map
and add obstacles to it:

    world: depot.world             # or map: office.yaml; in this file's folder or below it
    unknown: free                  # or occupied: how to treat unknown cells of a map

Then ``size`` and ``origin`` may be left out; they default to the extent of the obstacles or of the
map. ``starts`` may be left out too, see ``imported_scene.with_free_starts``. A world or map file
loads as a scene that imports it and gives nothing else. A file with a fault is refused as a
whole; the ``InputError`` lists every fault.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

from quad_nav.errors import InputError
from quad_nav.files.document import Checker, describe, read_yaml
from quad_nav.files.user_files import referenced_file
from quad_nav.geometry import Pose2D
from quad_nav.sim.imported_scene import (
    NOTHING,
    ImportedScene,
    Place,
    from_map,
    from_world,
    with_free_starts,
)
from quad_nav.sim.motion_file import (
    MOTION_KEYS,
    check_motions,
    read_motion,
    read_phase,
    read_walkers,
)
from quad_nav.sim.obstacles import SHAPES, Obstacle
from quad_nav.sim.scene import BODY_RADIUS_M, MovingObstacle, Scene, Walls

_KEYS = [
    "name",
    "size",
    "origin",
    "altitude",
    "walls",
    "obstacles",
    "starts",
    "world",
    "map",
    "unknown",
    *MOTION_KEYS,
]
_WORLD_SUFFIXES = (".world", ".sdf")
_ROOM_M = 2.0
"""Room on each side of a world that is no room itself, such as a table or a single wall."""
MAX_SIZE_M = 1e5
MAX_STARTS = 1000


def load_scene(path: Union[str, Path], goals: Sequence[Place] = ()) -> Scene:
    """Read a scene, a world of Gazebo or Stage (``.world``, ``.sdf``) or a ``map_server`` map.

    A YAML file with the key ``image`` is a map. Starts that the file does not give are chosen where
    robots can reach ``goals``, see ``imported_scene.with_free_starts``.

    Raises:
        InputError: The file cannot be read, or has faults; lists all of them.
    """
    document, path, folder = _read_document(path)
    return scene_from_document(document, str(path), path.stem, folder, goals)


def readable_scene(path: Union[str, Path]) -> Optional[Scene]:
    """Read the parts of a scene file that have no faults, to show them.

    ``load_scene`` has the faults. None if the arena's size is among them.
    """
    try:
        document, path, folder = _read_document(path)
    except InputError:
        return None
    return _read_scene(Checker(str(path)), document, path.stem, folder, ())


def _read_document(path: Union[str, Path]) -> Tuple[Any, Path, Path]:
    """Return the document, the path, and the folder of the files that it refers to."""
    path = Path(os.path.expanduser(path))
    place = path.resolve() if path.is_symlink() else path  # other files are relative to the target
    if path.suffix in _WORLD_SUFFIXES:
        document: Any = {"world": place.name}
    else:
        document = read_yaml(path)
        if isinstance(document, dict) and "image" in document:
            document = {"map": place.name}
    return document, path, place.parent


def scene_from_document(
    document: Any,
    source: str,
    default_name: str = "scene",
    folder: Path = Path(),
    goals: Sequence[Place] = (),
) -> Scene:
    """Check a parsed document and make a scene of it.

    Args:
        document: The document.
        source: Name of the document, for messages.
        default_name: Name of the scene if the document gives none.
        folder: Folder of the files that the document refers to.
        goals: See ``load_scene``.

    Raises:
        InputError: The document has faults; lists all of them.
    """
    check = Checker(source)
    scene = _read_scene(check, document, default_name, folder, goals)
    if scene is None or check.problems:
        raise InputError(check.problems)
    return scene


def _read_scene(
    check: Checker, document: Any, default_name: str, folder: Path, goals: Sequence[Place]
) -> Optional[Scene]:
    fields = check.mapping(document, "", _KEYS)
    if fields is None:
        return None
    faults_before = len(check.problems)
    altitude = check.number(fields, "altitude", "", 1.0, positive=True)
    walls = _read_walls(check, fields)
    imported = _read_import(check, fields, folder, walls.height_m)
    origin, size = _read_arena(check, fields, imported)
    arena_is_sound = len(check.problems) == faults_before
    entries = enumerate(check.sequence(fields, "obstacles", []))
    obstacles = [_read_obstacle(check, entry, k) for k, entry in entries]
    moving = [one for one in obstacles if isinstance(one, MovingObstacle)]
    standing = [one for one in obstacles if one and not isinstance(one, MovingObstacle)]
    starts, content = _read_starts(check, fields, imported), imported or NOTHING
    scene = Scene(
        check.text(fields, "name", "", default_name),
        size[0],
        size[1],
        altitude,
        walls,
        (*content.obstacles, *standing),
        tuple(s for s in starts if s is not None),
        origin[0],
        origin[1],
        content.remarks,
        (*content.moving, *moving),
        read_phase(check, fields, "motion_phase", ""),
        read_walkers(check, fields),
        is_map="map" in fields,
    )
    _check_solids(check, scene)
    if arena_is_sound and imported and "starts" not in fields:
        return _with_chosen_starts(check, scene, imported, goals)
    if arena_is_sound:
        _check_starts(check, scene, starts)
        return scene
    return None


def _read_walls(check: Checker, fields: Dict[str, Any]) -> Walls:
    walls = check.mapping(fields.get("walls", {}), "walls", ["height", "thickness"]) or {}
    return Walls(
        check.number(walls, "height", "walls", 2.0, positive=True),
        check.number(walls, "thickness", "walls", 0.1, positive=True),
    )


def _read_import(
    check: Checker, fields: Dict[str, Any], folder: Path, height_m: float
) -> Optional[ImportedScene]:
    """Import the world or map that the scene names, if it names one."""
    unknown = fields.get("unknown", "free")
    if not isinstance(unknown, str) or unknown not in ("free", "occupied"):
        check.fault("unknown", f"{describe(unknown)}, expected free or occupied")
    if "unknown" in fields and "map" not in fields:
        check.fault("unknown", "given without a map, expected the key map too")
    if "world" in fields and "map" in fields:
        check.fault("map", "given together with world, expected one of them")
        return None
    try:
        if "world" in fields:
            path = referenced_file(folder, check.text(fields, "world", "", "."))
            return from_world(path, height_m)
        if "map" in fields:
            path = referenced_file(folder, check.text(fields, "map", "", "."))
            return from_map(path, height_m, unknown == "occupied")
    except InputError as error:
        check.problems += error.problems
    return None


def _read_arena(
    check: Checker, fields: Dict[str, Any], imported: Optional[ImportedScene]
) -> Tuple[Sequence[float], Sequence[float]]:
    """Return x and y of the lower left corner, and the sizes along x and y."""
    is_imported = "world" in fields or "map" in fields
    unknown = (0.0, 0.0), (1.0, 1.0)
    if is_imported and "size" not in fields and "origin" not in fields:
        if imported is None:
            return unknown
        if imported.extent is None:
            problem = "missing, and the world has no obstacles that give the arena its size"
            expected = "expected a scene with world, size and origin, or the map of map_server"
            check.fault("size", "; ".join((problem, *imported.remarks, expected)))
            return unknown
        x, y, end_x, end_y = imported.extent
        is_narrow = "world" in fields and min(end_x - x, end_y - y) < 2 * _ROOM_M
        room = _ROOM_M if is_narrow else 0.0
        return (x - room, y - room), (end_x - x + 2 * room, end_y - y + 2 * room)
    size = check.numbers(fields, "size", "", 2, positive=True)
    if max(size) > MAX_SIZE_M:
        check.fault("size", f"{max(size):g} m, expected {MAX_SIZE_M:g} m at most")
    if "origin" in fields or is_imported:
        return check.numbers(fields, "origin", "", 2), size
    return (0.0, 0.0), size


def _read_obstacle(
    check: Checker, entry: Any, number: int
) -> Union[Obstacle, MovingObstacle, None]:
    """Return an obstacle, None after a fault. One with a motion stands at its first keyframe."""
    if not isinstance(entry, dict) or "motion" not in entry:
        return _read_shape(check, entry, number)
    faults_before, place = len(check.problems), f"obstacles[{number}]"
    motion = read_motion(check, entry, place)
    x_m, y_m, yaw_rad = motion.poses[0]
    if "centre" not in entry:
        entry = {**entry, "centre": [x_m, y_m]}
    shape = _read_shape(check, entry, number)
    if shape is None or len(check.problems) > faults_before:
        return None
    return MovingObstacle(shape.placed((x_m, y_m, yaw_rad)), motion)


def _read_shape(check: Checker, entry: Any, number: int) -> Optional[Obstacle]:
    faults_before, place = len(check.problems), f"obstacles[{number}]"
    if not isinstance(entry, dict):
        check.fault(place, f"{describe(entry)}, expected a mapping that describes an obstacle")
        return None
    shape = entry.get("shape")
    kind = SHAPES.get(shape) if isinstance(shape, str) else None
    if kind is None:
        *most, last = SHAPES
        check.fault(f"{place}.shape", f"{describe(shape)}, expected {', '.join(most)} or {last}")
        return None
    check.mapping(entry, place, ["name", "shape", "centre", *kind.keys, "motion"])
    name = check.text(entry, "name", place, f"obstacle_{number}")
    x_m, y_m = check.numbers(entry, "centre", place, 2)
    obstacle = kind.read(check, entry, place, name, x_m, y_m)
    return obstacle if len(check.problems) == faults_before else None


def _read_starts(
    check: Checker, fields: Dict[str, Any], imported: Optional[ImportedScene]
) -> List[Optional[Pose2D]]:
    is_imported = "world" in fields or "map" in fields
    starts = check.sequence(fields, "starts", [] if is_imported else None)
    if len(starts) > MAX_STARTS:
        check.fault("starts", f"{len(starts)} poses, expected {MAX_STARTS} at most")
        return []
    if fields.get("starts") == []:
        check.fault("starts", "no start pose, expected at least one [x, y, yaw]")
    return [_read_start(check, entry, f"starts[{k}]") for k, entry in enumerate(starts)]


def _with_chosen_starts(
    check: Checker, scene: Scene, imported: ImportedScene, goals: Sequence[Place]
) -> Scene:
    scene = with_free_starts(scene, imported.may_start, goals)
    if not scene.starts:
        check.fault(
            "starts",
            "missing, and no free position was found in an arena of "
            f"{scene.size_x_m:g} x {scene.size_y_m:g} m; expected a scene file with world or map, "
            "origin and size of a larger arena, or starts",
        )
    chosen = ", ".join(f"[{start.x_m:.2f}, {start.y_m:.2f}]" for start in scene.starts)
    remark = f"{check.source}: starts: not given, quadcopters start at {chosen}"
    return replace(scene, remarks=(*scene.remarks, remark))


def _read_start(check: Checker, entry: Any, place: str) -> Optional[Pose2D]:
    faults_before = len(check.problems)
    if not isinstance(entry, list) or len(entry) not in (2, 3):
        check.fault(place, f"{describe(entry)}, expected [x, y] or [x, y, yaw]")
        return None
    start = Pose2D(*[check.as_number(v, f"{place}[{k}]") for k, v in enumerate(entry)])
    return start if len(check.problems) == faults_before else None


def _check_solids(check: Checker, scene: Scene) -> None:
    """Check the motions, and that names are unique, because they identify obstacles in contacts."""
    check_motions(check, scene)
    taken = {wall.name for wall in scene.wall_boxes()} | {"floor"}
    for obstacle in (*scene.obstacles, *scene.moving_shapes):
        if obstacle.name in taken:
            check.fault("obstacles", f"name {obstacle.name!r} is taken, expected unique names")
        taken.add(obstacle.name)


def _check_starts(check: Checker, scene: Scene, starts: Sequence[Optional[Pose2D]]) -> None:
    """Check that a quadcopter fits at each start; unreadable ones are None."""
    readable = [(k, start) for k, start in enumerate(starts) if start is not None]
    for k, start in readable:
        problem = _start_problem(scene, start)
        if problem:
            check.fault(f"starts[{k}]", problem)
        for other_k, other in readable[: readable.index((k, start))]:
            distance_m = start.distance_to(other)
            if distance_m <= 2 * BODY_RADIUS_M:
                expected = f"expected more than two body radii, {2 * BODY_RADIUS_M:g} m"
                problem = f"is {distance_m:.2f} m from starts[{other_k}], {expected}"
                check.fault(f"starts[{k}]", problem)


def outside_problem(scene: Scene, start: Pose2D) -> str:
    """Return that a start pose is outside the arena, "" if it is not."""
    if scene.contains(start.x_m, start.y_m):
        return ""
    return (
        f"({start.x_m:g}, {start.y_m:g}) is outside the arena, expected"
        f" {scene.origin_x_m:g} < x < {scene.end_x_m:g}"
        f" and {scene.origin_y_m:g} < y < {scene.end_y_m:g}"
    )


def _start_problem(scene: Scene, start: Pose2D) -> str:
    outside = outside_problem(scene, start)
    if outside:
        return outside
    point = (start.x_m, start.y_m, scene.altitude_m)
    nearest = scene.nearest(*point)
    distance_m = nearest.surface_distance_m(*point)
    if distance_m <= BODY_RADIUS_M:
        return (
            f"({start.x_m:g}, {start.y_m:g}) is {distance_m:.2f} m from {nearest.name}, expected "
            f"more than a quadcopter's radius, {BODY_RADIUS_M:g} m"
        )
    return ""
