"""Every shape: read, written, measured, touched by rays and known to the engine and to RViz."""

from __future__ import annotations

import inspect
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from quad_nav.sim import obstacles
from quad_nav.sim.body import World
from quad_nav.sim.casters import KernelCaster
from quad_nav.sim.flight import Airframe, BodyState
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.motion import Motion
from quad_nav.sim.obstacles import SHAPES, Box, Cylinder, Obstacle, Sphere
from quad_nav.sim.scene import MOUNT_HEIGHT_M, MovingObstacle, Scene, Walls
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
def test_a_shape_is_written_and_read(solid):
    document = {**scene_document(scene_with(solid)), "starts": [[1.0, 1.0]]}
    assert scene_from_document(document, "scene").obstacles == (solid,)


@pytest.mark.parametrize("solid", EXAMPLES.values(), ids=EXAMPLES)
@pytest.mark.parametrize("moves", [False, True])
def test_rays_of_kernel_and_engine_meet_the_surface(solid, moves):
    scene, pose, place = scene_with(solid), [[5.5, 5.2, 0.9]], solid
    if moves:
        moving = (MovingObstacle(solid, Motion((0.0,), ((0.0, 0.0, 0.0),))),)
        scene, place = replace(scene, obstacles=(), moving=moving), solid.placed(pose[0])
    body = (1.0, 5.0, 1.0 - MOUNT_HEIGHT_M, 0.0, 0.0, 0.0, 1.0)
    bodies = BodyState(np.array([[*body, *np.zeros(6)]]), np.array(pose if moves else []))
    params = LidarParams()
    (ranges,) = KernelCaster(params, scene, 1).cast(bodies, [0])
    angles = params.angle_min_rad + params.step_size_rad * np.arange(len(ranges))
    x_m, y_m = 1.0 + ranges * np.cos(angles), 5.0 + ranges * np.sin(angles)
    hit = np.hypot(x_m - place.x_m, y_m - place.y_m) < place.reach_m + 1e-6
    assert np.count_nonzero(hit) > 10
    assert place.surface_distance_m(x_m[hit], y_m[hit], 1.0) == pytest.approx(0.0, abs=1e-6)

    world = World(scene, [], Airframe(), 1 / 240)
    world.place_obstacles(bodies.obstacles.reshape(-1, 3))
    for bearing in np.arange(0.0, 2 * math.pi, 0.5):
        start = np.array((5.0 + 4.0 * math.cos(bearing), 5.0 + 4.0 * math.sin(bearing), 1.0))
        (part,) = world.cast(start[None], np.array([place.centre_m]))
        end = start + part * (np.array(place.centre_m) - start)
        assert place.surface_distance_m(*end) == pytest.approx(0.0, abs=2e-3)
    world.close()


@pytest.mark.parametrize("solid", EXAMPLES.values(), ids=EXAMPLES)
def test_drawings_have_its_extent(solid):
    (marker,) = (one for one in scene_markers(scene_with(solid)) if one.namespace == "obstacles")
    assert marker.size_m[2] == pytest.approx(solid.height_m)
    middle = solid.bottom_m + solid.height_m / 2
    for x_m, y_m in solid.outline_m():
        assert solid.surface_distance_m(x_m, y_m, middle) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("solid", EXAMPLES.values(), ids=EXAMPLES)
def test_a_scene_whose_distances_were_asked_for_can_be_sent_to_another_process(solid):
    scene = scene_with(solid)
    distance_m = scene.flight_surface_distance_m(2.5, 5.0)
    assert pickle.loads(pickle.dumps(scene)).flight_surface_distance_m(2.5, 5.0) == distance_m
