"""Evasion guard: takes the command when moving obstacles come near.

It acts in every state, as long as the robot has its data: while the robot follows a plan, waits for
a peer, recovers, or hovers without a goal, and after an evasion until the robot is as slow again as
the navigator expects. A robot that stands still stays near the point where it stopped, and returns
to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.evasion import evade
from quad_nav.control.moving_discs import MovingDiscs
from quad_nav.control.neighbours import NO_NEIGHBOURS, Neighbours
from quad_nav.control.prediction import NO_DISCS, rollout_discs
from quad_nav.control.surroundings import EvasionParams, Surroundings
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.geometry import Pose2D, Twist2D, angle_difference
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.tracking.tracks import Tracks

Floats = NDArray[np.float64]

_AT_POINT_M = 0.15
_ROUTE_POINTS = 40
_AHEAD_M = 1.5
_TURN_GAIN_PER_S = 2.0
_RETURN_GAIN_PER_S = 1.0
_GLANCE_S = 6.0  # period of looking to both sides
_MIN_TURN_RAD = 0.1


@dataclass(frozen=True)
class SpeedLimits:
    """Greatest speed in any direction and greatest turn rate of a local planner."""

    speed_mps: float
    turn_radps: float


class EvasionGuard:
    """Replaces commands that moving obstacles threaten.

    Attributes:
        params: The parameters; they may change in flight.
        period_s: Time between two commands; it may change in flight.
        is_evading: The guard chose the last command.
    """

    def __init__(
        self, params: EvasionParams, local_costmap: LayeredCostmap, period_s: float
    ) -> None:
        """Guard a robot that hovers."""
        self.params = params
        self.period_s = period_s
        self.is_evading = False
        self._costmap = local_costmap
        self._last = (0.0, 0.0)
        self._point: Optional[Pose2D] = None  # where a robot that follows no plan stopped

    def check(
        self,
        tick: Tick,
        poses: RobotPoses,
        velocity: Twist2D,
        tracks: Tracks,
        plan: Optional[Floats],
        limits: SpeedLimits,
        neighbours: Neighbours = NO_NEIGHBOURS,
    ) -> None:
        """Replace the command of a step by that which moving obstacles threaten least.

        Args:
            tick: The step.
            poses: Poses of the robot in the costmaps' frames.
            velocity: Velocity of the robot, in its own frame.
            tracks: The moving obstacles, in the local costmap's frame.
            plan: float64[n, 3], the plan that the robot follows, in the global costmap's frame;
                None if it follows none.
            limits: Greatest speeds of the robot.
            neighbours: The peers.
        """
        local_from_global = poses.local_from_global
        if poses.in_local is None or poses.in_global is None or local_from_global is None:
            return None
        pose, is_displaced = poses.in_local, self._is_displaced(plan, poses.in_global)
        around = self._surroundings(pose, velocity, limits, plan is not None, neighbours)
        if not tracks.any_may_move and not is_displaced and not around.is_fast:
            return self._end(tick)
        route = self._route(plan, local_from_global)
        wish = tick.command or Twist2D()
        wish = _return(wish, route[0], pose, limits) if is_displaced else wish
        command = self._choose(around, tracks, tick.now_s, route, wish)
        if command is wish and not is_displaced:
            return self._end(tick)
        turn_radps = 0.0 if plan is None else self._turn(tick.now_s, route, pose, limits)
        tick.command = replace(command, vyaw_radps=turn_radps)
        tick.evades = self.is_evading = True
        return None

    def stop(self) -> bool:
        """Evade no longer, for lack of data; return whether the last command evaded."""
        evaded, self.is_evading, self._last = self.is_evading, False, (0.0, 0.0)
        return evaded

    def _choose(
        self, around: Surroundings, tracks: Tracks, now_s: float, route: Floats, wish: Twist2D
    ) -> Twist2D:
        pose = around.pose
        is_evasion = tracks.any_may_move or around.is_fast
        last = self._last if is_evasion else pose.rotate(wish.vx_mps, wish.vy_mps)
        command = evade(self.params, around, tracks, now_s, route, wish, last)
        self._last = pose.rotate(command.vx_mps, command.vy_mps)
        return command

    def predict(self, now_s: float, pose: Pose2D, tracks: Tracks, rollout_s: float) -> MovingDiscs:
        """Return what a local planner's rollouts of a duration are judged against.

        Args:
            now_s: Present time.
            pose: Pose of the robot in the local costmap's frame.
            tracks: The moving obstacles, in the same frame.
            rollout_s: Duration of the rollouts.
        """
        if not len(tracks):
            return NO_DISCS
        radius_m, clearance_m = self._costmap.inscribed_radius_m, self.params.clearance_m
        return rollout_discs(tracks.at(now_s), pose, radius_m, clearance_m, rollout_s)

    def _surroundings(
        self,
        pose: Pose2D,
        velocity: Twist2D,
        limits: SpeedLimits,
        is_following: bool,
        neighbours: Neighbours,
    ) -> Surroundings:
        costmap = self._costmap
        return Surroundings(
            spec=costmap.spec,
            costs=costmap.costs,
            pose=pose,
            velocity=velocity,
            radius_m=costmap.inscribed_radius_m,
            max_speed_mps=max(self.params.speed_mps, limits.speed_mps),
            usual_speed_mps=limits.speed_mps,
            is_following=is_following,
            period_s=self.period_s,
            neighbours=neighbours,
        )

    def _turn(self, now_s: float, route: Floats, pose: Pose2D, limits: SpeedLimits) -> float:
        if self.params.glance_rad >= math.pi - _MIN_TURN_RAD:
            return limits.turn_radps
        aside_rad = self.params.glance_rad * math.sin(now_s * 2.0 * math.pi / _GLANCE_S)
        return _turn(route, pose, limits, aside_rad)

    def _end(self, tick: Tick) -> None:
        if self.is_evading and tick.command is None:
            tick.command = Twist2D()
        self.is_evading = False

    def _is_displaced(self, plan: Optional[Floats], pose: Pose2D) -> bool:
        """Keep the point where a robot without a plan stopped; return whether it is elsewhere."""
        if plan is not None and len(plan):
            self._point = None
            return False
        self._point = self._point or pose
        return plan is None and pose.distance_to(self._point) > _AT_POINT_M

    def _route(self, plan: Optional[Floats], local_from_global: Pose2D) -> Floats:
        """Return the points to fly along in the local costmap's frame, float64[n, 2]."""
        if self._point is None:
            assert plan is not None
            rows = np.unique(np.linspace(0, len(plan) - 1, _ROUTE_POINTS).astype(np.int64))
            x, y = np.ascontiguousarray(plan[rows, :2].T)
        else:
            x, y = np.array([self._point.x_m]), np.array([self._point.y_m])
        return np.column_stack(local_from_global.transform(x, y))


