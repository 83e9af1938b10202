"""Start poses: displaced, free, and as many as there are robots."""

from __future__ import annotations

from typing import Set, Tuple

import pytest

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.sim.obstacles import Cylinder
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.start_poses import start_poses

MIDDLE = Pose2D(10.0, 10.0, 0.0)


def room(*starts: Pose2D, obstacles=()) -> Scene:
    return Scene("room", 20.0, 20.0, 1.0, Walls(), tuple(obstacles), starts)


def test_jittered_starts_are_free():
    scene = room(
        Pose2D(1.0, 1.0), Pose2D(1.7, 1.0), obstacles=[Cylinder("pillar", 1.0, 2.0, 0.4, 2.0)]
    )
    seen: Set[Tuple[float, float]] = set()
    for seed in range(50):
        starts = start_poses(scene, 2, 0.5, seed)
        assert starts == start_poses(scene, 2, 0.5, seed)
        assert starts[0].distance_to(starts[1]) > 0.6
        for start, nominal in zip(starts, scene.starts):
            assert 0.0 < start.distance_to(nominal) <= 0.5
            assert scene.surface_distance_m(start.x_m, start.y_m, 1.0) > 0.3
        seen.update((s.x_m, s.y_m) for s in starts)
    assert len(seen) == 100


def test_more_robots_than_starts():
    with pytest.raises(InputError, match="robots: 3, expected 1 to 2"):
        start_poses(room(MIDDLE, Pose2D(5.0, 5.0)), 3, 0.0, 0)


def test_starts_are_at_least_the_body_radius_from_obstacles():
    scene = room(MIDDLE, obstacles=[Cylinder("pillar", 10.6, 10.0, 0.35, 2.0)])
    for seed in range(20):
        for radius_m in (0.2, 0.5):
            (start,) = start_poses(scene, 1, 1.0, seed, radius_m)
            assert scene.flight_surface_distance_m(start.x_m, start.y_m) > radius_m
    with pytest.raises(InputError, match="leaves no free start"):
        start_poses(scene, 1, 0.2, 0, 0.6)
