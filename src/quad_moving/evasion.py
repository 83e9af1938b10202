"""Evasion of moving obstacles: the command nearest to the wish that keeps clear of all of them.

Each command of a polar grid is flown in thought, with the response of the body, as the Voronoi cell
of the peers will leave it. It keeps clear if no moving obstacle can touch the robot within its
greatest acceleration and speed, and if the robot can stop before what stands in the local costmap.
The wish stays if it keeps clear; else the nearest velocity that does replaces it. There are two
ways to fly:

* The robot keeps clear for a time, ``horizon``. Where no velocity does, it flies the one with which
  it is least deep in what obstacles can reach. This is for what does not react.
* With ``horizon`` 0 it keeps clear until it is at rest, where it may be touched; if it cannot, it
  brakes. This is passive safety, for people, who go around a robot that rests.

Sources: P. Fiorini, Z. Shiller, "Motion Planning in Dynamic Environments Using Velocity
Obstacles", IJRR 17(7), 1998, sections 2 and 4: of the velocities outside of all velocity obstacles,
the one nearest to the goal's; S. Bouraine, T. Fraichard, H. Salhi, "Provably safe navigation for
mobile robots with limited field-of-views in dynamic environments", Autonomous Robots 32, 2012:
passive safety against all that obstacles can reach.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from quad_moving.reachable import (
    BLOCKED,
    Body,
    Flight,
    Obstacles,
    Standing,
    overlaps,
)
from quad_nav.config.plugins import Parameters
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.costmap.inflation import InflationLayer
from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import INSCRIBED
from quad_nav.navigator.command_filter import Command, CommandFilter, Situation, StopReason
from quad_nav.parameter import number
from quad_nav.peers.right_of_way import MOVING_OBSTACLE

Floats = NDArray[np.float64]

BODY = Body(gain_per_s=25.0 / 8.0, acceleration_mps2=2.0, still_mps=0.05)
"""Response of the simulated quadcopter, see ``quad_nav/sim/flight.py``; people count 0.05 m/s as
rest, see ``bench/walkers.py``."""
STEP_S = 0.1
"""A tenth of a second: at 2 m/s the robot flies 0.2 m, less than its radius."""
SPEEDS, COURSES = 6, 32
"""The polar grid of commands: 0.33 m/s and 11 degrees apart at 2 m/s."""
HOLD_PERIODS = 1.5
"""A command acts until the next one, and odometry is half a period old on average."""
AT_POINT_M = 0.15
"""A robot that hovers returns to its point from farther away, about the tolerance of a goal."""
RETURN_GAIN_PER_S = 1.0
"""Slower than the response of the body, so that the robot does not overshoot its point."""


@dataclass(frozen=True)
class EvasionParams:
    """Parameters of ``quad_moving/Evasion``."""

    clearance_m: float = number(
        "clearance", 0.1, "m", 0, 2, "Distance that the robot keeps from moving obstacles."
    )
    max_speed_mps: float = number(
        "max_speed", 0.0, "m/s", 0, 10, "Greatest speed; the local planner's if that is greater."
    )
    # At 2 m/s^2 a robot leaves the way of a person in 1.2 s.
    horizon_s: float = number(
        "horizon", 1.5, "s", 0, 10, "Time for which the robot keeps clear; 0: until it rests."
    )
    # People who walk curves: 1.1 m aside within the horizon.
    max_acceleration_mps2: float = number(
        "max_acceleration", 1.0, "m/s^2", 0, 100, "Greatest acceleration of obstacles."
    )
    # ISO 13855:2010: people walk at 1.6 m/s.
    max_obstacle_speed_mps: float = number(
        "max_obstacle_speed", 1.6, "m/s", 0, 10, "Greatest speed of obstacles, if none is faster."
    )


class Evasion(CommandFilter):
    """Command filter that evades moving obstacles, also while the robot hovers.

    The robot has to fly sideways: ``holonomic_robot`` or ``max_vel_y``. Another one is left alone.

    Attributes:
        params: The parameters.
    """

    acts_when_idle = True
    params_class = EvasionParams

    def __init__(self, params: Parameters) -> None:
        """Evade nothing yet.

        Raises:
            InputError: A parameter is unknown or out of range.
        """
        self.params = params.read(EvasionParams)
        self.reset()

    def reset(self) -> None:
        """Forget the last evasion."""
        self._evades = False
        self._point: Optional[Pose2D] = None  # where a robot that follows no plan stopped

    def filter(self, command: Command, situation: Situation) -> Command:
        """Return the command, or the nearest one that keeps clear of moving obstacles."""
        usual_mps = usual_speed_mps(situation.planner_params)
        if situation.tracks is None or usual_mps is None:
            return command
        tracks = situation.tracks.at(situation.now_s)
        wish = self._wish(command, situation, usual_mps)
        speed_mps = math.hypot(situation.velocity.vx_mps, situation.velocity.vy_mps)
        is_fast = self._evades and speed_mps > usual_mps  # the local planner could not stop it
        self._evades = False
        if not tracks.any_may_move and not is_fast:
            return self._returning(command, wish)
        found = self._choose(wish, tracks, situation, usual_mps)
        if found is None:
            return self._returning(command, wish)
        self._evades = True
        return Command(found, StopReason.FILTER if found.is_zero else None, MOVING_OBSTACLE)

    def _wish(self, command: Command, situation: Situation, usual_mps: float) -> Twist2D:
        """Return the command's velocity; of a robot that stands, the one back to its point."""
        wish, pose = command.velocity, situation.map_pose
        if command.stop is None:
            self._point = None
            return wish
        self._point = self._point or pose
        if pose.distance_to(self._point) <= AT_POINT_M:
            return wish
        x_m, y_m = pose.inverse_transform(self._point.x_m, self._point.y_m)
        gain_per_s = min(RETURN_GAIN_PER_S, usual_mps / math.hypot(x_m, y_m))
        return replace(wish, vx_mps=gain_per_s * x_m, vy_mps=gain_per_s * y_m)

    def _returning(self, command: Command, wish: Twist2D) -> Command:
        return command if wish is command.velocity else Command(wish, None, MOVING_OBSTACLE)

    def _choose(
        self, wish: Twist2D, tracks: Tracks, situation: Situation, usual_mps: float
    ) -> Optional[Twist2D]:
        """Return the command to fly; None for the wish."""
        pose, velocity = situation.pose, situation.velocity
        wished = np.array(pose.rotate(wish.vx_mps, wish.vy_mps))
        now = np.array(pose.rotate(velocity.vx_mps, velocity.vy_mps))
        speed_mps = max(self.params.max_speed_mps, usual_mps)
        commands = self._limited(np.concatenate([[wished], polar_grid(speed_mps)]), situation)
        depths = self._overlaps(commands, now, tracks, situation)
        is_clear = depths == 0.0
        if is_clear[0]:
            return None
        if is_clear.any():
            away_mps = np.hypot(*(commands - wished).T)
            best = commands[int(np.argmin(np.where(is_clear, away_mps, np.inf)))]
        elif self.params.horizon_s > 0.0 and depths.min() < BLOCKED:
            best = commands[int(np.argmin(depths))]
        elif self.params.horizon_s > 0.0 and np.hypot(*now) <= usual_mps:
            return None  # the robot is too near to what stands: the navigator leads it out
        else:
            best = -now
        vx_mps, vy_mps = Pose2D(0.0, 0.0, -pose.yaw_rad).rotate(*best.tolist())
        return replace(wish, vx_mps=vx_mps, vy_mps=vy_mps)

    def _limited(self, commands: Floats, situation: Situation) -> Floats:
        """Return what peers leave of commands, float64[c, 2] in the local costmap's frame."""
        from_local = situation.local_from_global.inverse()
        in_map = np.column_stack(from_local.rotate(*commands.T))
        cell = situation.peers.cell(situation.map_pose, situation.velocity, situation.period_s)
        limited = cell.limit_velocities(in_map)
        return np.column_stack(situation.local_from_global.rotate(*limited.T))

    def _overlaps(
        self, commands: Floats, velocity: Floats, tracks: Tracks, situation: Situation
    ) -> Floats:
        """Return how deep the robot is in what obstacles can reach, float64[c]."""
        horizon_s, hold_s = self.params.horizon_s, HOLD_PERIODS * situation.period_s
        hold = max(round(hold_s / STEP_S), 1)
        flight = Flight(STEP_S, math.ceil(horizon_s / STEP_S), hold, horizon_s == 0.0)
        radius_m = situation.costmap.inscribed_radius_m + self.params.clearance_m
        obstacles = obstacles_of(self.params, tracks, situation.pose, radius_m)
        found = np.empty(len(commands))
        overlaps(BODY, standing_of(situation), obstacles, flight, velocity, commands, found)
        return found


