"""People who walk between random places, by the social force model.

Source: D. Helbing, P. Molnar, "Social force model for pedestrian dynamics", Physical Review E 51,
1995, with its parameters: relaxation time 0.5 s, repulsion between people 2.1 m^2/s^2 over 0.3 m
with a step of 2 s, repulsion from borders 10 m^2/s^2 over 0.2 m, sight of 200 degrees with a factor
0.5 outside of it, at most 1.3 times the desired speed; no attractions and no fluctuations. People
are points there. Their bodies are kept apart by the repulsion of D. Helbing, I. Farkas, T. Vicsek,
"Simulating dynamical features of escape panic", Nature 407, 2000: 2000 N / 80 kg where two bodies
touch, and less by a factor e for each 0.08 m between them. The step of time is 0.02 s.

Desired speeds are uniform between two limits. Each person walks from place to place: the next one
is random, at least 3 m away if there is one, and in sight, so that no obstacle stands between the
two. A person who does not get there in three times the usual time walks to the next one.

People who react to quadcopters see them as people of the quadcopters' radius. Their walk depends on
the flight: the process with the bodies advances it every 1/40 s (``Crowd``).

People who do not react to quadcopters walk by themselves: their walk of five minutes is computed at
the start, and then played forwards and backwards in turn, so that no person jumps.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, List, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError
from quad_nav.sim.motion import Motion, Walkers
from quad_nav.sim.scene import Scene
from quad_nav.sim.social_force import Ground, People, SocialForce, step_people, walk

Floats = NDArray[np.float64]

MODEL = SocialForce(
    0.5, 2.1, 0.3, 2.0, 25.0, 0.08, 10.0, 0.2, math.cos(math.radians(100.0)), 0.5, 1.3
)
STEP_S = 0.02
WALK_S = 300.0
KEYFRAME_S = 0.2
REACTION_S = 0.025
"""Period in which people see the quadcopters."""
_KEPT = 2400
REACHED_M = 0.4
FREE_M = 0.3
"""Free space around a person at a place and on the way to it."""
START_M = 1.5
"""Distance of people at the start from the quadcopters' start poses."""
_LEG_M = 3.0
_PLACES = 200
_TRIES = 200
_CELL_M, _MAX_CELLS = 0.1, 250_000
_STREAM = 5
"""Stream of the walkers, beside those of starts, noise, missions, drift and phases."""


@lru_cache(maxsize=4)
def walks(scene: Scene, seed: int) -> Tuple[Motion, ...]:
    """Return the motion of each walker of a scene, who does not react to quadcopters.

    Raises:
        InputError: The scene has no room for them.
    """
    if scene.walkers is None:
        return ()
    ground = ground_of(scene)
    people = people_of(scene, scene.walkers, ground, np.random.default_rng([seed, _STREAM]))
    count, each = round(WALK_S / KEYFRAME_S) + 1, round(KEYFRAME_S / STEP_S)
    tracks = np.empty((count, scene.walkers.count, 2))
    walk(people, ground, MODEL, REACHED_M, STEP_S, each, tracks)
    both_ways = np.concatenate([tracks, tracks[-2::-1]])
    times_s = tuple((KEYFRAME_S * np.arange(len(both_ways))).tolist())
    return tuple(
        Motion(times_s, tuple((x_m, y_m, 0.0) for x_m, y_m in track.tolist()))
        for track in np.swapaxes(both_ways, 0, 1)
    )


class Crowd:
    """People of a scene who react to quadcopters.

    Times are those since the motions' start. Only the last minute is known.

    Raises:
        InputError: The scene has no room for them.
    """

    def __init__(self, scene: Scene, seed: int) -> None:
        assert scene.walkers is not None
        self._ground = ground_of(scene)
        random = np.random.default_rng([seed, _STREAM])
        self._people = people_of(scene, scene.walkers, self._ground, random)
        count = scene.walkers.count
        self._places = np.empty((2 * _KEPT, count, 2))  # in order, up to _end
        self._places[0], self._end = self._people.positions, 1
        self._last = 0  # number of the newest places

    def react(self, time_s: float, others: Floats, radius_m: float) -> None:
        """Walk up to the end of the present period, unless that is known.

        ``others`` is float64[o, 4], position and velocity of each quadcopter in ``map``.
        """
        if round_down(time_s) < self._last:
            return
        step_people(self._people, others, radius_m, self._ground, MODEL, REACHED_M, REACTION_S)
        if self._end == len(self._places):
            self._places[:_KEPT], self._end = self._places[-_KEPT:], _KEPT
        self._places[self._end] = self._people.positions
        self._end += 1
        self._last += 1

    def poses(self, times_s: Floats) -> Floats:
        """Return the poses float64[t, n, 3] at float64[t]; NaN where they are not known."""
        kept = self._places[max(self._end - _KEPT, 0) : self._end]
        first = self._last + 1 - len(kept)
        at = times_s / REACTION_S - first
        poses = np.full((len(times_s), kept.shape[1], 3), np.nan)
        known = (at > -1e-6) & (at < len(kept) - 1 + 1e-6)
        if len(kept) == 1:
            poses[known, :, :2] = kept[0]
        else:
            row = np.clip(np.floor(at[known]).astype(int), 0, len(kept) - 2)
            part = (at[known] - row)[:, None, None]
            poses[known, :, :2] = kept[row] + part * (kept[row + 1] - kept[row])
        poses[known, :, 2] = 0.0
        return poses


