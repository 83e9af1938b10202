"""Motions and people in scene files."""

import pytest
from moving_cart import cart, scene_with

from quad_nav.errors import InputError
from quad_nav.sim.motion import LINEAR, SPLINE, Motion, Walkers
from quad_nav.sim.obstacles import Box, Cylinder, Sphere
from quad_nav.sim.scene_file import load_scene, scene_from_document
from quad_nav.sim.scene_writer import scene_document, write_scene


def document(**given):
    return {"size": [12.0, 12.0], "starts": [[6.0, 5.0]], **given}


def moving_document(**given):
    keyframes = [{"time": 0, "x": 2.0, "y": 5.0}, {"time": 8.0, "x": 10.0, "y": 5.0, "yaw": 1.0}]
    shape = {"name": "cart", "shape": "box", "size": [1.0, 0.5], "height": 2.0, "yaw": 0.5}
    return document(obstacles=[{**shape, "motion": {"keyframes": keyframes, **given}}])


def test_a_motion_in_a_file():
    scene = scene_from_document(moving_document(phase="random"), "s.yaml")
    assert scene.obstacles == ()
    (one,) = scene.moving
    assert one.shape == Box("cart", 2.0, 5.0, 1.0, 0.5, 2.0, 0.5)
    assert one.motion == Motion(
        (0.0, 8.0), ((2.0, 5.0, 0.5), (10.0, 5.0, 1.0)), True, LINEAR, 0.0, None
    )


def test_scenes_with_motions_are_written_and_read_again(tmp_path):
    shapes = (
        Box("box", 2.0, 5.0, 1.0, 0.5, 2.0),
        Cylinder("post", 2.0, 5.0, 0.2, 2.0, 0.1),
        Sphere("ball", 2.0, 5.0, 1.0, 0.3),
    )
    scene = scene_with(
        cart(shapes[0], interpolation=SPLINE, tension=0.5),
        cart(shapes[1], loop=False, phase_s=2.0),
        cart(shapes[2], phase_s=None),
        motion_phase_s=None,
        walkers=Walkers(3, (0.6, 1.0), 0.2, reacting=True),
    )
    write_scene(scene, tmp_path / "yard.yaml")
    assert load_scene(tmp_path / "yard.yaml") == scene
    assert scene_from_document(scene_document(scene), "s") == scene


@pytest.mark.parametrize(
    "given, problem",
    [
        (moving_document(keyframes=[]), "keyframes: a list of 0, expected a list of 1 to 10000"),
        (
            moving_document(keyframes=[{"time": 1, "x": 0, "y": 0}, {"time": 1, "x": 1, "y": 0}]),
            "keyframes[1].time: 1, expected more than that of the keyframe before, 1",
        ),
        (
            moving_document(keyframes=[{"time": -1, "x": 0, "y": 0}]),
            "keyframes[0].time: -1, expected 0 or more",
        ),
        (
            moving_document(keyframes=[{"time": 0, "x": 0, "z": 0, "y": 0}]),
            "keyframes[0].z: unknown key; known: time, x, y, yaw",
        ),
        (
            moving_document(interpolation="cubic"),
            "interpolation: 'cubic', expected linear or spline",
        ),
        (
            moving_document(tension=0.5),
            "tension: given without interpolation: spline, expected both",
        ),
        (moving_document(loop=1), "loop: 1, expected true or false"),
        (moving_document(phase="any"), "phase: 'any', expected random, or seconds"),
        (
            moving_document(phase="random", loop=False),
            "phase: random without a loop, expected loop: true, or seconds",
        ),
    ],
)
def test_faults_of_motions(given, problem):
    with pytest.raises(InputError) as error:
        scene_from_document(given, "s.yaml")
    assert error.value.problems == [f"s.yaml: obstacles[0].motion.{problem}"]


@pytest.mark.parametrize(
    "walkers, problem",
    [
        ({"count": 0}, "walkers.count: 0, expected a number of 1 to 200"),
        ({"count": 2, "reacting": "no"}, "walkers.reacting: 'no', expected true or false"),
        (
            {"count": 2, "speed": [2.0, 1.0]},
            "walkers.speed: 2, 1, expected the lowest and the highest speed, at most 5 m/s",
        ),
    ],
)
def test_faults_of_walkers(walkers, problem):
    with pytest.raises(InputError) as error:
        scene_from_document(document(walkers=walkers), "s.yaml")
    assert error.value.problems == [f"s.yaml: {problem}"]


def test_names_of_moving_obstacles_are_unique_too():
    given = moving_document()
    given["obstacles"].append({**given["obstacles"][0]})
    with pytest.raises(InputError, match="name 'cart' is taken, expected unique names"):
        scene_from_document(given, "s.yaml")
