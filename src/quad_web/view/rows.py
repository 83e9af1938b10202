"""Make the items of a page that are tables: goals, states, yields, contacts and samples."""

from __future__ import annotations

import collections
import math
from dataclasses import dataclass, field
from typing import (
    Any,
    Callable,
    Collection,
    Deque,
    Dict,
    List,
    Mapping,
    Optional,
    Sequence,
    Tuple,
)

import numpy as np
from numpy.typing import NDArray

from quad_nav.mission.goal import Goal
from quad_nav.peers.right_of_way import Yield, YieldDecision
from quad_nav.sim.contacts import Contact
from quad_nav.sim.obstacles import Obstacle
from quad_nav.sim.scene import Scene
from quad_web.view.state import MAX_SAMPLES, Item

SAMPLE_PERIOD_S = 0.1
HOVERS_BELOW_MPS = 0.03
"""A robot that is slower hovers."""


@dataclass(frozen=True)
class RobotNow:
    """What a source knows of a robot at present, besides its pose.

    Attributes:
        navigator: State of its navigator as in ``~state``: "idle", "planning", "controlling" or
            "clearing".
        yielding: The decision to yield that is in force.
        limited_by: Name of the peer that limited the last command, "" if none did.
        is_done: All of its goals have ended.
        is_stopped: It hovers for lack of data, or because a person wants that.
        is_lost: It has not been heard of for too long, or does not know its place.
        has_ended: The flight is over.
        goal: Number of the goal that it flies to, from 1; None without one.
        goals: Number of its goals, None if unknown.
        said: Numbers of the topics in ``COLUMNS``, by their names.
        recoveries: Recovery behaviours that have run for this goal, and how many there are.
        age_s: Time since the last message of the robot.
        lidar: Its LIDAR is on.
        reason: Why it is stopped, lost or without a plan, else "".
        localization: Numbers of ``Located.row``; None if it knows its place.
    """

    navigator: str = "idle"
    yielding: Optional[YieldDecision] = None
    limited_by: str = ""
    is_done: bool = False
    is_stopped: bool = False
    is_lost: bool = False
    has_ended: bool = False
    goal: Optional[int] = None
    goals: Optional[int] = None
    said: Mapping[str, float] = field(default_factory=dict)
    recoveries: Tuple[int, int] = (0, 0)
    age_s: float = 0.0
    lidar: bool = True
    reason: str = ""
    localization: Optional[Mapping[str, Any]] = None

    def state(self, speed_mps: float) -> str:
        """Return the word for what the robot does, the first that is true."""
        if self.has_ended:
            return "done" if self.is_done else "stopped"
        if self.is_lost:
            return "lost"
        if self.is_stopped:
            return "stopped"
        if self.navigator == "clearing":
            return "recovering"
        if self.yielding is not None:
            return "waiting" if self.yielding.action is Yield.WAIT else "making room"
        if self.navigator == "planning":
            return "planning"
        if self.navigator == "idle":
            return "done" if self.is_done else "idle"
        return "hovering" if speed_mps < HOVERS_BELOW_MPS else "flying"

    def status_row(self, robot: int, speed_mps: float, gap_m: float) -> Dict[str, Any]:
        """Return a row of the item ``status``; ``gap_m`` is that to the nearest other robot."""
        if self.has_ended or not math.isfinite(speed_mps):
            speed_mps = 0.0
        numbers = {"speed_mps": speed_mps, "gap_m": gap_m, "age_s": self.age_s, **self.said}
        return {
            "robot": robot,
            "state": self.state(speed_mps),
            "goal": self.goal,
            "goals": self.goals,
            "recoveries": list(self.recoveries),
            **{name: _number(value) for name, value in numbers.items()},
            "lidar": self.lidar,
            "reason": self.reason,
            "localization": self.localization,
        }

    def yield_rows(self, robot: int, names: Sequence[str]) -> List[Dict[str, Any]]:
        """Return the rows of the item ``yields``: none, one or two; of peers with a name."""
        rows: List[Dict[str, Any]] = []
        if self.yielding is not None and self.yielding.peer in names:
            point = self.yielding.holding_point
            rows.append(
                {
                    "robot": robot,
                    "peer": names.index(self.yielding.peer),
                    "kind": "waits" if self.yielding.action is Yield.WAIT else "makes room",
                    "hold": None if point is None else [point.x_m, point.y_m],
                }
            )
        if self.limited_by in names:
            peer = names.index(self.limited_by)
            rows.append({"robot": robot, "peer": peer, "kind": "limited", "hold": None})
        return rows


