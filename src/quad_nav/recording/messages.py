"""Encode and decode ROS 1 messages without ROS.

``rosbags`` knows the common message types; our own are read from ``msg/``, and those of navigation
are added here. A message is one of its dataclasses, for example
``message("geometry_msgs/Point", x, y, z)``. Stamps are in nanoseconds.
"""

from __future__ import annotations

import functools
from typing import Any, Dict, Iterable, Mapping, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from quad_nav.costmap.cost_grid import occupancy
from quad_nav.files.shipped import shipped
from quad_nav.geometry import (
    Pose2D,
    Pose3D,
    Scan,
    Twist2D,
    covariance_36,
    quaternion_from_yaw,
)
from quad_nav.grid import GridSpec
from quad_nav.sim.robot_state import RobotStates
from quad_nav.topics.estimates import ESTIMATE_KIND, TRUTH_KIND
from quad_nav.topics.flight_info import FlightInfo
from quad_nav.topics.markers import Marker

_DEFINITIONS = {
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "map_msgs/msg/OccupancyGridUpdate": (
        "std_msgs/Header header\nint32 x\nint32 y\nuint32 width\nuint32 height\nint8[] data"
    ),
    "move_base_msgs/msg/RecoveryStatus": (
        "geometry_msgs/PoseStamped pose_stamped\nuint16 current_recovery_number\n"
        "uint16 total_number_of_recoveries\nstring recovery_behavior_name"
    ),
    "move_base_msgs/msg/MoveBaseGoal": "geometry_msgs/PoseStamped target_pose",
    "move_base_msgs/msg/MoveBaseFeedback": "geometry_msgs/PoseStamped base_position",
    "move_base_msgs/msg/MoveBaseResult": "",
    "move_base_msgs/msg/MoveBaseActionGoal": (
        "std_msgs/Header header\nactionlib_msgs/GoalID goal_id\nMoveBaseGoal goal"
    ),
    "move_base_msgs/msg/MoveBaseActionFeedback": (
        "std_msgs/Header header\nactionlib_msgs/GoalStatus status\nMoveBaseFeedback feedback"
    ),
    "move_base_msgs/msg/MoveBaseActionResult": (
        "std_msgs/Header header\nactionlib_msgs/GoalStatus status\nMoveBaseResult result"
    ),
}

_NS = 10**9
_ZEROS_36 = np.zeros(36)


def _store() -> Any:
    store = get_typestore(Stores.ROS1_NOETIC)
    types: Dict[str, Any] = {}
    own = {f"quad/msg/{path.stem}": path.read_text() for path in shipped("msg").glob("*.msg")}
    for name, text in {**_DEFINITIONS, **own}.items():
        types.update(get_types_from_msg(text, name))
    store.register(types)
    return store


_STORE = _store()


def long_name(kind: str) -> str:
    """Convert a type name such as ``nav_msgs/Path`` to the spelling of rosbags."""
    package, name = kind.split("/")
    return f"{package}/msg/{name}"


def definition(kind: str) -> Tuple[str, str]:
    """Return the full text and the MD5 sum of a type's definition."""
    text, digest = _STORE.generate_msgdef(long_name(kind))
    return text, digest


def message(kind: str, *fields: Any) -> Any:
    """Build a message of a type, for example ``nav_msgs/Path``, from its fields in order.

    A tuple stands for a message inside of it: that of its fields in order.
    """
    made, inner = _layout(kind)
    return made(
        *(
            message(own, *value) if own and isinstance(value, tuple) else value
            for own, value in zip(inner, fields)
        )
    )


@functools.lru_cache(maxsize=None)
def _layout(kind: str) -> Tuple[Any, Tuple[str, ...]]:
    """Return the class of a type, and the type of each field that is a message, else ""."""
    name = long_name(kind)
    fields = (field for _, field in _STORE.get_msgdef(name).fields)
    return _STORE.types[name], tuple(
        own.replace("/msg/", "/") if node == Nodetype.NAME else "" for node, own in fields
    )


def encode(content: Any) -> bytes:
    """Serialize a message."""
    return bytes(_STORE.serialize_ros1(content, content.__msgtype__))


def decode(data: bytes, kind: str) -> Any:
    """Deserialize a message of a type.

    Raises:
        Exception: The bytes are not such a message. rosbags raises errors of struct and numpy.
    """
    return _STORE.deserialize_ros1(data, long_name(kind))


def constant(kind: str, name: str) -> int:
    """Return a constant of a type, for example ``ACTIVE`` of ``actionlib_msgs/GoalStatus``."""
    return int(getattr(_STORE.types[long_name(kind)], name))


def stamp_ns(stamp: Any) -> int:
    """Convert a ROS time to nanoseconds."""
    return int(stamp.sec) * _NS + int(stamp.nanosec)


def time(stamp: int) -> Tuple[int, int]:
    """Return the fields of a ROS time."""
    return divmod(stamp, _NS)


