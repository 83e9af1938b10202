"""Worlds of Stage: bitmaps, blocks, types and units, with numbers computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from PIL import Image

from quad_nav.errors import InputError
from quad_nav.sim.obstacles import Box
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.stage_world import load_stage_world


def world_of(folder, text, name="a.world"):
    path = folder / name
    path.write_text(text)
    return path


def read(folder, text, height_m=2.0):
    return load_stage_world(world_of(folder, text), height_m)


def only(folder, text):
    found = read(folder, text)
    assert found.remarks == ()
    (box,) = found.obstacles
    return box


def same(box, *values):
    found = [box.x_m, box.y_m, box.size_x_m, box.size_y_m, box.height_m, box.yaw_rad, box.bottom_m]
    assert found == pytest.approx([*values, 0.0], abs=1e-9)


def bitmap(folder, *rows, name="a.png"):
    shades = {"#": 127, ".": 128}
    Image.fromarray(np.array([[shades[one] for one in row] for row in rows], np.uint8)).save(
        folder / name
    )


def test_a_floorplan_is_scaled_to_its_size_without_the_white_around_it(tmp_path):
    """Two dark rows of 4 x 3 cells fill 8 x 6 m: a cell is 2 x 2 m, the lower row has one."""
    bitmap(tmp_path, "......", ".####.", "......", ".#....")
    world = read(
        tmp_path, 'model (name "plan" pose [10 0 0 90] size [8 6 0.8] bitmap "a.png")', 1.5
    )
    low, high = sorted(world.obstacles, key=lambda box: box.size_x_m)
    # A quarter turn takes the plan's (-3, -2), its lower left cell, to (2, -3).
    same(low, 12.0, -3.0, 2.0, 2.0, 1.5, math.pi / 2)
    same(high, 8.0, 0.0, 8.0, 2.0, 1.5, math.pi / 2)
    assert [low.name, high.name] == ["plan_b0", "plan_b1"]


def test_types_inherit_and_an_include_defines_them(tmp_path):
    (tmp_path / "map.inc").write_text(
        "define crate model ( size [1 2 3] pose [5 5 0 0] ) # a comment (\n"
        "define crate model ( size [9 9 9] )  # the first definition counts\n"
    )
    text = 'include "map.inc"\ndefine tall crate(size [1 4 3])\nwindow(size [9 9])\n'
    text += "tall(pose [1 2 0 0])"
    same(only(tmp_path, text), 1.0, 2.0, 1.0, 4.0, 2.0, 0.0)


@pytest.mark.parametrize(
    "text, values",
    [
        ("model ()", (0, 0, 0.1, 0.1, 2, 0)),
        ("model (pose [1 2 90] size [3 4])", (1, 2, 3, 4, 2, math.pi / 2)),  # Stage 2
        (
            'unit_length "cm" unit_angle "radians" model (pose [100 0 0 1] size [50 40 9])',
            (1, 0, 0.5, 0.4, 2, 1),
        ),
        ("model (pose [1 0 0 90] origin [2 0 0 0] size [1 1 1])", (1, 2, 1, 1, 2, math.pi / 2)),
        (
            "model (noblocks 1 pose [1 0 0 90] model (pose [2 0 0 90] size [1 1 1]))",
            (1, 2, 1, 1, 2, math.pi),
        ),
        ("model (obstacle_return 0 ranger_return 0.5 size [1 1 1])", (0, 0, 1, 1, 2, 0)),
    ],
)
def test_poses_sizes_and_units(tmp_path, text, values):
    same(only(tmp_path, text), *values)


def test_blocks_together_are_as_large_as_the_model(tmp_path):
    """A square and a triangle, 4 x 2 units together, in 2 x 2 m around (3, 0)."""
    square = "block (points 4 point[0] [0 0] point[1] [2 0] point[2] [2 2] point[3] [0 2] z [0 1])"
    triangle = "block (points 3\npoint[0] [2 0]\npoint[1] [4 0]\npoint[2] [2 2]\nz [0 1])"
    text = f"define c model ({square} {triangle})\nc (pose [3 0 0 0] size [2 2 1])"
    boxes = read(tmp_path, text).obstacles
    points = np.concatenate([box.outline_m() for box in boxes])
    np.testing.assert_allclose(points.min(axis=0), (2.0, -1.0), atol=1e-9)
    np.testing.assert_allclose(points.max(axis=0), (4.0, 1.0), atol=1e-9)

    def distance_m(x_m, y_m):
        return min(box.surface_distance_m(x_m, y_m, 1.0) for box in boxes)

    # The long side is on 2 x + y = 7; cells of 5 cm reach towards the point.
    assert distance_m(3.9, 0.9) == pytest.approx(1.7 / math.sqrt(5), abs=0.08)
    assert distance_m(3.52, 0.02) < 0.05  # on the long side
    assert {box.height_m for box in boxes} == {2.0}


def test_a_boundary_is_four_thin_walls(tmp_path):
    world = read(tmp_path, "model (noblocks 1 boundary 1 size [4 2 1])")
    found = sorted((box.x_m, box.y_m, box.size_x_m, box.size_y_m) for box in world.obstacles)
    expected = [
        (-1.995, 0, 0.01, 2),
        (0, -0.995, 4, 0.01),
        (0, 0.995, 4, 0.01),
        (1.995, 0, 0.01, 2),
    ]
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize(
    "text, remark",
    [
        (
            'position (name "r0" pose [1 2 0 90] ranger ())',
            "robots are no obstacles: r0 at [1.00, 2.00, 1.57]",
        ),
        (
            "model (obstacle_return 0 ranger_return -1)",
            "1 left out, not touched and not seen in Stage: model",
        ),
        (
            "model (obstacle_return 0 laser_return 0)",
            "1 left out, not touched and not seen in Stage: model",
        ),
        ("model (pose [0 0 1 0])", "1 left out, above the robots of Stage: model"),
        ("r2d2 (pose [0 0 0 0])", "1 left out, r2d2, a type that no file defines: r2d2"),
        ('include "no.inc"', "1 left out, <include> that is not found: no.inc"),
        ('plan (bitmap "no.png")', "1 left out, bitmap no.png that is not found: plan"),
        ('plan (bitmap "a.world")', "a.world: is not a PGM, PNG, BMP, GIF or JPEG image: plan"),
        ('plan (bitmap "white.png")', "1 left out, bitmap white.png without dark pixels: plan"),
        ("model (\nsize [1 x ])", "a.world: line 2: 'x', expected"),
        ('model (size ["a" 1])', "line 1: size: 'a 1', expected numbers up to 100000: model"),
        ("model (block (points 2 point[0] [0 0]))", "block: expected three points or more: model"),
    ],
)
def test_what_is_left_out_has_a_line(tmp_path, text, remark):
    bitmap(tmp_path, "..", name="white.png")
    try:
        told = read(tmp_path, text).remarks
    except InputError as error:
        told = error.problems
    assert remark in told[0]


@pytest.mark.parametrize(
    "text, problem",
    [
        ("model (\npose [1 2", "the end: ')', expected a number or a string"),
        ("model (", "line 1: model, expected ')' after its properties"),
        ("model ())\n", "line 1: ')', expected '(' before it"),
        ("model\n(name fred)", "line 2: 'fred'"),
        ("\nmodel (size {1})", "line 2: '{', expected a world of Gazebo (XML) or of Stage"),
        ("define a (size [1 1])", "line 1: expected 'define', a name, a type and '('"),
        ('include "a.world"', "more than 4194304 characters or 100 included files"),
        ("define a a () a ()", "more than 20000 entities or 50 inside each other"),
    ],
)
def test_faults_have_a_line(tmp_path, text, problem):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert problem in str(caught.value)


def test_types_that_multiply_come_to_an_end(tmp_path):
    types = "".join(f"define t{k + 1} model (t{k} () t{k} ())\n" for k in range(40))
    with pytest.raises(InputError, match="more than 20000 entities"):
        read(tmp_path, f"define t0 model ()\n{types} t40 ()")


def test_a_world_of_stage_is_known_by_its_contents(tmp_path):
    """The bitmap is one folder up, as in ROS packages; walls of the scene are 2 m high."""
    (tmp_path / "maps").mkdir()
    (tmp_path / "worlds").mkdir()
    bitmap(tmp_path / "maps", "###", "#.#", "###", name="a.bmp")
    text = '# Stage\nfloorplan (size [9 9 0.5] bitmap "../maps/a.bmp")'
    scene = load_scene(world_of(tmp_path / "worlds", text))
    assert (scene.origin_x_m, scene.end_y_m) == (-4.5, 4.5)
    assert scene.surface_distance_m(0.0, 0.0, 1.0) == pytest.approx(1.5)
    assert {box.height_m for box in scene.obstacles} == {2.0}
    assert all(isinstance(box, Box) for box in scene.obstacles)
