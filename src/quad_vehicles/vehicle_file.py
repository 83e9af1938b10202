"""Files of vehicles: what flies instead of the simulator.

    roof: true                     # indoors (default): an autopilot that would climb is refused
    localization: fixed            # who publishes map -> odom{i}: fixed, amcl, slam or none
    map: hall.yaml                 # of amcl: a map of map_server, a scene or a world
    vehicles:
      - number: 0                  # robot 0: /cmd_vel0, /odom0, /scan0
        kind: mavlink              # mavlink, crazyflie or simulated
        autopilot: ardupilot       # ardupilot or px4; of kind mavlink
        address: udpin:127.0.0.1:14550      # pymavlink's or cflib's address
        system: 1                  # MAVLink's system number of the vehicle; default 1
        bridge_system: 240         # that of the bridge; default 240 minus the vehicle's number
        radio: true                # a pilot's transmitter is in use; default true
        altitude: 1.0              # flying altitude above the place of take-off, m
        start: [1.5, 1.5, 0.0]     # where it stands in map at take-off: x, y, yaw
        limits: {speed: 0.7, climb: 0.3, yaw_rate: 1.0, height: 2.5, radius: 30.0, battery: 0.2}
        lidar: {topic: /scan0, mount: [0.0, 0.0, 0.06, 0.0]}
        failsafes: check           # or set: write the failsafes' parameters
      - number: 1
        kind: crazyflie
        address: radio://0/80/2M/E7E7E7E7E7
        start: [10.0, 2.0, 3.14]
        link_lost: falls           # it has no other failsafe; required
        lidar: {multiranger: true}

With ``localization: fixed`` the bridge publishes ``map -> odom{i}``, which follows from ``start``
at take-off, or is the pose ``odom: [x, y, z, yaw]``. ``amcl`` and ``slam`` begin at ``start``; with
``none`` another node publishes the transform. ``map`` is relative to the file's folder. Vehicles of
kind ``simulated`` know their places. A LIDAR is a driver's ``topic``, or ``obstacle_distance:
true`` for MAVLink's message, or ``multiranger: true`` for the Crazyflie's deck; without ``lidar``
another node publishes ``/scan{i}``.

A file with a fault is refused as a whole; the ``InputError`` lists every fault.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from quad_nav.errors import InputError
from quad_nav.files.document import Checker, describe, read_yaml
from quad_nav.geometry import Pose2D, Pose3D, quaternion_from_yaw
from quad_vehicles.addresses import check_addresses, read_address
from quad_vehicles.telemetry import Limits

KINDS = ("mavlink", "crazyflie", "simulated")
AUTOPILOTS = ("ardupilot", "px4")
FAILSAFES = ("check", "set")
FIXED, AMCL, SLAM, NONE = "fixed", "amcl", "slam", "none"
LOCALIZATIONS = (FIXED, AMCL, SLAM, NONE)
LINK_LOST = "falls"
LINK_LOST_PROBLEM = (
    "a crazyflie that hears nothing stops its motors after 2 s, and nothing else can be set;"
    f" expected 'link_lost: {LINK_LOST}' to allow that"
)
MAX_VEHICLES = 100
_KEYS = [
    "number",
    "kind",
    "autopilot",
    "address",
    "system",
    "bridge_system",
    "radio",
    "altitude",
    "start",
    "odom",
    "limits",
    "lidar",
    "failsafes",
    "link_lost",
]
_MOUNT = (0.0, 0.0, 0.06, 0.0)
OUR_SYSTEM = 240
"""MAVLink's system number of the bridge of vehicle 0; that of vehicle i is i less. Each autopilot
counts the heartbeats of its own bridge alone: those of another bridge, or of a ground station,
which is 255 in most programs, would hide that its bridge has died."""
_MAX_SYSTEM = 254
LEAST_ALTITUDE_M = 0.2
LEAST_APART_M = 0.2
_LIMITS: Mapping[str, Tuple[str, float]] = MappingProxyType(
    {
        "speed": ("speed_mps", 5.0),  # ArduPilot's WPNAV_SPEED
        "climb": ("climb_mps", 2.5),  # its WPNAV_SPEED_UP
        "yaw_rate": ("yaw_rate_radps", 3.5),  # PX4's MC_YAWRATE_MAX, 200 degrees/s
        "height": ("height_m", 120.0),  # the law's in many countries
        "radius": ("radius_m", 500.0),  # about as far as a pilot sees it
        "battery": ("battery", 1.0),
    }
)
"""Attribute and largest value of each limit: a limit that cannot be right protects nobody."""


@dataclass(frozen=True)
class Lidar:
    """Source of a vehicle's scans.

    Attributes:
        topic: Topic of a driver; "" if there is none.
        is_obstacle_distance: Whether scans are made of MAVLink's ``OBSTACLE_DISTANCE``.
        is_multiranger: Whether scans are made of a Crazyflie's Multi-ranger.
        base_from_lidar: Mount of the LIDAR.
    """

    topic: str = ""
    is_obstacle_distance: bool = False
    is_multiranger: bool = False
    base_from_lidar: Pose3D = Pose3D(*_MOUNT[:3])


@dataclass(frozen=True)
class Vehicle:
    """One vehicle of the file.

    Attributes:
        number: Number of the robot.
        kind: One of ``KINDS``.
        autopilot: One of ``AUTOPILOTS``.
        address: Address of the connection.
        system: MAVLink's number of the vehicle.
        has_radio: Whether a pilot's transmitter is in use.
        has_roof: Whether it flies indoors.
        altitude_m: Flying altitude above the place of take-off.
        limits: Limits that the bridge enforces.
        lidar: Source of the scans; None if another node publishes them.
        map_from_start: Where it stands in ``map`` at take-off; None if nobody says so.
        map_from_odom: Fixed pose of the odometry frame; None for another way.
        sets_failsafes: Whether the bridge writes the failsafes' parameters.
        bridge_system: MAVLink's number of the bridge.
        localization: One of ``LOCALIZATIONS``.
        map_file: File of amcl's map; "" for that of the scene.
    """

    number: int
    kind: str
    autopilot: str = "ardupilot"
    address: str = ""
    system: int = 1
    has_radio: bool = True
    has_roof: bool = True
    altitude_m: float = 1.0
    limits: Limits = Limits()
    lidar: Optional[Lidar] = None
    map_from_start: Optional[Pose2D] = None
    map_from_odom: Optional[Pose3D] = None
    sets_failsafes: bool = False
    bridge_system: int = OUR_SYSTEM
    localization: str = FIXED
    map_file: str = ""

    @property
    def name(self) -> str:
        """Name of the robot, for messages."""
        return f"quad{self.number}"


StartProblem = Callable[[Pose2D], str]
"""Returns why a vehicle cannot stand at a pose in ``map``, "" if it can."""


def load_vehicles(
    path: Union[str, Path], start_problem: Optional[StartProblem] = None
) -> Tuple[Vehicle, ...]:
    """Read the vehicles of a file, in the order of their numbers.

    Args:
        path: The file.
        start_problem: Knows the room, if that is known.

    Raises:
        InputError: The file cannot be read, or has faults; lists all of them.
    """
    path = Path(path).expanduser()
    return vehicles_from_document(read_yaml(path), str(path), start_problem)


def vehicles_from_document(
    document: Any, source: str, start_problem: Optional[StartProblem] = None
) -> Tuple[Vehicle, ...]:
    """Check a parsed document and return its vehicles.

    Args:
        document: The document.
        source: Name of its file, for messages.
        start_problem: Knows the room, if that is known.

    Raises:
        InputError: The document has faults; lists all of them.
    """
    check = Checker(source)
    fields = check.mapping(document, "", ["roof", "localization", "map", "vehicles"])
    vehicles: List[Vehicle] = []
    if fields is not None:
        localization = _choice(check, fields, "localization", "", LOCALIZATIONS, FIXED)
        common = {
            "has_roof": _flag(check, fields, "roof", "", True),
            "localization": localization,
            "map_file": _read_map(check, fields, localization),
        }
        entries = check.sequence(fields, "vehicles")
        if not 0 < len(entries) <= MAX_VEHICLES and not check.problems:
            check.fault("vehicles", f"{len(entries)} vehicles, expected 1 to {MAX_VEHICLES}")
        found = [_read_vehicle(check, entry, k, common) for k, entry in enumerate(entries)]
        vehicles = [vehicle for vehicle in found if vehicle is not None]
        _check_numbers(check, found)
        check_addresses(check, [vehicle.address if vehicle else "" for vehicle in found])
        _check_starts(check, found, start_problem)
    if check.problems:
        raise InputError(check.problems)
    return tuple(sorted(vehicles, key=lambda vehicle: vehicle.number))


def _read_map(check: Checker, fields: Dict[str, Any], localization: str) -> str:
    if "map" not in fields:
        return ""
    text = check.text(fields, "map", "", "")
    path = Path(check.source).parent / Path(text).expanduser()
    if localization != AMCL:
        check.fault("map", f"given with localization {localization}, expected {AMCL}")
    elif text and not path.is_file():
        check.fault("map", f"{path} is no file, expected a map, a scene or a world")
    return str(path)


def _read_vehicle(
    check: Checker, entry: Any, index: int, common: Dict[str, Any]
) -> Optional[Vehicle]:
    place = f"vehicles[{index}]"
    fields = check.mapping(entry, place, _KEYS)
    if fields is None:
        return None
    kind = _choice(check, fields, "kind", place, KINDS, "")
    limits = _read_limits(check, fields.get("limits", {}), f"{place}.limits")
    altitude_m = check.number(fields, "altitude", place, 1.0, positive=True)
    problem = limits.height_problem(altitude_m)
    if altitude_m < LEAST_ALTITUDE_M:
        check.fault(f"{place}.altitude", f"{altitude_m:g}, expected {LEAST_ALTITUDE_M:g} m or more")
    elif problem and not check.problems:
        check.fault(f"{place}.altitude", problem)
    if kind == "crazyflie" and fields.get("link_lost") != LINK_LOST:
        check.fault(f"{place}.link_lost", LINK_LOST_PROBLEM)
    start, odom = _read_frames(check, fields, place, common["localization"])
    number = _whole(check, fields, "number", place, None, MAX_VEHICLES - 1)
    return Vehicle(
        number,
        kind,
        _choice(check, fields, "autopilot", place, AUTOPILOTS, "ardupilot"),
        read_address(check, fields, place, kind),
        _whole(check, fields, "system", place, 1, _MAX_SYSTEM),
        _flag(check, fields, "radio", place, True),
        altitude_m=altitude_m,
        limits=limits,
        lidar=_read_lidar(check, fields.get("lidar"), f"{place}.lidar", kind),
        map_from_start=start,
        map_from_odom=odom,
        sets_failsafes=_choice(check, fields, "failsafes", place, FAILSAFES, "check") == "set",
        bridge_system=_whole(
            check, fields, "bridge_system", place, OUR_SYSTEM - number, _MAX_SYSTEM
        ),
        **common,
    )


def _read_limits(check: Checker, value: Any, place: str) -> Limits:
    defaults = Limits()
    fields = check.mapping(value, place, list(_LIMITS))
    if fields is None:
        return defaults
    values: Dict[str, float] = {}
    for name, (attribute, most) in _LIMITS.items():
        default, is_positive = getattr(defaults, attribute), name != "battery"
        values[attribute] = check.number(fields, name, place, default, is_positive)
        if is_positive and values[attribute] > most:
            check.fault(f"{place}.{name}", f"{values[attribute]:g}, expected {most:g} or less")
    limits = Limits(**values)
    if not 0.0 <= limits.battery < 1.0:
        check.fault(f"{place}.battery", f"{limits.battery:g}, expected a share from 0 to 1")
    return limits


def _read_frames(
    check: Checker, fields: Dict[str, Any], place: str, localization: str
) -> Tuple[Optional[Pose2D], Optional[Pose3D]]:
    """Return the pose at the start and the fixed pose of the frame, None for what is not given."""
    is_simulated = fields.get("kind") == "simulated"
    if is_simulated and localization == SLAM:
        check.fault(f"{place}.kind", f"simulated with localization {SLAM}, expected a real vehicle")
    given = [key for key in ("start", "odom") if key in fields]
    allowed = ("start", "odom") if localization == FIXED else ("start",)
    is_sound = len(given) == 1 and given[0] in allowed
    if not (is_sound or is_simulated or (localization == NONE and not given)):
        what = f"{' and '.join(given) or 'none'} given with localization {localization}"
        check.fault(place, f"{what}, expected {' or '.join(allowed)}")
        return None, None
    if "start" in fields:
        x_m, y_m, yaw_rad = check.numbers(fields, "start", place, 3)
        return Pose2D(x_m, y_m, yaw_rad), None
    if "odom" in fields:
        x_m, y_m, z_m, yaw_rad = check.numbers(fields, "odom", place, 4)
        return None, Pose3D(x_m, y_m, z_m, quaternion_from_yaw(yaw_rad))
    return None, None


def _read_lidar(check: Checker, value: Any, place: str, kind: str) -> Optional[Lidar]:
    if value is None:
        return None
    fields = check.mapping(value, place, ["topic", "obstacle_distance", "multiranger", "mount"])
    if fields is None:
        return None
    is_distance = _flag(check, fields, "obstacle_distance", place, False)
    is_multiranger = _flag(check, fields, "multiranger", place, False)
    if is_distance + is_multiranger + ("topic" in fields) != 1:
        check.fault(place, "expected one of topic, obstacle_distance: true, multiranger: true")
    if is_distance and kind != "mavlink":
        check.fault(f"{place}.obstacle_distance", f"a {kind} vehicle has no such message")
    if is_multiranger and kind != "crazyflie":
        check.fault(f"{place}.multiranger", f"a {kind} vehicle has no such deck")
    x_m, y_m, z_m, yaw_rad = (
        check.numbers(fields, "mount", place, 4) if "mount" in fields else _MOUNT
    )
    topic = check.text(fields, "topic", place, "") if "topic" in fields else ""
    return Lidar(
        topic, is_distance, is_multiranger, Pose3D(x_m, y_m, z_m, quaternion_from_yaw(yaw_rad))
    )


def _check_numbers(check: Checker, found: Sequence[Optional[Vehicle]]) -> None:
    """Find numbers that are given twice or left out, and system numbers of a bridge."""
    if check.problems:
        return
    vehicles = [vehicle for vehicle in found if vehicle is not None]
    numbers = sorted(vehicle.number for vehicle in vehicles)
    if numbers != list(range(len(found))):
        check.fault("vehicles", f"numbers {numbers}, expected each of 0 to {len(found) - 1} once")
        return
    bridged = [(k, vehicle) for k, vehicle in enumerate(vehicles) if vehicle.kind == "mavlink"]
    taken = {vehicle.system for _, vehicle in bridged}
    for k, vehicle in bridged:
        if vehicle.bridge_system in taken:
            what = f"{vehicle.bridge_system}, the number of a vehicle or of another bridge"
            check.fault(f"vehicles[{k}].bridge_system", f"{what}, expected one of its own")
        taken.add(vehicle.bridge_system)


def _check_starts(
    check: Checker, found: Sequence[Optional[Vehicle]], start_problem: Optional[StartProblem]
) -> None:
    """Find places that two vehicles cannot share, and those that are out of the room."""
    starts = [None if vehicle is None else vehicle.map_from_start for vehicle in found]
    for k, start in enumerate(starts):
        place = f"vehicles[{k}].start"
        problem = start_problem(start) if start and start_problem else ""
        if problem:
            check.fault(place, problem)
        for j, other in enumerate(starts[:k]):
            if start and other and start.distance_to(other) < LEAST_APART_M:
                what = f"{start.distance_to(other):.2f} m from vehicles[{j}].start"
                check.fault(place, f"{what}, expected {LEAST_APART_M:g} m or more")


def _whole(
    check: Checker, fields: Dict[str, Any], key: str, place: str, default: Any, most: int
) -> int:
    value = fields.get(key, default)
    least = 0 if key == "number" else 1
    if isinstance(value, int) and not isinstance(value, bool) and least <= value <= most:
        return value
    check.fault(f"{place}.{key}", f"{describe(value)}, expected a whole number, {least} to {most}")
    return 0


def _flag(check: Checker, fields: Dict[str, Any], key: str, place: str, default: bool) -> bool:
    value = fields.get(key, default)
    if isinstance(value, bool):
        return value
    check.fault(_at(place, key), f"{describe(value)}, expected true or false")
    return default


def _choice(
    check: Checker,
    fields: Dict[str, Any],
    key: str,
    place: str,
    names: Tuple[str, ...],
    default: str,
) -> str:
    value = fields.get(key, default or None)
    if value in names:
        return str(value)
    check.fault(_at(place, key), f"{describe(value)}, expected {' or '.join(names)}")
    return names[0]


def _at(place: str, key: str) -> str:
    return f"{place}.{key}" if place else key
