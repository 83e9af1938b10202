"""Make the items of a page that are tables: goals, states, yields, contacts and samples."""

from __future__ import annotations

import math
from typing import Any, Collection, Dict, List, Mapping, Optional, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.mission.goal import Goal
from quad_nav.peers.right_of_way import Yield, YieldDecision
from quad_nav.sim.contacts import Contact
from quad_nav.sim.obstacles import Obstacle
from quad_nav.sim.scene import Scene
from quad_web.view.state import Item

Floats = NDArray[np.float64]

_NOTHING: Mapping[str, float] = {}
HOVERS_BELOW_MPS = 0.03
"""A robot that is slower hovers."""


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
    return [
        {
            "robot": robot,
            "index": k,
            "x": goal.x_m,
            "y": goal.y_m,
            "yaw": goal.yaw_rad,
            "state": _goal_state(k, index, is_active, failed),
        }
        for k, goal in enumerate(goals)
    ]


def goals_item(rows: Sequence[Mapping[str, Any]]) -> Item:
    """Return the item ``goals`` from the rows of all robots."""
    return Item("goals", {"goals": list(rows)})


def _goal_state(k: int, index: int, is_active: bool, failed: Collection[int]) -> str:
    if k == index and is_active:
        return "active"
    if k < index:
        return "failed" if k in failed else "reached"
    return "pending"


def yield_rows(
    robot: int, decision: Optional[YieldDecision], limited_by: str, names: Sequence[str]
) -> List[Dict[str, Any]]:
    """Return the rows of one robot for the item ``yields``: none, one or two.

    Args:
        robot: Number of the robot.
        decision: The decision to yield that is in force, if there is one.
        limited_by: Name of the peer that limited the last command, "" if none did.
        names: Names of all robots; peers that are not among them are left out.
    """
    rows: List[Dict[str, Any]] = []
    if decision is not None and decision.peer in names:
        point = decision.holding_point
        rows.append(
            {
                "robot": robot,
                "peer": names.index(decision.peer),
                "kind": "waits" if decision.action is Yield.WAIT else "makes room",
                "hold": None if point is None else [point.x_m, point.y_m],
            }
        )
    if limited_by in names:
        peer = names.index(limited_by)
        rows.append({"robot": robot, "peer": peer, "kind": "limited", "hold": None})
    return rows


def yields_item(rows: Sequence[Mapping[str, Any]]) -> Item:
    """Return the item ``yields`` from the rows of all robots."""
    return Item("yields", {"yields": list(rows)})


def contacts_item(contacts: Sequence[Contact], names: Sequence[str]) -> Item:
    """Return the item ``contacts``; of an unknown robot the number is None."""
    return Item(
        "contacts",
        {
            "contacts": [
                {
                    "time_s": contact.time_s,
                    "robot": names.index(contact.robot) if contact.robot in names else None,
                    "other": contact.other,
                    "x": contact.x_m,
                    "y": contact.y_m,
                }
                for contact in contacts
            ]
        },
    )


def gaps_m(positions: Any, radius_m: float) -> Floats:
    """Return the gap between each robot's hull and that of the nearest other robot.

    Args:
        positions: float64[n, 2], in ``map``; NaN for an unknown one.
        radius_m: Radius of a hull.

    Returns:
        float64[n]; NaN without another robot.
    """
    positions = np.asarray(positions, np.float64).reshape(-1, 2)
    offsets = positions[:, None] - positions[None]
    distances_m = np.hypot(offsets[..., 0], offsets[..., 1])
    distances_m[np.isnan(distances_m)] = np.inf
    np.fill_diagonal(distances_m, np.inf)
    nearest_m: Floats = distances_m.min(axis=1, initial=np.inf) - 2.0 * radius_m
    return np.where(np.isfinite(nearest_m), nearest_m, np.nan)