def header(frame: str, stamp: int) -> Tuple[Any, ...]:
    """Return the fields of a ``std_msgs/Header``."""
    return 0, time(stamp), frame


def place(at: Pose3D) -> Tuple[Any, ...]:
    """Return the fields of a ``geometry_msgs/Pose`` or ``geometry_msgs/Transform``."""
    return (at.x_m, at.y_m, at.z_m), at.quaternion


def pose_stamped(at: Pose3D, frame: str, stamp: int) -> Any:
    """Build a ``geometry_msgs/PoseStamped``."""
    return message("geometry_msgs/PoseStamped", header(frame, stamp), place(at))


def planar_pose(at: Pose2D, z_m: float = 0.0) -> Pose3D:
    """Convert a planar pose to an upright pose at height ``z_m``."""
    return Pose3D(at.x_m, at.y_m, z_m, quaternion_from_yaw(at.yaw_rad))


def pose_array(poses: NDArray[np.float64], stamp: int) -> Any:
    """Build a ``geometry_msgs/PoseArray`` of poses (x_m, y_m, yaw_rad) in ``map``, shape (n, 3)."""
    upright = (place(planar_pose(Pose2D(*row))) for row in poses.tolist())
    shown = [message("geometry_msgs/Pose", *one) for one in upright]
    return message("geometry_msgs/PoseArray", header("map", stamp), shown)


def stamped(kind: str, fields: Mapping[str, Any], stamp: int, frame: str = "map") -> Any:
    """Build a message of a type from its fields; its header, if it has one, gets the stamp."""
    made, _ = _layout(kind)
    if "header" in made.__dataclass_fields__:
        own = message("std_msgs/Header", *header(frame, stamp))
        return made(header=own, **fields)
    return made(**fields)


def flight_info(info: FlightInfo) -> Any:
    """Build a ``quad/FlightInfo``."""
    fields = info.fields
    robots = [stamped("quad/RobotInfo", robot, 0) for robot in fields["robots"]]
    return stamped("quad/FlightInfo", {**fields, "robots": robots}, 0)


def clock(stamp: int) -> Any:
    """Build a ``rosgraph_msgs/Clock``."""
    return message("rosgraph_msgs/Clock", time(stamp))


def transform(parent_from_child: Pose3D, parent: str, child: str, stamp: int) -> Any:
    """Build a ``geometry_msgs/TransformStamped``."""
    own = header(parent, stamp)
    return message("geometry_msgs/TransformStamped", own, child, place(parent_from_child))


def command(velocity: Twist2D) -> Any:
    """Build the ``geometry_msgs/Twist`` of a velocity command."""
    linear = velocity.vx_mps, velocity.vy_mps, 0.0
    return message("geometry_msgs/Twist", linear, (0.0, 0.0, velocity.vyaw_radps))


def odometry(
    odom_from_base: Pose3D,
    linear_mps: Sequence[float],
    angular_radps: Sequence[float],
    frames: Tuple[str, str],
    stamp: int,
    covariance: NDArray[np.float64] = _ZEROS_36,
) -> Any:
    """Build a ``nav_msgs/Odometry``; velocities are in the body frame, the second of ``frames``."""
    twist = tuple(linear_mps), tuple(angular_radps)
    return message(
        "nav_msgs/Odometry",
        header(frames[0], stamp),
        frames[1],
        (place(odom_from_base), covariance),
        (twist, _ZEROS_36),
    )


def pose_estimate(at: Pose2D, covariance: NDArray[np.float64], stamp: int) -> Any:
    """Build a ``geometry_msgs/PoseWithCovarianceStamped`` in ``map``; ``covariance`` is planar."""
    estimate = place(planar_pose(at)), covariance_36(covariance)
    return message(ESTIMATE_KIND, header("map", stamp), estimate)


def true_states(states: RobotStates, stamp: int) -> Any:
    """Build the message of ``TRUTH_TOPIC``."""
    names = [f"quad{robot}" for robot in range(len(states))]
    poses = [message("geometry_msgs/Transform", *place(one.map_from_base)) for one in states]
    twists = [message("geometry_msgs/Twist", one.linear_mps, one.angular_radps) for one in states]
    return message(TRUTH_KIND, header("map", stamp), names, poses, twists, [])


def laser_scan(scan: Scan, frame: str, stamp: int) -> Any:
    """Build a ``sensor_msgs/LaserScan``."""
    angle_max = scan.angle_min_rad + (len(scan.ranges_m) - 1) * scan.angle_increment_rad
    return message(
        "sensor_msgs/LaserScan",
        header(frame, stamp),
        scan.angle_min_rad,
        angle_max,
        scan.angle_increment_rad,
        0.0,
        0.0,
        scan.range_min_m,
        scan.range_max_m,
        scan.ranges_m,
        np.zeros(0, dtype=np.float32),
    )