def fleet_items(
    robots: Mapping[int, RobotNow], names: Sequence[str], samples: Item
) -> Tuple[Item, Item]:
    """Return the items ``status`` and ``yields`` of robots by number."""
    values = samples.arrays["values"].tolist()
    status = [
        now.status_row(robot, values[robot][2], values[robot][0]) for robot, now in robots.items()
    ]
    yields = [row for robot, now in robots.items() for row in now.yield_rows(robot, names)]
    return Item("status", {"rows": status}), Item("yields", {"yields": yields})


def goal_rows(
    robot: int,
    goals: Sequence[Goal],
    index: int,
    is_active: bool,
    failed: Collection[int] = (),
) -> List[Dict[str, Any]]:
    """Return the rows of one robot for the item ``goals``.

    Args:
        robot: Number of the robot.
        goals: Its goals in their order.
        index: Index of the active or next goal; all before it have ended.
        is_active: The robot flies to the goal of this index.
        failed: Indices of goals that ended without being reached.
    """
    ended = ["failed" if k in failed else "reached" for k in range(index)]
    states = [*ended, "active" if is_active else "pending", *["pending"] * len(goals)]
    return [
        {
            "robot": robot,
            "index": k,
            "x": goal.x_m,
            "y": goal.y_m,
            "yaw": goal.yaw_rad,
            "state": state,
        }
        for k, (goal, state) in enumerate(zip(goals, states))
    ]


def goals_item(rows: Sequence[Mapping[str, Any]]) -> Item:
    """Return the item ``goals`` from the rows of all robots."""
    return Item("goals", {"goals": list(rows)})


def contacts_item(contacts: Sequence[Contact], names: Sequence[str]) -> Item:
    """Return the item ``contacts``; of an unknown robot the number is None."""
    rows = [
        {
            "time_s": contact.time_s,
            "robot": names.index(contact.robot) if contact.robot in names else None,
            "other": contact.other,
            "x": contact.x_m,
            "y": contact.y_m,
        }
        for contact in contacts
    ]
    return Item("contacts", {"contacts": rows})


def gaps_m(positions: NDArray[np.float64], radius_m: float) -> NDArray[np.float64]:
    """Return the gap between each robot's hull and that of the nearest other one, float64[..., n].

    Positions are float64[..., n, 2] in ``map``; NaN of an unknown robot, and without another robot.
    """
    offsets = positions[..., :, None, :] - positions[..., None, :, :]
    distances_m = np.hypot(offsets[..., 0], offsets[..., 1])
    distances_m[np.isnan(distances_m)] = np.inf
    robots = np.arange(positions.shape[-2])
    distances_m[..., robots, robots] = np.inf
    nearest_m: NDArray[np.float64] = distances_m.min(axis=-1, initial=np.inf) - 2.0 * radius_m
    return np.where(np.isfinite(nearest_m), nearest_m, np.nan)


def samples_item(
    time_s: float,
    poses: Any,
    radius_m: float,
    scene: Optional[Scene],
    moving: Sequence[Obstacle] = (),
    cycles_s: Any = None,
) -> Item:
    """Return the item ``samples``: gap, clearance, speed and control-cycle time of each robot.

    Args:
        time_s: Time on the flight's clock.
        poses: float[n, 9], the array of the item ``poses``.
        radius_m: Radius of a hull.
        scene: For the clearance to obstacles and walls; None if it is unknown.
        moving: Moving obstacles where they are then.
        cycles_s: float64[n], time that the last control cycle took; None if it is unknown.
    """
    poses = np.asarray(poses, np.float64)
    positions = poses[:, :2]
    unknown = np.full(len(poses), np.nan)
    clearances_m = unknown.copy()
    known = np.isfinite(positions).all(axis=1)
    if scene is not None and known.any():
        distances_m = scene.flight_surface_distances_m(positions[known])
        x_m, y_m = positions[known].T
        for solid in scene.touchable(moving):
            own_m = solid.surface_distance_m(x_m, y_m, scene.altitude_m)
            np.minimum(distances_m, own_m, out=distances_m)
        distances_m[np.isinf(distances_m)] = np.nan  # nothing can be touched
        clearances_m[known] = distances_m - radius_m
    speeds_mps = np.hypot(poses[:, 6], poses[:, 7])
    cycles_s = unknown if cycles_s is None else cycles_s
    columns = (gaps_m(positions, radius_m), clearances_m, speeds_mps, cycles_s)
    return _sample(time_s, columns)