def round_down(time_s: float) -> int:
    """Return the number of whole periods of reaction in a time."""
    return math.floor(time_s / REACTION_S + 1e-6)


def ground_of(scene: Scene) -> Ground:
    """Return the distances to the obstacles and walls of a scene at half a person's height."""
    assert scene.walkers is not None
    cell_m = max(_CELL_M, math.sqrt(scene.size_x_m * scene.size_y_m / _MAX_CELLS))
    low = np.array([scene.origin_x_m, scene.origin_y_m]) + cell_m / 2
    columns, rows = (
        max(3, math.ceil(size_m / cell_m)) for size_m in (scene.size_x_m, scene.size_y_m)
    )
    x_m, y_m = low[0] + cell_m * np.arange(columns), low[1] + cell_m * np.arange(rows)
    distances = np.empty((rows, columns))
    for row in range(0, rows, 64):
        centres = np.stack(np.meshgrid(x_m, y_m[row : row + 64]), axis=-1)
        distances[row : row + 64] = scene.surface_distances_m(centres, 0.5 * scene.walkers.height_m)
    return Ground(distances, float(low[0]), float(low[1]), cell_m)


def people_of(
    scene: Scene, walkers: Walkers, ground: Ground, random: np.random.Generator
) -> People:
    """Return people at their first places, standing.

    Raises:
        InputError: The scene has no room for them.
    """
    free_m = walkers.radius_m + FREE_M
    rows, columns = np.nonzero(ground.distances > free_m)
    free: Any = np.column_stack([columns, rows]) * ground.cell_m + (ground.low_x, ground.low_y)
    if len(free) == 0:
        raise InputError([f"scene {scene.name}: walkers: there is no free place for a person"])
    starts: List[Floats] = []
    taken = [np.array([start.x_m, start.y_m]) for start in scene.starts]
    for number in range(walkers.count):
        for _ in range(_TRIES):
            place = free[random.integers(len(free))]
            if all(math.dist(place, one) >= START_M for one in taken) and all(
                math.dist(place, one) >= 2 * walkers.radius_m + FREE_M for one in starts
            ):
                break
        else:
            place_m = f"{START_M:g} m from all start poses; expected fewer"
            problem = f"no room for person {number} of {walkers.count}, {place_m}"
            raise InputError([f"scene {scene.name}: walkers: {problem}"])
        starts.append(place)
    count = walkers.count
    return People(
        np.array(starts),
        np.zeros((count, 2)),
        random.uniform(*walkers.speed_mps, count),
        np.array([_places(start, free, ground, free_m, random) for start in starts]),
        np.zeros(count, np.int64),
        np.full(count, math.inf),
        walkers.radius_m,
    )


def _places(
    start: Floats, free: Floats, ground: Ground, free_m: float, random: np.random.Generator
) -> Floats:
    """Return the places that a person walks to, float64[k, 2], the start first."""
    places = [start]
    while len(places) < _PLACES:
        best = places[-1]
        for place in free[random.integers(len(free), size=_TRIES)]:
            if _is_free(places[-1], place, ground, free_m):
                best = place
                if math.dist(places[-1], place) >= _LEG_M:
                    break
        places.append(best)
    return np.array(places)


def _is_free(start: Floats, end: Floats, ground: Ground, free_m: float) -> bool:
    """Return whether a person can walk straight from one place to another."""
    count = int(math.dist(start, end) / ground.cell_m) + 2
    points = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
    cells = np.rint((points - (ground.low_x, ground.low_y)) / ground.cell_m).astype(int)
    return bool(np.all(ground.distances[cells[:, 1], cells[:, 0]] > 0.9 * free_m))
