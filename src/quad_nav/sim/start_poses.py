"""Start poses of quadcopters: those of a scene, displaced at random."""

from __future__ import annotations

import math
from typing import List, Sequence

import numpy as np

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.sim.scene import BODY_RADIUS_M, Scene

_START_GAP_M = 0.05
_START_TRIES = 1000


def start_poses(
    scene: Scene, n_robots: int, jitter_m: float, seed: int, body_radius_m: float = BODY_RADIUS_M
) -> List[Pose2D]:
    """Displace the first start poses of a scene at random, each in a disc of ``jitter_m``.

    Each keeps clear of obstacles, walls and the starts before it.

    Raises:
        InputError: The scene has too few starts, or a start has no free position around it.
    """
    if not 1 <= n_robots <= len(scene.starts):
        known = f"1 to {len(scene.starts)}, the start poses of scene {scene.name}"
        more = f"{known}; a further line in its `starts` adds a robot"
        raise InputError([f"robots: {n_robots}, expected {more}"])
    random = np.random.default_rng([seed, 0])
    starts: List[Pose2D] = []
    for robot in range(n_robots):
        starts.append(_displaced(scene, robot, starts, jitter_m, random, body_radius_m))
    return starts


def _displaced(
    scene: Scene,
    robot: int,
    others: Sequence[Pose2D],
    jitter_m: float,
    random: np.random.Generator,
    body_radius_m: float,
) -> Pose2D:
    start = scene.starts[robot]
    if jitter_m == 0.0:
        return start
    for _ in range(_START_TRIES):
        radius_m = jitter_m * math.sqrt(random.random())
        angle_rad = 2.0 * math.pi * random.random()
        x_m = start.x_m + radius_m * math.cos(angle_rad)
        y_m = start.y_m + radius_m * math.sin(angle_rad)
        pose = Pose2D(x_m, y_m, start.yaw_rad)
        if (
            scene.contains(x_m, y_m)
            and scene.surface_distance_m(x_m, y_m, scene.altitude_m) > body_radius_m + _START_GAP_M
            and all(pose.distance_to(o) > 2 * body_radius_m + _START_GAP_M for o in others)
        ):
            return pose
    around = f"quad{robot} around ({start.x_m:g}, {start.y_m:g})"
    problem = f"jitter: {jitter_m:g} m leaves no free start for {around}, expected a smaller jitter"
    raise InputError([problem])
