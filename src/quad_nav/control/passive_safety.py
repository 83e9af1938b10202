"""Passive safety: the robot rests before an obstacle can reach it.

People turn, stop and start, which no prediction knows, and they go around a robot that rests. So
the evasion flies only commands after which the robot can brake and rest before anybody can reach
it. Whoever touches it then has run into a robot at rest.

An obstacle can be where a greatest acceleration takes it from the way of its velocity, to any side,
but no farther than a walk from where it is now. In the same time one that walks can turn back, and
one that stands can only begin to walk: its acceleration is half as large.

Sources: K. Macek, D. Vasquez, T. Fraichard, R. Siegwart, "Towards Safe Vehicle Navigation in
Dynamic Urban Scenarios", Automatika 50, 2009: if a collision cannot be avoided, the robot is at
rest then; ISO/TS 15066:2016, section 5.5.4: speed and separation monitoring, a protective distance
of what the person and the robot can fly until it rests; ISO 13855:2010: people walk at 1.6 m/s.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.passive_safety_kernel import Reachable, rest_in_time
from quad_nav.control.surroundings import BODY, EvasionParams, Surroundings
from quad_nav.tracking.tracks import Tracks

Floats = NDArray[np.float64]

_PERIOD_S = 0.05
_HOLD_PERIODS = 1.5  # for which a command acts: until the next one, and odometry is a little old
_HORIZON_S = 1.5  # beyond what it takes to brake from the greatest speed
_MARGIN_M = 0.05  # error of positions, and of the body's response


def safe_commands(
    params: EvasionParams,
    around: Surroundings,
    tracks: Tracks,
    commands: Floats,
    last: Tuple[float, float],
) -> NDArray[np.bool_]:
    """Return after which commands the robot can rest before an obstacle can reach it, bool[c].

    Without passive safety these are all.

    Args:
        params: The parameters.
        around: The robot among what stands.
        tracks: The moving obstacles now, in the local costmap's frame.
        commands: float64[c, 2], velocities along the axes of the same frame, m/s.
        last: The last command.
    """
    if params.max_acceleration_mps2 <= 0.0:
        return np.ones(len(commands), np.bool_)
    start = around.motion(last)
    hold_s = _HOLD_PERIODS * around.period_s
    fastest_mps = max(around.max_speed_mps, math.hypot(*start[:2]))
    horizon_s = hold_s + fastest_mps / BODY.acceleration_mps2 + _HORIZON_S
    times_s = _PERIOD_S * np.arange(math.ceil(horizon_s / _PERIOD_S) + 1)
    reachable = reachable_places(params, around, tracks, times_s)
    if not len(reachable.places):
        return np.ones(len(commands), np.bool_)
    hold = max(round(hold_s / _PERIOD_S), 1)
    safe: NDArray[np.bool_] = rest_in_time(
        BODY, reachable, _PERIOD_S, around.standing, start, commands, hold
    )
    return safe


def reachable_places(
    params: EvasionParams,
    around: Surroundings,
    tracks: Tracks,
    times_s: Floats,
) -> Reachable:
    """Return where obstacles can be that could reach the robot within the times.

    Args:
        params: The parameters.
        around: The robot.
        tracks: The moving obstacles now, in the local costmap's frame.
        times_s: float64[t], times after now.
    """
    states = np.concatenate([tracks.states, tracks.suspects[:, :4]])
    places = states[:, :2] - (around.pose.x_m, around.pose.y_m)
    speeds_mps = np.hypot(*states[:, 2:].T)
    fastest_mps = np.maximum(speeds_mps, params.walking_mps)
    radii_m = np.append(tracks.radii_m, tracks.suspects[:, 4]) + around.radius_m + _MARGIN_M
    reach_m = radii_m + float(times_s[-1]) * (fastest_mps + around.max_speed_mps)
    near = np.hypot(*places.T) <= reach_m
    after_s = times_s[:, np.newaxis]
    predicted = np.empty((len(times_s), int(near.sum()), 3))
    predicted[:, :, :2] = places[near] + after_s[:, :, np.newaxis] * states[near, 2:]
    accelerations = 0.5 * params.max_acceleration_mps2 * (1.0 + speeds_mps / fastest_mps)
    predicted[:, :, 2] = (radii_m + 0.5 * accelerations * after_s**2)[:, near]
    walked = (radii_m + fastest_mps * after_s)[:, near]
    return Reachable(predicted, places[near], np.ascontiguousarray(walked))