class Samples:
    """States of the bodies from one batch of the page to the next, ``SAMPLE_PERIOD_S`` apart.

    A flight at full speed flies seconds between two batches; its closest moments are between them.
    """

    def __init__(self) -> None:
        self._times_s: Deque[float] = collections.deque(maxlen=MAX_SAMPLES)
        self._bodies: Deque[NDArray[np.float64]] = collections.deque(maxlen=MAX_SAMPLES)
        self._next_s = -math.inf

    def add(self, time_s: float, bodies: NDArray[np.float64]) -> None:
        """Keep a state, float64[n, 13] as of ``poses_item``, if it is due; it must not change."""
        if time_s >= self._next_s:
            self._next_s = time_s + SAMPLE_PERIOD_S - 1e-6
            self._times_s.append(time_s)
            self._bodies.append(bodies)

    def take(
        self,
        radius_m: float,
        distances_m: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]],
        cycles_s: NDArray[np.float64],
    ) -> List[Item]:
        """Return the items ``samples`` of what was kept, and forget it.

        Args:
            radius_m: Radius of a hull.
            distances_m: Returns the distances of points float64[k, 2] at times float64[k] to the
                nearest surface.
            cycles_s: float64[n], time of the last control cycle.
        """
        states = list(zip(self._times_s, self._bodies))
        self._times_s.clear()
        self._bodies.clear()
        return sample_items(states, radius_m, distances_m, cycles_s)


def sample_items(
    states: Sequence[Tuple[float, NDArray[np.float64]]],
    radius_m: float,
    distances_m: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]],
    cycles_s: NDArray[np.float64],
) -> List[Item]:
    """Return the items ``samples`` of states: times, and bodies float64[n, 13].

    The other arguments are those of ``Samples.take``; distances are asked for where robots are.
    """
    if not states:
        return []
    bodies = np.array([rows for _, rows in states])
    positions, speeds_mps = bodies[..., :2], np.hypot(bodies[..., 7], bodies[..., 8])
    known, clearances_m = np.isfinite(positions).all(axis=-1), np.full(speeds_mps.shape, np.nan)
    if known.any():
        times_s = np.repeat([time_s for time_s, _ in states], known.sum(axis=1))
        clearances_m[known] = distances_m(positions[known], times_s) - radius_m
    clearances_m[np.isinf(clearances_m)] = np.nan  # nothing can be touched
    columns = zip(gaps_m(positions, radius_m), clearances_m, speeds_mps)
    return [_sample(time_s, (*values, cycles_s)) for (time_s, _), values in zip(states, columns)]


def _sample(time_s: float, columns: Sequence[NDArray[np.float64]]) -> Item:
    return Item("samples", {"time_s": time_s}, {"values": np.column_stack(columns).astype("f4")})


def flight_item(
    source: str,
    title: str,
    state: str,
    time_s: float,
    *,
    rate: Optional[float] = None,
    wanted_rate: Optional[float] = None,
    duration_s: Optional[float] = None,
    reason: str = "",
) -> Item:
    """Return the item ``flight``.

    Args:
        source: "preview", "ros", "offline" or "replay".
        title: Name of the scene, mission or file.
        state: "ready", "starting", "running", "paused", "stopped", "ended" or "waiting" (for data).
        time_s: Time on the flight's clock.
        rate: Simulated seconds per second that are achieved, None if unknown.
        wanted_rate: Those that are asked for; 0 is as fast as it goes, None if unknown.
        duration_s: Length of a recording, None for a flight that goes on.
        reason: Why it ended or waits; "" without a reason.
    """
    data = {
        "source": source,
        "title": title,
        "state": state,
        "time_s": time_s,
        "rate": None if rate is None else _number(rate),
        "wanted_rate": wanted_rate,
        "duration_s": duration_s,
        "reason": reason,
    }
    return Item("flight", data)


def _number(value: float) -> Optional[float]:
    """Return a number for JSON, which has no NaN."""
    return float(value) if math.isfinite(value) else None
