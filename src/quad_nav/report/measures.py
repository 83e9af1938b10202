"""Compute curves and values of a flight from its trace.

Clearances and separations are between hulls: discs of ``robot_radius_m`` around the centres,
as in the mission's summary.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quad_nav.mission import distances
from quad_nav.mission.flight_log import SPIN_ABOVE_RADPS, SPIN_BELOW_MPS
from quad_nav.recording.trace import FlightTrace, GoalTrace, RobotTrace
from quad_nav.sim.movers import Movers

Span = Tuple[float, float]


@dataclass(frozen=True)
class Tracks:
    """Poses of n robots at common times, in ``map``; NaN where a robot has no samples.

    Attributes:
        times_s: Times, shape (t,).
        positions_m: Positions, shape (n, t, 2).
        yaws_rad: Headings, unwrapped, shape (n, t).
    """

    times_s: NDArray[np.float64]
    positions_m: NDArray[np.float64]
    yaws_rad: NDArray[np.float64]

    def index_at(self, time_s: float) -> int:
        """Return the index of the sample nearest to a time; there must be at least one."""
        return int(np.argmin(np.abs(self.times_s - time_s)))


def resampled_tracks(trace: FlightTrace) -> Tracks:
    """Interpolate the poses of all robots linearly at the union of their times."""
    times_s = np.unique(np.concatenate([robot.times_s for robot in trace.robots] or [np.empty(0)]))
    positions = np.full((len(trace.robots), len(times_s), 2), np.nan)
    yaws = np.full(positions.shape[:2], np.nan)
    for k, robot in enumerate(trace.robots):
        if len(robot.times_s) == 0:
            continue
        for axis in range(2):
            positions[k, :, axis] = _resampled(times_s, robot.times_s, robot.positions_m[:, axis])
        yaws[k] = _resampled(times_s, robot.times_s, np.unwrap(yaw_rad(robot.quaternions)))
    return Tracks(times_s, positions, yaws)


def _resampled(
    times_s: NDArray[np.float64], own_times_s: NDArray[np.float64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.interp(times_s, own_times_s, values, left=np.nan, right=np.nan)


def yaw_rad(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convert quaternions (x, y, z, w), shape (k, 4), to headings, shape (k,).

    Source: see ``geometry.yaw_from_quaternion``.
    """
    x, y, z, w = quaternions.T
    return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def tilt_rad(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the angles between the body's z axis and the vertical, shape (k,)."""
    x, y, _, _ = quaternions.T
    return np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0))


def speed_mps(robot: RobotTrace) -> NDArray[np.float64]:
    """Return the horizontal speeds, shape (k,)."""
    return np.hypot(robot.velocities[:, 0], robot.velocities[:, 1])


def clearances_m(tracks: Tracks, trace: FlightTrace) -> NDArray[np.float64]:
    """Return each robot's clearance, shape (n, t); NaN if nothing can be touched."""
    if trace.scene is None or tracks.positions_m.size == 0:
        return np.full(tracks.yaws_rad.shape, np.nan)
    movers = trace.movers or Movers(trace.scene)
    clearances = distances.clearances_m(
        tracks.positions_m,
        tracks.times_s,
        movers.flight_surface_distances_m,
        trace.robot_radius_m,
    )
    return np.where(np.isinf(clearances), np.nan, clearances)


def trace_span_s(trace: FlightTrace) -> Span:
    """Return the times of the first and the last sample, at least one second apart."""
    ends = [
        float(robot.times_s[k]) for robot in trace.robots if len(robot.times_s) for k in (0, -1)
    ] or [0.0]
    return min(ends), max(max(ends), min(ends) + 1.0)


def mission_span(robot: RobotTrace) -> Optional[Span]:
    """Return the time from sending the first goal to the last goal's end, or None."""
    if not robot.goals:
        return None
    last = robot.goals[-1]
    return robot.goals[0].sent_s, goal_end_s(last, robot)


def goal_end_s(goal: GoalTrace, robot: RobotTrace) -> float:
    """Return the time at which a goal or, before that, the recording ended."""
    if goal.ended_s is not None:
        return goal.ended_s
    return max(goal.sent_s, float(robot.times_s[-1])) if len(robot.times_s) else goal.sent_s


def spins(robot: RobotTrace) -> List[Span]:
    """Return the periods in which a robot with a goal turned in place.

    The limits of speed and turn rate are those of the mission's summary.
    """
    span = mission_span(robot)
    if span is None or len(robot.times_s) < 2:
        return []
    times_s = robot.times_s
    period_s = np.diff(times_s)
    step_m = np.hypot(*np.diff(robot.positions_m[:, :2], axis=0).T)
    turn_rad = np.abs(np.diff(np.unwrap(yaw_rad(robot.quaternions))))
    spinning = (
        (step_m < SPIN_BELOW_MPS * period_s)
        & (turn_rad > SPIN_ABOVE_RADPS * period_s)
        & (times_s[1:] > span[0])
        & (times_s[1:] <= span[1])
    )
    return [(float(times_s[first]), float(times_s[last + 1])) for first, last in runs(spinning)]


def runs(mask: NDArray[np.bool_]) -> List[Tuple[int, int]]:
    """Return the first and the last index of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(first), int(end) - 1) for first, end in zip(edges[::2], edges[1::2])]


def path_length_m(robot: RobotTrace, span: Optional[Span]) -> float:
    """Return the horizontal length of the path flown in a period, 0 without one."""
    if span is None:
        return 0.0
    inside = (robot.times_s >= span[0] - 1e-9) & (robot.times_s <= span[1] + 1e-9)
    return float(np.hypot(*np.diff(robot.positions_m[inside, :2], axis=0).T).sum())


def straight_length_m(robot: RobotTrace) -> float:
    """Sum the distances between the positions at which each goal was sent and ended."""
    total_m = 0.0
    for goal in robot.goals if len(robot.times_s) else ():
        displacement = position_m(robot, goal_end_s(goal, robot)) - position_m(robot, goal.sent_s)
        total_m += float(np.hypot(displacement[0], displacement[1]))
    return total_m


def position_m(robot: RobotTrace, time_s: float) -> NDArray[np.float64]:
    """Interpolate the position of a robot with at least one sample, shape (2,)."""
    return np.array(
        [np.interp(time_s, robot.times_s, robot.positions_m[:, axis]) for axis in range(2)]
    )


def smallest(values: ArrayLike) -> Optional[float]:
    """Return the smallest finite value, or None."""
    known = np.asarray(values, dtype=float)
    known = known[np.isfinite(known)]
    return float(known.min()) if len(known) else None
