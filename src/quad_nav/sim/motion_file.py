"""Motions and walkers in scene files, read and written.

    motion_phase: random           # or seconds that all motions are ahead of the clock; default 0
    walkers: {count: 10}           # people; see ``read_walkers`` for the other keys
    obstacles:
      - name: cart
        shape: box
        size: [0.8, 0.6]
        height: 1.2
        motion:
          interpolation: linear    # default; or spline
          loop: true               # default; or false, to stay at the last keyframe
          phase: 0.0               # default; or random: seconds that it is ahead of the clock
          keyframes:
            - {time: 0.0, x: 1.0, y: 2.0, yaw: 0.0}     # yaw is optional
            - {time: 4.0, x: 5.0, y: 2.0}

An obstacle with a motion needs no ``centre``. A keyframe without ``yaw`` has the yaw of the one
before it, the first one that of the obstacle.
"""

from __future__ import annotations

from typing import Any, Dict, List, Optional, Tuple

from quad_nav.files.document import Checker, describe
from quad_nav.sim.motion import INTERPOLATIONS, LINEAR, SPLINE, Motion, Walkers
from quad_nav.sim.scene import Scene

MOTION_KEYS = ("motion_phase", "walkers")
"""Keys of a scene that this module reads."""
MAX_KEYFRAMES = 10_000
"""Keyframes of a motion."""
MAX_ALL_KEYFRAMES = 200_000
"""Keyframes of a scene."""
MAX_MOVING = 1000
"""Obstacles of a scene that move, walkers included."""
MAX_WALKERS = 200
MAX_SPEED_MPS = 5.0
RANDOM = "random"

_STANDING = Motion((0.0,), ((0.0, 0.0, 0.0),))
_KEYS = ["keyframes", "loop", "interpolation", "tension", "phase"]
_KEYFRAME_KEYS = ["time", "x", "y", "yaw"]
_WALKERS_KEYS = ["count", "speed", "radius", "height", "reacting"]


def read_motion(check: Checker, obstacle: Dict[str, Any], obstacle_place: str) -> Motion:
    """Read the motion of an obstacle; after a fault it is any motion."""
    faults_before, place = len(check.problems), f"{obstacle_place}.motion"
    fields = check.mapping(obstacle["motion"], place, _KEYS)
    if fields is None:
        return _STANDING
    given_yaw = obstacle.get("yaw", 0.0)
    yaw_rad = check.as_number(given_yaw, f"{obstacle_place}.yaw") if given_yaw else 0.0
    times_s, poses = _read_keyframes(check, fields, place, yaw_rad)
    loop = _read_boolean(check, fields, "loop", place, True)
    interpolation = fields.get("interpolation", LINEAR)
    if not isinstance(interpolation, str) or interpolation not in INTERPOLATIONS:
        check.fault(
            f"{place}.interpolation", f"{describe(interpolation)}, expected linear or spline"
        )
    tension = check.number(fields, "tension", place, 0.0)
    if not 0.0 <= tension <= 1.0:
        check.fault(f"{place}.tension", f"{tension:g}, expected 0 to 1")
    if "tension" in fields and interpolation != SPLINE:
        check.fault(f"{place}.tension", "given without interpolation: spline, expected both")
    phase_s = read_phase(check, fields, "phase", place)
    if phase_s is None and not loop:
        check.fault(f"{place}.phase", "random without a loop, expected loop: true, or seconds")
    if len(check.problems) > faults_before:
        return _STANDING
    return Motion(times_s, poses, loop, interpolation, tension, phase_s)


def _read_keyframes(
    check: Checker, fields: Dict[str, Any], place: str, yaw_rad: float
) -> Tuple[Tuple[float, ...], Tuple[Tuple[float, float, float], ...]]:
    entries = fields.get("keyframes")
    where = f"{place}.keyframes"
    if not isinstance(entries, list) or not 1 <= len(entries) <= MAX_KEYFRAMES:
        check.fault(where, f"{describe(entries)}, expected a list of 1 to {MAX_KEYFRAMES}")
        return (), ()
    times_s: List[float] = []
    poses: List[Tuple[float, float, float]] = []
    for k, entry in enumerate(entries):
        keyframe = check.mapping(entry, f"{where}[{k}]", _KEYFRAME_KEYS)
        if keyframe is None:
            return (), ()
        time_s = check.number(keyframe, "time", f"{where}[{k}]")
        x_m, y_m = (check.number(keyframe, key, f"{where}[{k}]") for key in ("x", "y"))
        yaw_rad = check.number(keyframe, "yaw", f"{where}[{k}]", yaw_rad)
        if time_s < 0.0:
            check.fault(f"{where}[{k}].time", f"{time_s:g}, expected 0 or more")
        elif times_s and time_s <= times_s[-1]:
            check.fault(
                f"{where}[{k}].time",
                f"{time_s:g}, expected more than that of the keyframe before, {times_s[-1]:g}",
            )
        times_s.append(time_s)
        poses.append((x_m, y_m, yaw_rad))
    return tuple(times_s), tuple(poses)


