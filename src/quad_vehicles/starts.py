"""Where vehicles stand at first."""

from __future__ import annotations

import math
from typing import List, Optional, Sequence, Tuple

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.sim.scene import BODY_RADIUS_M, Scene
from quad_vehicles.vehicle_file import Vehicle


def starts_of(scene: Scene, vehicles: Sequence[Vehicle]) -> Tuple[Pose2D, ...]:
    """Return where each vehicle stands at first: its file's pose, or the scene's.

    Raises:
        InputError: A simulated vehicle has neither, or touches another one; lists all of them.
    """
    starts: List[Optional[Pose2D]] = []
    problems = []
    for k, one in enumerate(vehicles):
        start = one.map_from_start
        if start is None and one.number < len(scene.starts):
            start = scene.starts[one.number]
        if start is None and one.kind == "simulated":
            problems.append(f"{one.name}: no start, and scene {scene.name} has none for it")
        for before, its in zip(vehicles[:k], starts):
            is_near = start and its and start.distance_to(its) <= 2.0 * BODY_RADIUS_M
            if is_near and "simulated" in (one.kind, before.kind):
                what = f"{one.name}: starts less than {2.0 * BODY_RADIUS_M:g} m from {before.name}"
                problems.append(f"{what}, expected a place of its own")
        starts.append(start)
    if problems:
        raise InputError(problems)
    far = Pose2D(-math.fabs(scene.end_x_m) - 100.0, 0.0)
    return tuple(far if start is None else start for start in starts)
