"""Every shape: read, written, measured, touched by rays and known to the engine and to RViz."""

from __future__ import annotations

import inspect
import math

import numpy as np
import pytest

from quad_nav.sim import obstacles
from quad_nav.sim.body import World
from quad_nav.sim.casters import KernelCaster
from quad_nav.sim.flight import Airframe, BodyState
from quad_nav.sim.lidar import MOUNT_HEIGHT_M, LidarParams
from quad_nav.sim.obstacles import SHAPES, Box, Cylinder, Obstacle, Sphere
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.scene_file import scene_from_document
from quad_nav.sim.scene_writer import scene_document
from quad_nav.topics.markers import scene_markers

EXAMPLES = {
    "box": Box("solid", 5.0, 5.0, 2.0, 1.0, 1.5, 0.4, 0.2),
    "cylinder": Cylinder("solid", 5.0, 5.0, 0.8, 1.5, 0.2),
    "sphere": Sphere("solid", 5.0, 5.0, 1.0, 0.7),
}
"""An obstacle of each shape; a new shape needs one here."""


def scene_with(solid: Obstacle) -> Scene:
    return Scene("scene", 10.0, 10.0, 1.0, Walls(), (solid,), ())


def test_every_shape_can_be_read():
    defined = {
        one
        for one in vars(obstacles).values()
        if inspect.isclass(one) and issubclass(one, Obstacle) and not inspect.isabstract(one)
    }
    assert defined == set(SHAPES.values()) and EXAMPLES.keys() == SHAPES.keys()


@pytest.mark.parametrize("solid", EXAMPLES.values(), ids=EXAMPLES)
def test_a_shape_is_the_same_to_files_rays_engine_and_drawings(solid):
    scene = scene_with(solid)
    document = {**scene_document(scene), "starts": [[1.0, 1.0]]}
    assert scene_from_document(document, "scene").obstacles == (solid,)

    pose = (1.0, 5.0, 1.0 - MOUNT_HEIGHT_M, 0.0, 0.0, 0.0, 1.0)
    bodies = BodyState(np.array([[*pose, *np.zeros(6)]]))
    params = LidarParams()
    (ranges,) = KernelCaster(params, scene, 1).cast(bodies, [0])
    angles = params.angle_min_rad + params.step_size_rad * np.arange(len(ranges))
    x_m, y_m = 1.0 + ranges * np.cos(angles), 5.0 + ranges * np.sin(angles)
    hit = np.hypot(x_m - 5.0, y_m - 5.0) < solid.reach_m + 1e-6
    assert np.count_nonzero(hit) > 10
    assert solid.surface_distance_m(x_m[hit], y_m[hit], 1.0) == pytest.approx(0.0, abs=1e-6)

    world = World(scene, [], Airframe(), 1 / 240)
    for bearing in np.arange(0.0, 2 * math.pi, 0.5):
        start = (5.0 + 4.0 * math.cos(bearing), 5.0 + 4.0 * math.sin(bearing), 1.0)
        (part,) = world.cast(np.array([start]), np.array([solid.centre_m]))
        x_m, y_m, z_m = np.array(start) + part * (np.array(solid.centre_m) - start)
        assert solid.surface_distance_m(x_m, y_m, z_m) == pytest.approx(0.0, abs=2e-3)
    world.close()

    (marker,) = (one for one in scene_markers(scene) if one.namespace == "obstacles")
    assert marker.size_m[2] == pytest.approx(solid.height_m)
    middle = solid.bottom_m + solid.height_m / 2
    for x_m, y_m in solid.outline_m():
        assert solid.surface_distance_m(x_m, y_m, middle) == pytest.approx(0.0, abs=1e-9)