def samples_item(
    time_s: float,
    poses: Any,
    cycles_s: Any,
    radius_m: float,
    scene: Optional[Scene],
    moving: Sequence[Obstacle] = (),
) -> Item:
    """Return the item ``samples``: gap, clearance, speed and control-cycle time of each robot.

    Args:
        time_s: Time on the flight's clock.
        poses: float[n, 9], the array of the item ``poses``.
        cycles_s: float64[n], time that the last control cycle took; NaN for an unknown one.
        radius_m: Radius of a hull.
        scene: For the clearance to obstacles and walls; None if it is unknown.
        moving: Moving obstacles where they are then.
    """
    poses = np.asarray(poses, np.float64)
    positions = poses[:, :2]
    clearances_m = np.full(len(poses), np.nan)
    known = np.isfinite(positions).all(axis=1)
    if scene is not None and known.any():
        distances_m = scene.flight_surface_distances_m(positions[known])
        x_m, y_m = positions[known].T
        for solid in moving:
            own_m = solid.surface_distance_m(x_m, y_m, scene.altitude_m)
            np.minimum(distances_m, own_m, out=distances_m)
        clearances_m[known] = distances_m - radius_m
    speeds_mps = np.hypot(poses[:, 6], poses[:, 7])
    columns = (gaps_m(positions, radius_m), clearances_m, speeds_mps, cycles_s)
    return Item("samples", {"time_s": time_s}, {"values": np.column_stack(columns).astype("f4")})


def robot_state(
    navigator: str,
    speed_mps: float,
    *,
    yielding: Optional[YieldDecision] = None,
    is_done: bool = False,
    is_stopped: bool = False,
    is_lost: bool = False,
) -> str:
    """Return the word for what a robot does, the first that is true.

    Args:
        navigator: State of its navigator as in ``~state``: "idle", "planning", "controlling" or
            "clearing".
        speed_mps: Its speed.
        yielding: The decision to yield that is in force.
        is_done: All of its goals have ended.
        is_stopped: It hovers for lack of data.
        is_lost: It has not been heard of for too long.
    """
    if is_lost:
        return "lost"
    if is_stopped:
        return "stopped"
    if navigator == "clearing":
        return "recovering"
    if yielding is not None:
        return "waiting" if yielding.action is Yield.WAIT else "making room"
    if navigator == "planning":
        return "planning"
    if navigator == "idle":
        return "done" if is_done else "idle"
    return "hovering" if speed_mps < HOVERS_BELOW_MPS else "flying"


def status_row(
    robot: int,
    state: str,
    *,
    goal: Optional[int] = None,
    goals: Optional[int] = None,
    said: Mapping[str, float] = _NOTHING,
    speed_mps: float = 0.0,
    gap_m: float = math.nan,
    recoveries: Sequence[int] = (0, 0),
    age_s: float = 0.0,
    lidar: bool = True,
    reason: str = "",
) -> Dict[str, Any]:
    """Return one robot's row of the item ``status``.

    Args:
        robot: Number of the robot.
        state: What it does, see ``robot_state``.
        goal: Number of the goal that it flies to, from 1.
        goals: Number of its goals, None if unknown.
        said: Numbers of the topics in ``COLUMNS``, by their names.
        speed_mps: Its speed.
        gap_m: Gap to the nearest other robot.
        recoveries: Recovery behaviours that have run for this goal, and how many there are.
        age_s: Time since the last message of the robot.
        lidar: Its LIDAR is on.
        reason: Why it is stopped, lost or without a plan, else "".
    """
    numbers = {"speed_mps": speed_mps, "gap_m": gap_m, "age_s": age_s, **said}
    return {
        "robot": robot,
        "state": state,
        "goal": goal,
        "goals": goals,
        "recoveries": list(recoveries),
        **{name: _number(value) for name, value in numbers.items()},
        "lidar": lidar,
        "reason": reason,
    }


def status_item(rows: Sequence[Mapping[str, Any]]) -> Item:
    """Return the item ``status`` from the rows of all robots."""
    return Item("status", {"rows": list(rows)})


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
        state: "ready", "starting", "running", "paused", "ended" or "waiting" (for data).
        time_s: Time on the flight's clock.
        rate: Simulated seconds per second that are achieved, None if unknown.
        wanted_rate: Those that are asked for; 0 is as fast as it goes, None if unknown.
        duration_s: Length of a recording, None for a flight that goes on.
        reason: Why it ended or waits; "" without a reason.
    """
    return Item(
        "flight",
        {
            "source": source,
            "title": title,
            "state": state,
            "time_s": time_s,
            "rate": None if rate is None else _number(rate),
            "wanted_rate": wanted_rate,
            "duration_s": duration_s,
            "reason": reason,
        },
    )


def _number(value: float) -> Optional[float]:
    """Return a number for JSON, which has no NaN."""
    return float(value) if math.isfinite(value) else None
