"""Start poses for places that come without: maps and Gazebo worlds."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Callable, List, Tuple

from quad_nav.geometry import Pose2D
from quad_nav.sim.scene import BODY_RADIUS_M, Scene

MAX_STARTS = 8
MAX_LOOKS = 1000
"""Places that are looked at closely; among 200000 boxes that takes some ten seconds."""
CLEARANCE_M = 2 * BODY_RADIUS_M
SPACING_M = 2.0
_MAX_PLACES = 20_000


def with_free_starts(scene: Scene, may_start: Callable[[float, float], bool]) -> Scene:
    """The scene with up to ``MAX_STARTS`` starts; none where no place is free.

    The places of a lattice are taken from the arena's centre outwards, those that
    ``may_start``, are ``CLEARANCE_M`` from everything and ``SPACING_M`` from each other.
    All look along x. Nothing is drawn at random.
    """
    starts: List[Pose2D] = []
    looked_at = 0
    for x_m, y_m in _places(scene):
        place = Pose2D(x_m, y_m)
        if not may_start(x_m, y_m) or any(place.distance_to(start) < SPACING_M for start in starts):
            continue
        looked_at += 1
        if scene.clearance_m(x_m, y_m, scene.altitude_m) >= CLEARANCE_M:
            starts.append(place)
        if len(starts) == MAX_STARTS or looked_at == MAX_LOOKS:
            break
    return replace(scene, starts=tuple(starts))


def _places(scene: Scene) -> List[Tuple[float, float]]:
    """A lattice over the arena, 0.5 m wide or wider, from the centre outwards."""
    step_m = max(0.5, math.sqrt(scene.size_x_m * scene.size_y_m / _MAX_PLACES))
    x_centre, y_centre = scene.centre
    reach_x = math.floor(scene.size_x_m / 2 / step_m)
    reach_y = math.floor(scene.size_y_m / 2 / step_m)
    cells = itertools.product(range(-reach_y, reach_y + 1), range(-reach_x, reach_x + 1))
    ordered = sorted(cells, key=lambda cell: (cell[0] ** 2 + cell[1] ** 2, cell))
    places = ((x_centre + column * step_m, y_centre + row * step_m) for row, column in ordered)
    return [place for place in places if scene.contains(*place)]
