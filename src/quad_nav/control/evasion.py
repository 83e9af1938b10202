"""Evasion of moving obstacles: the command that they threaten least.

Each control cycle searches the positions that the robot can reach in space and time. Positions
near the predicted discs of the obstacles cost their threat, which falls off as a Gaussian with the
uncertainty of the prediction, and positions far from the end of the plan cost the time to fly
there. Dynamic programming from the end of the horizon gives the cost of the best motion from each
cell and step; the commands of a polar grid, and the command that the navigator wishes, are
followed with the response of the body, each with the best of some second commands, and take the
rest from there, where and when the body would come to rest. A speed above that of the local planner
costs what it gains on the way, so that a robot is fast only to get out of the way. The
robot goes behind, in front, back or waits as it costs least against all obstacles together. It
keeps the wish where nothing is much better.
People turn, and they go around a robot that rests. With ``deviation_mps`` the robot flies only
commands after which it can rest before an obstacle reaches it that leaves its prediction, some
time early, and brakes if there is none: passive safety. It holds for predictions with and without
the memory.
Peers are in the way as well: commands are judged as the robot's Voronoi cell will leave them, and
peers are expected to keep their velocities.

Sources: P. Fiorini, Z. Shiller, "Motion Planning in Dynamic Environments Using Velocity
Obstacles", IJRR 17(7), 1998: obstacles that keep their velocities, judged in the plane of
velocities; A. Kushleyev, M. Likhachev, "Time-bounded Lattice for Efficient Planning in Dynamic
Environments", ICRA 2009: search in space and time against Gaussian predictions, up to a horizon.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.neighbours import NO_NEIGHBOURS, Neighbours
from quad_nav.control.prediction import extrapolate, join_discs, remember
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import GridSpec
from quad_nav.kernels.body_response import Body, rest_s
from quad_nav.kernels.evasion_commands import BOTH_S, command_costs
from quad_nav.kernels.passive_safety import rest_in_time
from quad_nav.kernels.space_time import SUBSTEPS, SpaceTime, fill_costs
from quad_nav.kernels.standing_obstacles import StandingObstacles, fill_gaps, overlap_costs
from quad_nav.tracking.motion_memory import MotionMemory
from quad_nav.tracking.tracks import Tracks

Floats = NDArray[np.float64]

STEP_S = 0.5
_HORIZON_S, _KNOWN_HORIZON_S = 6.0, 10.0  # the second one where most motions repeat
_WINDOW_M = 5.0  # the least window, from the robot to each side
_REACH_CELLS = 2  # cells that the robot flies in a step
_MAX_CELL_M = 0.2
_BODY = Body(gain_per_s=25.0 / 8.0, lag_s=2.0 / 25.0, acceleration_mps2=2.0)  # of sim/flight.py
_FADE_PER_S = 0.35
_RISK_PER_S, _BLOCKED_PER_S, _AWAY_PER_S = 40.0, 100.0, 0.05
_HASTE = 1.3  # what a second gains at the greatest speed: 1 and _AWAY_PER_S for each second left
_CHANGE_S = 0.1  # cost of another command than the last one, at the greatest speed's difference
_WISH_S = 0.1  # by how much a command has to be better than the wish
_FASTER_MPS = 0.2  # above its usual speed: the robot has evaded
_HOLD_PERIODS = 2.0  # for which a command acts; the velocity is up to a period old
_EARLY_S = 0.25  # by which the robot rests before an obstacle reaches it
_SPEEDS, _COURSES = 4, 24
_SECOND_SPEEDS, _SECOND_COURSES = 2, 12


@dataclass(frozen=True)
class EvasionParams:
    """Parameters of the evasion of moving obstacles, see ``docs/moving_obstacles.md``.

    Attributes:
        avoid_moving_obstacles: Evade tracked obstacles; False restores upstream behaviour.
        clearance_m: Distance that the robot keeps from where obstacles are predicted.
        glance_rad: Angle by which a robot that evades looks to both sides of its way, for what a
            LIDAR that does not see all around hides; it turns steadily at pi.
        watch_s: Time for which the robot hovers before its first goal, and watches three or more
            obstacles.
        speed_mps: Greatest speed while the robot evades; 0 for that of the local planner.
        deviation_mps: How fast an obstacle may leave its prediction: the robot flies so that it
            rests before such an obstacle reaches it; 0 for no such limit.
    """

    avoid_moving_obstacles: bool = False
    clearance_m: float = 0.1
    glance_rad: float = 0.0
    watch_s: float = 0.0
    speed_mps: float = 0.0
    deviation_mps: float = 0.0


@dataclass(frozen=True)
class Surroundings:
    """The robot among its peers and what stands, in the local costmap's frame.

    Attributes:
        spec: Grid of the local costmap.
        costs: uint8[H, W] on it.
        pose: Pose of the robot.
        velocity: Velocity of the robot, in its own frame.
        radius_m: Radius of the robot.
        max_speed_mps: Greatest speed of the robot in any direction, while it evades.
        usual_speed_mps: Greatest speed otherwise.
        is_following: The robot follows a plan; else it stays near a point.
        memory: The memory of how obstacles have moved.
        period_s: Time between two commands.
        neighbours: The peers.
    """

    spec: GridSpec
    costs: NDArray[np.uint8]
    pose: Pose2D
    velocity: Twist2D
    radius_m: float
    max_speed_mps: float
    usual_speed_mps: float
    is_following: bool
    memory: MotionMemory
    period_s: float
    neighbours: Neighbours = NO_NEIGHBOURS

    @property
    def is_fast(self) -> bool:
        """The robot is faster than the navigator expects: it has evaded."""
        speed_mps = math.hypot(self.velocity.vx_mps, self.velocity.vy_mps)
        return speed_mps > self.usual_speed_mps + _FASTER_MPS


def evade(
    params: EvasionParams,
    around: Surroundings,
    tracks: Tracks,
    now_s: float,
    route: Floats,
    wish: Twist2D,
    last: Tuple[float, float],
) -> Twist2D:
    """Return the command that moving obstacles threaten least, the wish where it is as good.

    Args:
        params: The parameters.
        around: The robot among what stands.
        tracks: The moving obstacles, in the local costmap's frame.
        now_s: Present time.
        route: float64[n, 2], what is left of the plan, or the point to hover at.
        wish: The command of the navigator, in the robot's frame.
        last: The last command's velocity along the axes of the costmap's frame, m/s.
    """
    search = _search_of(around.max_speed_mps, around.usual_speed_mps)
    times_s = prediction_times(around.memory, search.step_s)
    strangers, plain = predicted_discs(params, around, tracks, now_s, times_s)
    if not strangers.shape[1] and around.is_following and not around.is_fast:
        return wish
    commands = _commands(around.max_speed_mps, around.pose.rotate(wish.vx_mps, wish.vy_mps))
    possible = strangers
    if params.deviation_mps > 0.0:  # who turned here before may go on this time
        possible = join_discs(strangers, plain)
    found = _costs_of(commands, params, around, search, strangers, possible, route, last)
    if np.isinf(found).all():
        return Twist2D(-around.velocity.vx_mps, -around.velocity.vy_mps, wish.vyaw_radps)
    found += _CHANGE_S / around.max_speed_mps * np.hypot(*(commands - last).T)
    best = int(np.argmin(found[1:])) + 1
    if found[0] <= found[best] + _WISH_S:
        return wish
    vx_mps, vy_mps = Pose2D(0.0, 0.0, -around.pose.yaw_rad).rotate(*commands[best].tolist())
    return Twist2D(vx_mps, vy_mps, wish.vyaw_radps)


def _costs_of(
    commands: Floats,
    params: EvasionParams,
    around: Surroundings,
    search: SpaceTime,
    strangers: Floats,
    possible: Floats,
    route: Floats,
    last: Tuple[float, float],
) -> Floats:
    """Return the cost of each of the commands, float64[c]; the commands are float64[c, 2].

    It is infinite after those after which the robot might not rest in time before one of the
    possible obstacles.
    """
    moving = around.pose.rotate(around.velocity.vx_mps, around.velocity.vy_mps)
    start = (*moving, *_acceleration(moving, last))
    flown = around.neighbours.limited(commands)
    standing = _standing(around)
    found = np.full(len(commands), math.inf)
    is_safe = _rest_in_time(params, around, search, possible, standing, start, flown)
    if is_safe.any():
        times_s = search.step_s / SUBSTEPS * np.arange(len(strangers))
        discs = join_discs(strangers, around.neighbours.discs(around.pose, times_s))
        costs = _motion_costs(around, search, discs, standing, route)
        seconds = _polar(around.max_speed_mps, _SECOND_SPEEDS, _SECOND_COURSES)
        safe = flown[is_safe]
        found[is_safe] = command_costs(search, _BODY, discs, standing, costs, start, safe, seconds)
    return found


def _rest_in_time(
    params: EvasionParams,
    around: Surroundings,
    search: SpaceTime,
    discs: Floats,
    standing: StandingObstacles,
    start: Tuple[float, ...],
    flown: Floats,
) -> NDArray[np.bool_]:
    """Return after which commands the robot can rest before an obstacle reaches it, bool[c]."""
    if params.deviation_mps <= 0.0 or not discs.shape[1]:
        return np.ones(len(flown), np.bool_)
    bodies = discs - np.array([0.0, 0.0, params.clearance_m, 0.0])
    period_s = search.step_s / SUBSTEPS
    hold = max(round(_HOLD_PERIODS * around.period_s / period_s), 1)
    early = round(_EARLY_S / period_s)
    safe: NDArray[np.bool_] = rest_in_time(
        _BODY, bodies, period_s, params.deviation_mps, standing, start, flown, hold, early
    )
    return safe


def _motion_costs(
    around: Surroundings,
    search: SpaceTime,
    discs: Floats,
    standing: StandingObstacles,
    route: Floats,
) -> Floats:
    """Return the cost of the best motion from each step and cell, float64[steps + 1, M, M]."""
    steps = len(discs) // SUBSTEPS
    middle = _middle(search, steps)
    offsets = np.arange(-middle, middle + 1) * search.cell_m
    costs = np.full((steps + 1, len(offsets), len(offsets)), math.inf)
    overlaps, to_go = overlap_costs(standing, offsets), _to_go(around, offsets, route[-1])
    fill_costs(search, discs, overlaps, to_go, costs)
    return costs


def _middle(search: SpaceTime, steps: int) -> int:
    """Return the number of cells to each side: all within reach, or more than two commands need."""
    speed_mps = search.max_speed_mps
    window_m = max(_WINDOW_M, speed_mps * (BOTH_S + rest_s(_BODY, speed_mps) + search.step_s))
    return min(steps * _REACH_CELLS, math.ceil(window_m / search.cell_m)) + _REACH_CELLS


def _acceleration(velocity: Tuple[float, float], command: Tuple[float, float]) -> Tuple[float, ...]:
    """Return the acceleration of a body that follows a command, m/s^2."""
    ax, ay = (_BODY.gain_per_s * (c - v) for c, v in zip(command, velocity))
    shorten = _BODY.acceleration_mps2 / max(math.hypot(ax, ay), _BODY.acceleration_mps2)
    return float(shorten * ax), float(shorten * ay)


def predicted_discs(
    params: EvasionParams, around: Surroundings, tracks: Tracks, now_s: float, times_s: Floats
) -> Tuple[Floats, Floats]:
    """Return where the obstacles will be that can come near within the horizon.

    Args:
        params: The parameters.
        around: The robot among what stands.
        tracks: The moving obstacles, in the local costmap's frame.
        now_s: Present time.
        times_s: float64[t], times after now.

    Returns:
        Two arrays, float64[t, n, 4]: x and y relative to the robot, radius with that of the robot
        and the clearance, standard deviation of the position. The first is predicted with the
        memory of how obstacles have moved, the second without it.
    """
    now = tracks.at(now_s)
    offsets = now.states[:, :2] - np.array([around.pose.x_m, around.pose.y_m])
    speeds = np.hypot(now.states[:, 2], now.states[:, 3])
    radii = now.radii_m + around.radius_m + params.clearance_m
    reach_m = radii + (speeds + around.max_speed_mps) * float(times_s[-1])
    near = now.chosen(np.hypot(offsets[:, 0], offsets[:, 1]) <= reach_m)
    place = around.pose.x_m, around.pose.y_m
    plain = extrapolate(near, around.memory, times_s, place)
    remembered = remember(plain, near, around.memory, times_s, place)
    for discs in (remembered, plain):
        discs[:, :, 2] = discs[:, :, 2] + around.radius_m + params.clearance_m
    return remembered, plain


def prediction_times(memory: MotionMemory, step_s: float) -> Floats:
    """Return the times of predictions, five in each step of the search and the end.

    Motions that repeat are known for longer than others: a longer horizon finds ways through.
    """
    horizon_s = _KNOWN_HORIZON_S if memory.most_repeat else _HORIZON_S
    times: Floats = np.arange(round(horizon_s / step_s) * SUBSTEPS + 1) * (step_s / SUBSTEPS)
    return times


def _search_of(max_speed_mps: float, usual_speed_mps: float) -> SpaceTime:
    """Return the search of a robot: cells are smaller than obstacles, steps are as long."""
    cell_m = min(max_speed_mps * STEP_S / _REACH_CELLS, _MAX_CELL_M)
    return SpaceTime(
        cell_m=cell_m,
        step_s=cell_m * _REACH_CELLS / max_speed_mps,
        max_speed_mps=max_speed_mps,
        usual_speed_mps=usual_speed_mps,
        haste=_HASTE,
        risk_per_s=_RISK_PER_S,
        fade_per_s=_FADE_PER_S,
        blocked_per_s=_BLOCKED_PER_S,
        away_per_s=_AWAY_PER_S,
    )


def _commands(max_speed_mps: float, wished: Tuple[float, float]) -> Floats:
    """Return the wish, the hover and a polar grid of velocities, float64[c, 2]."""
    return np.concatenate([[wished], _polar(max_speed_mps, _SPEEDS, _COURSES)])


def _polar(max_speed_mps: float, speeds: int, courses: int) -> Floats:
    """Return the hover and a polar grid of velocities, float64[c, 2]."""
    angles = np.arange(courses) * (2.0 * math.pi / courses)
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    steps = max_speed_mps * np.arange(1, speeds + 1) / speeds
    return np.concatenate([np.zeros((1, 2)), *(speed * ring for speed in steps)])


def _standing(around: Surroundings) -> StandingObstacles:
    """Return the distances from what stands in the local costmap."""
    spec = around.spec
    gaps = np.empty(around.costs.shape)
    fill_gaps(around.costs, spec.resolution_m, around.radius_m, gaps)
    x_m, y_m = spec.origin_x_m - around.pose.x_m, spec.origin_y_m - around.pose.y_m
    return StandingObstacles(gaps, x_m, y_m, spec.resolution_m)


def _to_go(around: Surroundings, offsets: Floats, end: Floats) -> Floats:
    """Return the time straight to the end of the route from each cell, float64[M, M]."""
    x, y = (offsets + place_m for place_m in (around.pose.x_m, around.pose.y_m))
    to_go: Floats = np.hypot(x - end[0], y[:, None] - end[1]) / around.max_speed_mps
    return to_go