def polygon(points: NDArray[np.float64], frame: str, stamp: int) -> Any:
    """Build a ``geometry_msgs/PolygonStamped`` from corners, shape (n, 2), metres in ``frame``."""
    corners = [message("geometry_msgs/Point32", x, y, 0.0) for x, y in points.tolist()]
    return message("geometry_msgs/PolygonStamped", header(frame, stamp), (corners,))


def occupancy_grid(spec: GridSpec, costs: NDArray[np.uint8], frame: str, stamp: int) -> Any:
    """Build a ``nav_msgs/OccupancyGrid`` from costs, shape (size_y, size_x)."""
    origin = place(Pose3D(spec.origin_x_m, spec.origin_y_m, 0.0))
    info = time(0), spec.resolution_m, spec.size_x, spec.size_y, origin
    return message("nav_msgs/OccupancyGrid", header(frame, stamp), info, occupancy(costs).ravel())


def grid_update(costs: NDArray[np.uint8], x0: int, y0: int, frame: str, stamp: int) -> Any:
    """Build a ``map_msgs/OccupancyGridUpdate`` from costs of a window, shape (height, width).

    Its lower left cell is that of column ``x0`` and row ``y0`` of the costmap.
    """
    height, width = costs.shape
    window = x0, y0, width, height, occupancy(costs).ravel()
    return message("map_msgs/OccupancyGridUpdate", header(frame, stamp), *window)


def marker_array(shown: Sequence[Marker], replaces_all: bool = False, stamp: int = 0) -> Any:
    """Build a ``visualization_msgs/MarkerArray``.

    Args:
        shown: Markers to add.
        replaces_all: Delete all markers of the topic first.
        stamp: Time of the markers, ns; 0 if they hold at any time.
    """
    markers = [_marker(one, "ADD", stamp) for one in shown]
    if replaces_all:
        nothing = Marker("map", "", 0, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))
        markers.insert(0, _marker(nothing, "DELETEALL", stamp))
    return message("visualization_msgs/MarkerArray", markers)


def _marker(one: Marker, action: str, stamp: int) -> Any:
    return message(
        "visualization_msgs/Marker",
        header(one.frame, stamp),
        one.namespace,
        one.number,
        one.kind,
        constant("visualization_msgs/Marker", action),
        place(Pose3D(*one.place_m, quaternion_from_yaw(one.yaw_rad))),
        one.size_m,
        one.rgba,
        time(0),
        one.frame_locked,
        [message("geometry_msgs/Point", *at) for at in one.points_m],
        [],
        one.text,
        "",
        False,
    )


def pose_from(position: Any, orientation: Any) -> Pose3D:
    """Convert a message's point or vector and its quaternion to a pose."""
    return Pose3D(
        position.x,
        position.y,
        position.z,
        (orientation.x, orientation.y, orientation.z, orientation.w),
    )


def plan_bytes(plan: NDArray[np.float64], frame: str, stamp: int) -> bytes:
    """Serialize a plan as ``nav_msgs/Path``.

    All poses have records of one size, so numpy writes them at once: a plan has hundreds of
    poses and is written 20 times a second.

    Args:
        plan: Poses (x, y, yaw), shape (n, 3), metres and radians in ``frame``.
        frame: Frame of the plan.
        stamp: Time of the path and of every pose, nanoseconds.
    """
    records = np.zeros(len(plan), dtype=_record(len(frame.encode())))
    records["sec"], records["nsec"] = stamp // _NS, stamp % _NS
    records["length"], records["frame"] = len(frame.encode()), frame.encode()
    records["place"][:, :2] = plan[:, :2]
    half_rad = plan[:, 2] / 2.0
    records["quaternion"][:, 2] = np.sin(half_rad)
    records["quaternion"][:, 3] = np.cos(half_rad)
    return _path(frame, stamp, len(plan), records.tobytes())


def path_bytes(poses: Iterable[bytes], frame: str, stamp: int) -> bytes:
    """Serialize ``nav_msgs/Path`` from its poses, serialized ``geometry_msgs/PoseStamped``."""
    parts = list(poses)
    return _path(frame, stamp, len(parts), b"".join(parts))


def _path(frame: str, stamp: int, count: int, poses: bytes) -> bytes:
    start = message("std_msgs/Header", *header(frame, stamp))
    return encode(start) + count.to_bytes(4, "little") + poses


@functools.lru_cache(maxsize=None)
def _record(frame_length: int) -> np.dtype[np.void]:
    """Return the layout of ``geometry_msgs/PoseStamped`` for a frame name of this many bytes."""
    return np.dtype(
        [
            ("seq", "<u4"),
            ("sec", "<u4"),
            ("nsec", "<u4"),
            ("length", "<u4"),
            ("frame", f"S{frame_length}"),
            ("place", "<f8", 3),
            ("quaternion", "<f8", 4),
        ]
    )