def _return(command: Twist2D, point: Floats, pose: Pose2D, limits: SpeedLimits) -> Twist2D:
    """Let a command that hovers or turns fly back to a point, float64[2], slower when near."""
    if command.vx_mps or command.vy_mps:
        return command
    x_m, y_m = pose.inverse_transform(*point.tolist())
    gain_per_s = min(_RETURN_GAIN_PER_S, limits.speed_mps / max(math.hypot(x_m, y_m), 1e-9))
    return Twist2D(gain_per_s * x_m, gain_per_s * y_m, command.vyaw_radps)


def _turn(route: Floats, pose: Pose2D, limits: SpeedLimits, aside_rad: float) -> float:
    """Return the turn rate that faces the route some way ahead, or aside of it."""
    away = np.hypot(route[:, 0] - pose.x_m, route[:, 1] - pose.y_m)
    ahead = np.flatnonzero(away[int(away.argmin()) :] >= _AHEAD_M)
    x_m, y_m = route[int(away.argmin()) + int(ahead[0]) if len(ahead) else -1].tolist()
    turn_rad = angle_difference(
        math.atan2(y_m - pose.y_m, x_m - pose.x_m), pose.yaw_rad - aside_rad
    )
    if abs(turn_rad) < _MIN_TURN_RAD:
        return 0.0
    return max(-limits.turn_radps, min(_TURN_GAIN_PER_S * turn_rad, limits.turn_radps))


def speed_limits(params: Any) -> Optional[SpeedLimits]:
    """Return the limits of a local planner's parameters, None if it does not fly sideways."""
    if isinstance(params, TrajectoryPlannerParams) and params.holonomic_robot:
        return SpeedLimits(params.max_vel_x_mps, params.max_vel_theta_radps)
    if isinstance(params, DwaParams) and params.max_vel_y_mps > 0.0:
        speed_mps = params.max_vel_trans_mps
        if speed_mps < 0.0:
            speed_mps = params.max_vel_x_mps
        return SpeedLimits(speed_mps, params.max_vel_theta_radps)
    return None
