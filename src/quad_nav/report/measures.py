"""Curves and figures of a flight, computed from its trace.

Gaps are between hulls: discs of ``robot_radius_m`` around the centres, as in the
mission's summary.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Sequence, Tuple

import numpy as np

from quad_nav.mission import distances
from quad_nav.mission.flight_log import SPIN_ABOVE_RADPS, SPIN_BELOW_MPS
from quad_nav.recording.trace import FlightTrace, GoalTrace, RobotTrace
from quad_nav.sim.scene import Scene

Span = Tuple[float, float]


@dataclass(frozen=True)
class Tracks:
    """Where n quadcopters were at the same times; NaN where one was not heard of.

    ``times_s`` float64[t]; ``positions_m`` float64[n, t, 2] and ``yaws_rad`` float64[n, t]
    in ``map``.
    """

    times_s: np.ndarray
    positions_m: np.ndarray
    yaws_rad: np.ndarray

    def index_at(self, time_s: float) -> int:
        """The sample nearest to a time, of at least one."""
        return int(np.argmin(np.abs(self.times_s - time_s)))


def tracks(trace: FlightTrace) -> Tracks:
    """All quadcopters on the union of their times, on straight lines between samples."""
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


def _resampled(times_s: np.ndarray, own_times_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.interp(times_s, own_times_s, values, left=np.nan, right=np.nan)


def yaw_rad(quaternions: np.ndarray) -> np.ndarray:
    """float64[k, 4] to float64[k]; see ``geometry.yaw_from_quaternion``."""
    x, y, z, w = quaternions.T
    return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def tilt_rad(quaternions: np.ndarray) -> np.ndarray:
    """Angle float64[k] between the body's z axis and the vertical."""
    x, y, _, _ = quaternions.T
    return np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0))


def speed_mps(robot: RobotTrace) -> np.ndarray:
    """Horizontal speed float64[k]."""
    return np.hypot(robot.velocities[:, 0], robot.velocities[:, 1])


def pair_separations_m(among: Tracks, a: int, b: int, radius_m: float) -> np.ndarray:
    """Return the distance float64[t] between the hulls of two robots."""
    return distances.separations_m(among.positions_m[a], among.positions_m[b], radius_m)


def separations_m(among: Tracks, radius_m: float) -> np.ndarray:
    """Return each robot's separation float64[n, t] from the nearest other; NaN if there is none."""
    return distances.nearest_separations_m(among.positions_m, radius_m)


def clearances_m(among: Tracks, scene: Optional[Scene], radius_m: float) -> np.ndarray:
    """Return each robot's clearance float64[n, t]; NaN without a scene."""
    if scene is None or among.positions_m.size == 0:
        return np.full(among.yaws_rad.shape, np.nan)
    return distances.clearances_m(among.positions_m, scene.flight_clearances_m, radius_m)


def span_s(trace: FlightTrace) -> Span:
    """From the first sample to the last; never shorter than a second."""
    ends = [
        float(robot.times_s[k]) for robot in trace.robots if len(robot.times_s) for k in (0, -1)
    ] or [0.0]
    return min(ends), max(max(ends), min(ends) + 1.0)


def flying_span(robot: RobotTrace) -> Optional[Span]:
    """From the first goal's sending to the last goal's end; None when none was sent."""
    if not robot.goals:
        return None
    last = robot.goals[-1]
    return robot.goals[0].sent_s, end_s(last, robot)


def end_s(goal: GoalTrace, robot: RobotTrace) -> float:
    """When a goal ended, or the recording before it did."""
    if goal.ended_s is not None:
        return goal.ended_s
    return max(goal.sent_s, float(robot.times_s[-1])) if len(robot.times_s) else goal.sent_s


def spins(robot: RobotTrace) -> List[Span]:
    """When it turned on the spot while it had a goal; limits are the mission's."""
    span = flying_span(robot)
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


def runs(mask: np.ndarray) -> List[Tuple[int, int]]:
    """First and last index of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(first), int(end) - 1) for first, end in zip(edges[::2], edges[1::2])]


def path_length_m(robot: RobotTrace, span: Optional[Span]) -> float:
    """Horizontal way flown in a span of time."""
    if span is None:
        return 0.0
    inside = (robot.times_s >= span[0] - 1e-9) & (robot.times_s <= span[1] + 1e-9)
    return float(np.hypot(*np.diff(robot.positions_m[inside, :2], axis=0).T).sum())


def straight_length_m(robot: RobotTrace) -> float:
    """Sum over its goals of the distance between where each was sent and where it ended."""
    total_m = 0.0
    for goal in robot.goals if len(robot.times_s) else ():
        way = position_m(robot, end_s(goal, robot)) - position_m(robot, goal.sent_s)
        total_m += float(np.hypot(way[0], way[1]))
    return total_m


def position_m(robot: RobotTrace, time_s: float) -> np.ndarray:
    """Where a quadcopter with any sample was at a time: float64[2]."""
    return np.array(
        [np.interp(time_s, robot.times_s, robot.positions_m[:, axis]) for axis in range(2)]
    )


def least(values: Sequence[float]) -> Optional[float]:
    """The smallest that is a number, None when none is."""
    known = np.asarray(values, dtype=float)
    known = known[np.isfinite(known)]
    return float(known.min()) if len(known) else None
