"""Actors of SDF: people who walk along waypoints, as moving cylinders.

Gazebo classic leads an actor through the waypoints of its trajectories, one trajectory after the
other, by the spline of ``motion``. ``<delay_start>`` is waited before each cycle, as SDF says. The
heights of waypoints are those of the skin's origin, and do not count: a person stands on the floor.
"""

from __future__ import annotations

from typing import Dict, List, Tuple, Union

from quad_nav.files.xml_tree import Element
from quad_nav.geometry import Pose3D
from quad_nav.sim.motion import SPLINE, Motion, Walkers
from quad_nav.sim.obstacles import Cylinder
from quad_nav.sim.scene import MovingObstacle
from quad_nav.sim.sdf_values import IDENTITY, NotRepresented, SdfReader, is_true

PERSON_RADIUS_M, PERSON_HEIGHT_M = Walkers(1).radius_m, Walkers(1).height_m
MAX_WAYPOINTS = 10_000
_MAX_TIME_S = 1e5


def actor_of(reader: SdfReader, actor: Element, name: str) -> Union[Cylinder, MovingObstacle, None]:
    """Convert an actor.

    Args:
        reader: Reader of the file; collects faults.
        actor: The ``<actor>`` element.
        name: Name of the obstacle.

    Returns:
        The moving obstacle; a cylinder at rest without waypoints or with ``<auto_start>`` false;
        None after a fault.

    Raises:
        NotRepresented: A plugin moves it, or a pose is relative to a frame.
    """
    if actor.first("plugin") is not None:
        raise NotRepresented("actor that a plugin moves")
    faults_before = len(reader.problems)
    pose = reader.pose(actor)
    script = actor.first("script") or Element("script", {}, actor.line)
    delay_s = _seconds(reader, script, "delay_start")
    times_s, poses, tension = _waypoints(reader, script)
    if len(reader.problems) > faults_before:
        return None
    if not times_s or not is_true(script.text_of("auto_start", "true")):
        return _person(name, pose.x_m, pose.y_m)
    motion = Motion(
        tuple(delay_s + time_s for time_s in times_s),
        tuple(poses),
        is_true(script.text_of("loop", "true")),
        SPLINE,
        tension,
    )
    return MovingObstacle(_person(name, *poses[0][:2]), motion)


def _person(name: str, x_m: float, y_m: float) -> Cylinder:
    return Cylinder(name, x_m, y_m, PERSON_RADIUS_M, PERSON_HEIGHT_M)


def _waypoints(
    reader: SdfReader, script: Element
) -> Tuple[List[float], List[Tuple[float, float, float]], float]:
    """Return times and poses (x_m, y_m, yaw_rad) of all waypoints, and the spline's tension."""
    times_s: List[float] = []
    poses: List[Tuple[float, float, float]] = []
    tension, begin_s = 0.0, 0.0
    for trajectory in script.all("trajectory"):
        tension = _tension(reader, trajectory)
        waypoints: Dict[float, Pose3D] = {}
        for waypoint in trajectory.all("waypoint"):
            time_s = _seconds(reader, waypoint, "time", required=True)
            waypoints[time_s] = reader.pose(waypoint, IDENTITY)
        if len(times_s) + len(waypoints) > MAX_WAYPOINTS:
            reader.fault(script, f"more than {MAX_WAYPOINTS} waypoints")
            break
        for time_s in sorted(waypoints):
            if not times_s or begin_s + time_s > times_s[-1]:
                planar = waypoints[time_s].to_2d()
                times_s.append(begin_s + time_s)
                poses.append((planar.x_m, planar.y_m, planar.yaw_rad))
        begin_s = times_s[-1] if times_s else 0.0
    return times_s, poses, tension


def _seconds(reader: SdfReader, parent: Element, tag: str, required: bool = False) -> float:
    """Return a time of 0 or more; 0 after a fault."""
    element = parent.first(tag)
    if element is None:
        if required:
            reader.fault(parent, f"<{tag}> is missing, expected seconds")
        return 0.0
    values = reader.numbers(element, 1, "seconds")
    if values and not 0.0 <= values[0] <= _MAX_TIME_S:
        reader.fault(element, f"'{element.text.strip()}', expected seconds, 0 or more")
        return 0.0
    return values[0] if values else 0.0


def _tension(reader: SdfReader, trajectory: Element) -> float:
    """Return the tension of a trajectory, default 0."""
    text = trajectory.attributes.get("tension", "0")
    try:
        tension = float(text)
    except ValueError:
        tension = -1.0
    if not 0.0 <= tension <= 1.0:
        reader.fault(trajectory, f"tension '{text}', expected a number from 0 to 1")
        return 0.0
    return tension