def read_phase(check: Checker, fields: Dict[str, Any], key: str, place: str) -> Optional[float]:
    """Read a phase in seconds, default 0; None for a random one."""
    value = fields.get(key, 0.0)
    where = f"{place}.{key}" if place else key
    if isinstance(value, str):
        if value != RANDOM:
            check.fault(where, f"{describe(value)}, expected random, or seconds")
        return None
    return check.as_number(value, where)


def read_walkers(check: Checker, fields: Dict[str, Any]) -> Optional[Walkers]:
    """Read the key ``walkers`` of a scene; None without it, or after a fault."""
    if "walkers" not in fields:
        return None
    faults_before, place = len(check.problems), "walkers"
    given = check.mapping(fields[place], place, _WALKERS_KEYS)
    if given is None:
        return None
    count = given.get("count")
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MAX_WALKERS:
        check.fault(f"{place}.count", f"{describe(count)}, expected a number of 1 to {MAX_WALKERS}")
    default = Walkers(1)
    speeds = tuple(default.speed_mps)
    if "speed" in given:
        speeds = check.numbers(given, "speed", place, 2, positive=True)
        if not speeds[0] <= speeds[1] <= MAX_SPEED_MPS:
            check.fault(
                f"{place}.speed",
                f"{speeds[0]:g}, {speeds[1]:g}, expected the lowest and the highest speed, "
                f"at most {MAX_SPEED_MPS:g} m/s",
            )
    radius_m = check.number(given, "radius", place, default.radius_m, positive=True)
    height_m = check.number(given, "height", place, default.height_m, positive=True)
    reacting = _read_boolean(check, given, "reacting", place, False)
    if len(check.problems) > faults_before:
        return None
    assert isinstance(count, int)
    return Walkers(count, (speeds[0], speeds[1]), radius_m, height_m, reacting)


def _read_boolean(
    check: Checker, fields: Dict[str, Any], key: str, place: str, default: bool
) -> bool:
    value = fields.get(key, default)
    if not isinstance(value, bool):
        check.fault(f"{place}.{key}", f"{describe(value)}, expected true or false")
        return default
    return value


def check_motions(check: Checker, scene: Scene) -> None:
    """Check the numbers of moving obstacles and of keyframes of a scene."""
    moving = len(scene.moving_shapes)
    if moving > MAX_MOVING:
        check.fault("obstacles", f"{moving} of them move, expected {MAX_MOVING} at most")
    keyframes = sum(len(one.motion.times_s) for one in scene.moving)
    if keyframes > MAX_ALL_KEYFRAMES:
        check.fault("obstacles", f"{keyframes} keyframes, expected {MAX_ALL_KEYFRAMES} at most")


def motion_document(motion: Motion) -> Dict[str, Any]:
    """Return the document of a motion, which ``read_motion`` reads."""
    spline = {"tension": motion.tension} if motion.interpolation == SPLINE else {}
    return {
        "interpolation": motion.interpolation,
        **spline,
        "loop": motion.loop,
        "phase": phase_document(motion.phase_s),
        "keyframes": [
            {"time": time_s, "x": x_m, "y": y_m, "yaw": yaw_rad}
            for time_s, (x_m, y_m, yaw_rad) in zip(motion.times_s, motion.poses)
        ],
    }


def phase_document(phase_s: Optional[float]) -> Any:
    """Return the document of a phase, which ``read_phase`` reads."""
    return RANDOM if phase_s is None else phase_s


def walkers_document(walkers: Walkers) -> Dict[str, Any]:
    """Return the document of walkers, which ``read_walkers`` reads."""
    return {
        "count": walkers.count,
        "speed": list(walkers.speed_mps),
        "radius": walkers.radius_m,
        "height": walkers.height_m,
        "reacting": walkers.reacting,
    }