def obstacles_of(params: EvasionParams, tracks: Tracks, pose: Pose2D, radius_m: float) -> Obstacles:
    """Return the tracked obstacles, and those that may begin to move.

    Args:
        params: The parameters.
        tracks: The obstacles now.
        pose: Pose of the robot in the same frame.
        radius_m: Radius of the robot and the clearance.
    """
    states = np.concatenate([tracks.states, tracks.suspects[:, :4]])
    speeds_mps = np.maximum(np.hypot(*states[:, 2:].T), params.max_obstacle_speed_mps)
    states[:, :2] -= (pose.x_m, pose.y_m)
    radii_m = np.append(tracks.radii_m, tracks.suspects[:, 4]) + radius_m
    return Obstacles(states, radii_m, speeds_mps, params.max_acceleration_mps2)


def polar_grid(max_speed_mps: float) -> Floats:
    """Return the hover and velocities of several speeds and courses, float64[c, 2]."""
    angles = np.arange(COURSES) * (2.0 * math.pi / COURSES)
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    steps = max_speed_mps * np.arange(1, SPEEDS + 1) / SPEEDS
    return np.concatenate([np.zeros((1, 2)), *(speed * ring for speed in steps)])


def standing_of(situation: Situation) -> Standing:
    """Return what stands.

    The last command acts for one control period more. What the robot flies meanwhile is missing to
    what stands; costs beyond the inscribed radius decay with the distance.
    """
    spec, costs, pose = situation.costmap.spec, situation.costmap.costs, situation.pose
    left_m, low_m = spec.origin_x_m - pose.x_m, spec.origin_y_m - pose.y_m
    layers = situation.costmap.layers.values()
    decays = [one.params.cost_scaling_factor for one in layers if isinstance(one, InflationLayer)]
    decay_s_per_m = situation.period_s * max(decays, default=0.0)
    return Standing(costs, left_m, low_m, spec.resolution_m, INSCRIBED, decay_s_per_m)


def usual_speed_mps(planner_params: Any) -> Optional[float]:
    """Return a local planner's greatest speed in any direction, None if it flies ahead alone."""
    if isinstance(planner_params, TrajectoryPlannerParams) and planner_params.holonomic_robot:
        return planner_params.max_vel_x_mps
    if isinstance(planner_params, DwaParams) and planner_params.max_vel_y_mps > 0.0:
        if planner_params.max_vel_trans_mps < 0.0:
            return planner_params.max_vel_x_mps
        return planner_params.max_vel_trans_mps
    return None
