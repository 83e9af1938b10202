"""Pedestrians by the social force model.

``sim/walkers.py`` has the model, its parameters and their source.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit


class SocialForce(NamedTuple):
    """Parameters of the model, in m and s."""

    relaxation_s: float
    people_m2ps2: float  # strength of the repulsion between people
    people_m: float  # its range
    stride_s: float  # time of another person's step that is kept free
    touch_mps2: float  # strength of the repulsion between bodies, where they touch
    touch_m: float  # its range
    borders_m2ps2: float  # strength of the repulsion from obstacles and walls
    borders_m: float  # its range
    cos_sight: float  # cosine of half the angle of sight
    unseen: float  # factor of what is out of sight
    fastest: float  # greatest speed, in desired speeds


class Ground(NamedTuple):
    """Distances to the nearest obstacle or wall, at the centres of a grid's cells."""

    distances: NDArray[np.float64]  # [rows, columns], metres
    low_x: float  # of the first cell's centre
    low_y: float
    cell_m: float


class People(NamedTuple):
    """State of n people; all arrays are changed in place."""

    positions: NDArray[np.float64]  # [n, 2]
    velocities: NDArray[np.float64]  # [n, 2]
    speeds: NDArray[np.float64]  # [n], desired
    places: NDArray[np.float64]  # [n, k, 2], where each walks, in turn
    legs: NDArray[np.int64]  # [n], number of the place that each walks to
    left_s: NDArray[np.float64]  # [n], time until each gives up its place
    radius_m: float


@njit(cache=True, nogil=True)
def step_people(
    people: People,
    others: NDArray[np.float64],
    others_radius_m: float,
    ground: Ground,
    model: SocialForce,
    reached_m: float,
    step_s: float,
) -> None:
    """Move people by one time step.

    Args:
        people: The people, moved in place.
        others: float64[o, 4], positions and velocities (x, y, vx, vy) of others whom they see.
        others_radius_m: Radius of the others.
        ground: Distances to what stands.
        model: Parameters.
        reached_m: Distance from a place at which it is reached.
        step_s: Length of the step.
    """
    count, seen = people.speeds.shape[0], others.shape[0]
    forces = np.empty((count, 2))
    for k in range(count):
        x, y = people.positions[k]
        place = people.places[k, people.legs[k] % people.places.shape[1]]
        far = math.hypot(place[0] - x, place[1] - y)
        people.left_s[k] -= step_s
        if far < reached_m or people.left_s[k] <= 0.0:
            people.legs[k] += 1
            place = people.places[k, people.legs[k] % people.places.shape[1]]
            far = math.hypot(place[0] - x, place[1] - y)
            people.left_s[k] = 3.0 * far / people.speeds[k] + 5.0
        ahead_x, ahead_y = (place[0] - x) / max(far, 1e-9), (place[1] - y) / max(far, 1e-9)
        force_x = (people.speeds[k] * ahead_x - people.velocities[k, 0]) / model.relaxation_s
        force_y = (people.speeds[k] * ahead_y - people.velocities[k, 1]) / model.relaxation_s
        for other in range(count + seen):
            if other == k:
                continue
            if other < count:
                from_x, from_y = x - people.positions[other, 0], y - people.positions[other, 1]
                vx, vy = people.velocities[other]
                between = 2.0 * people.radius_m
            else:
                from_x, from_y = x - others[other - count, 0], y - others[other - count, 1]
                vx, vy = others[other - count, 2], others[other - count, 3]
                between = people.radius_m + others_radius_m
            push_x, push_y = repulsion(from_x, from_y, vx, vy, model)
            size = math.hypot(push_x, push_y)
            # A force is seen if its source is: the source is against the force.
            if -(ahead_x * push_x + ahead_y * push_y) < size * model.cos_sight:
                push_x, push_y = model.unseen * push_x, model.unseen * push_y
            gap = math.hypot(from_x, from_y)
            touch = model.touch_mps2 * math.exp((between - gap) / model.touch_m) / max(gap, 1e-6)
            force_x += push_x + touch * from_x
            force_y += push_y + touch * from_y
        distance, away_x, away_y = _border(ground, x, y)
        push = model.borders_m2ps2 / model.borders_m * math.exp(-distance / model.borders_m)
        forces[k] = force_x + push * away_x, force_y + push * away_y
    for k in range(count):
        vx = people.velocities[k, 0] + step_s * forces[k, 0]
        vy = people.velocities[k, 1] + step_s * forces[k, 1]
        limit = model.fastest * people.speeds[k]
        shorten = limit / max(math.hypot(vx, vy), limit)
        people.velocities[k] = shorten * vx, shorten * vy
        people.positions[k, 0] += step_s * shorten * vx
        people.positions[k, 1] += step_s * shorten * vy


@njit(cache=True, nogil=True)
def repulsion(x: float, y: float, vx: float, vy: float, model: SocialForce) -> Tuple[float, float]:
    """Return the acceleration away from somebody, m/s^2.

    The potential is V exp(-b / sigma). Its lines of equal height are ellipses with half the minor
    axis b and the other's place now and after a step as focal points.

    Args:
        x: Position relative to the other, along x.
        y: Along y.
        vx: Velocity of the other.
        vy: Along y.
        model: Parameters.
    """
    after_x, after_y = x - model.stride_s * vx, y - model.stride_s * vy
    here, after = max(math.hypot(x, y), 1e-6), max(math.hypot(after_x, after_y), 1e-6)
    stride = model.stride_s * math.hypot(vx, vy)
    b = 0.5 * math.sqrt(max((here + after) ** 2 - stride * stride, 1e-6))
    slope = model.people_m2ps2 / model.people_m * math.exp(-b / model.people_m)
    slope *= (here + after) / (4.0 * b)
    return slope * (x / here + after_x / after), slope * (y / here + after_y / after)


@njit(cache=True, nogil=True)
def _border(ground: Ground, x: float, y: float) -> Tuple[float, float, float]:
    """Return the distance to what stands, and the direction away from it."""
    rows, columns = ground.distances.shape
    column = min(max(int(round((x - ground.low_x) / ground.cell_m)), 1), columns - 2)
    row = min(max(int(round((y - ground.low_y) / ground.cell_m)), 1), rows - 2)
    dx = ground.distances[row, column + 1] - ground.distances[row, column - 1]
    dy = ground.distances[row + 1, column] - ground.distances[row - 1, column]
    size = max(math.hypot(dx, dy), 1e-9)
    return ground.distances[row, column], dx / size, dy / size


@njit(cache=True, nogil=True)
def walk(
    people: People,
    ground: Ground,
    model: SocialForce,
    reached_m: float,
    step_s: float,
    steps_each: int,
    tracks: NDArray[np.float64],
) -> None:
    """Let people walk, and fill their positions, float64[t, n, 2], each ``steps_each`` steps."""
    no_robots = np.zeros((0, 4))
    for k in range(tracks.shape[0]):
        tracks[k] = people.positions
        for _ in range(steps_each):
            step_people(people, no_robots, 0.0, ground, model, reached_m, step_s)
