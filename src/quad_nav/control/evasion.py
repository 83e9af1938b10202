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
With passive safety it chooses among the safe commands only, and the robot brakes if there is none.
Peers are in the way as well: commands are judged as the robot's Voronoi cell will leave them, and
peers are expected to keep their velocities.

Sources: P. Fiorini, Z. Shiller, "Motion Planning in Dynamic Environments Using Velocity
Obstacles", IJRR 17(7), 1998: obstacles that keep their velocities, judged in the plane of
velocities; A. Kushleyev, M. Likhachev, "Time-bounded Lattice for Efficient Planning in Dynamic
Environments", ICRA 2009: search in space and time against Gaussian predictions, up to a horizon.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.body_response import rest_s
from quad_nav.control.evasion_commands import BOTH_S, command_costs
from quad_nav.control.passive_safety import safe_commands
from quad_nav.control.prediction import join_discs, predict
from quad_nav.control.space_time import SUBSTEPS, SpaceTime, fill_costs
from quad_nav.control.standing_obstacles import overlap_costs
from quad_nav.control.surroundings import BODY, EvasionParams, Surroundings, polar
from quad_nav.geometry import Twist2D
from quad_nav.tracking.tracks import Tracks

Floats = NDArray[np.float64]

STEP_S = 0.5
_HORIZON_S = 6.0
_WINDOW_M = 5.0  # the least window, from the robot to each side
_REACH_CELLS = 2  # cells that the robot flies in a step
_MAX_CELL_M = 0.2
_FADE_PER_S = 0.35
_RISK_PER_S, _BLOCKED_PER_S, _AWAY_PER_S = 40.0, 100.0, 0.05
_HASTE = 1.3  # what a second gains at the greatest speed: 1 and _AWAY_PER_S for each second left
_CHANGE_S = 0.1  # cost of another command than the last one, at the greatest speed's difference
_WISH_S = 0.1  # by how much a command has to be better than the wish
_SPEEDS, _COURSES = 4, 24
_SECOND_SPEEDS, _SECOND_COURSES = 2, 12


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
    times_s = prediction_times(search.step_s)
    discs = predicted_discs(params, around, tracks, now_s, times_s)
    is_near = discs.shape[1] or len(tracks.suspects)
    if not is_near and around.is_following and not around.is_fast:
        return wish
    discs = join_discs(discs, around.neighbours.discs(around.pose, times_s))
    commands = _commands(around.max_speed_mps, around.pose.rotate(wish.vx_mps, wish.vy_mps))
    flown = around.neighbours.limited(commands)
    safe = safe_commands(params, around, tracks.at(now_s), flown, last)
    if not safe.any():
        return Twist2D(-around.velocity.vx_mps, -around.velocity.vy_mps, wish.vyaw_radps)
    found = np.full(len(commands), math.inf)
    found[safe] = _costs_of(flown[safe], around, search, discs, route, last)
    found += _CHANGE_S / around.max_speed_mps * np.hypot(*(commands - last).T)
    best = int(np.argmin(found[1:])) + 1
    if found[0] <= found[best] + _WISH_S:
        return wish
    return around.twist(commands[best], wish.vyaw_radps)


def _costs_of(
    flown: Floats,
    around: Surroundings,
    search: SpaceTime,
    discs: Floats,
    route: Floats,
    last: Tuple[float, float],
) -> Floats:
    """Return the cost of each command as peers leave it, float64[c]; those are float64[c, 2]."""
    steps = len(discs) // SUBSTEPS
    middle = _middle(search, steps)
    offsets = np.arange(-middle, middle + 1) * search.cell_m
    standing = around.standing
    costs = np.full((steps + 1, len(offsets), len(offsets)), math.inf)
    overlaps, to_go = overlap_costs(standing, offsets), _to_go(around, offsets, route[-1])
    fill_costs(search, discs, overlaps, to_go, costs)
    start = around.motion(last)
    seconds = polar(around.max_speed_mps, _SECOND_SPEEDS, _SECOND_COURSES)
    found: Floats = command_costs(search, BODY, discs, standing, costs, start, flown, seconds)
    return found


def _middle(search: SpaceTime, steps: int) -> int:
    """Return the number of cells to each side: all within reach, or more than two commands need."""
    speed_mps = search.max_speed_mps
    window_m = max(_WINDOW_M, speed_mps * (BOTH_S + rest_s(BODY, speed_mps) + search.step_s))
    return min(steps * _REACH_CELLS, math.ceil(window_m / search.cell_m)) + _REACH_CELLS


def predicted_discs(
    params: EvasionParams, around: Surroundings, tracks: Tracks, now_s: float, times_s: Floats
) -> Floats:
    """Return where the obstacles will be that can come near within the horizon.

    Args:
        params: The parameters.
        around: The robot among what stands.
        tracks: The moving obstacles, in the local costmap's frame.
        now_s: Present time.
        times_s: float64[t], times after now.

    Returns:
        float64[t, n, 4]: x and y relative to the robot, radius with that of the robot and the
        clearance, standard deviation of the position.
    """
    now = tracks.at(now_s)
    offsets = now.states[:, :2] - np.array([around.pose.x_m, around.pose.y_m])
    speeds = np.hypot(now.states[:, 2], now.states[:, 3])
    radii = now.radii_m + around.radius_m + params.clearance_m
    reach_m = radii + (speeds + around.max_speed_mps) * float(times_s[-1])
    near = np.hypot(offsets[:, 0], offsets[:, 1]) <= reach_m
    place = around.pose.x_m, around.pose.y_m
    discs = predict(now.chosen(near), times_s, place)
    discs[:, :, 2] = discs[:, :, 2] + around.radius_m + params.clearance_m
    return discs


def prediction_times(step_s: float) -> Floats:
    """Return the times of predictions, five in each step of the search and the end."""
    times: Floats = np.arange(round(_HORIZON_S / step_s) * SUBSTEPS + 1) * (step_s / SUBSTEPS)
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
    return np.concatenate([[wished], polar(max_speed_mps, _SPEEDS, _COURSES)])


def _to_go(around: Surroundings, offsets: Floats, end: Floats) -> Floats:
    """Return the time straight to the end of the route from each cell, float64[M, M]."""
    x, y = (offsets + place_m for place_m in (around.pose.x_m, around.pose.y_m))
    to_go: Floats = np.hypot(x - end[0], y[:, None] - end[1]) / around.max_speed_mps
    return to_go
