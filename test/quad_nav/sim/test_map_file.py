"""``map_server`` maps: how pixels are read, exact covers, and the scene they make."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from quad_nav.errors import InputError
from quad_nav.files.document import read_yaml
from quad_nav.geometry import Pose2D
from quad_nav.sim.map_file import load_map, rectangles_of
from quad_nav.sim.scene_file import load_scene

YAML = {
    "image": "m.pgm",
    "resolution": 0.5,
    "origin": [0.0, 0.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}


def written(folder: Path, pixels, name: str = "m.pgm", **changes) -> Path:
    """A map's YAML, with its image from an array or from bytes."""
    if isinstance(pixels, bytes):
        (folder / name).write_bytes(pixels)
    else:
        Image.fromarray(np.asarray(pixels, np.uint8)).save(folder / name)
    fields = {**YAML, "image": name, **changes}
    path = folder / "map.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in fields.items()))
    return path


def cells(folder: Path, pixels, **changes) -> list:
    path = written(folder, pixels, **changes)
    return load_map(read_yaml(path), path).occupancy.tolist()


def faults(folder: Path, pixels=((0,),), **changes) -> list:
    with pytest.raises(InputError) as caught:
        load_scene(written(folder, pixels, **changes))
    return [problem.replace(f"{folder}/", "") for problem in caught.value.problems]


SCALE = {"mode": "scale", "free_thresh": 0.2, "occupied_thresh": 0.6}
PNG = {"name": "m.png"}
CLEAR, OPAQUE, GREY, CLEAR_GREY = [0] * 4, [0, 0, 0, 255], [150, 150, 150, 255], [150, 150, 150, 0]


@pytest.mark.parametrize(
    "pixels, given, expected",
    [
        # The image's last row comes first. 0 is 1.0, 89 is 0.651, 90 is 0.647, 205 is 0.1961.
        ([[0, 254, 205], [89, 90, 206]], {}, [[100, -1, 0], [100, 0, -1]]),
        ([[0, 255, 100]], {"negate": 1}, [[0, 100, -1]]),
        # 1 + 98 * (p - 0.2) / 0.4 with p 0.4 at 153 and 0.2 at 204.
        ([[0, 153, 204, 255]], SCALE, [[100, 50, 1, 0]]),
        # Transparent pixels between the thresholds of scale are unknown.
        (
            [[CLEAR, GREY, CLEAR_GREY]],
            {"name": "m.png", "mode": "scale", "free_thresh": 0.0, "occupied_thresh": 0.9},
            [[100, 45, -1]],
        ),
        # Trinary counts alpha: black and opaque is 255 / 4, a share of 0.75 of black.
        ([[OPAQUE, CLEAR]], {"name": "m.png", "occupied_thresh": 0.8}, [[-1, 100]]),
        ([[0, 99, 100, 254, 255]], {"mode": "raw"}, [[0, 99, 100, 100, -1]]),
        ([[0, 155, 156, 255]], {"mode": "raw", "negate": 1}, [[-1, 100, 99, 0]]),
        # Raw leaves alpha out of the mean, which loses its fraction: 298 / 3 is 99.33.
        ([[[99, 99, 100, 0], [99, 99, 102, 9]]], {"name": "m.png", "mode": "raw"}, [[99, 100]]),
        # Grey with alpha is loaded as RGBA: (3 * 100 + 255) / 4 is 138.75, and (3 * 205 + 255) / 4
        # is 217.5, a share of 0.147 of black; without alpha 205 would be unknown.
        ([[[0, 255], [100, 255], [205, 255], [205, 0]]], PNG, [[100, -1, 0, -1]]),
        ([[[0, 0], [153, 0], [153, 1]]], {"name": "m.png", **SCALE}, [[100, -1, 50]]),
        # The last channel decides on transparency, of RGB the blue one. The mean is 100 in both:
        # 1 + 98 * (155 / 255 - 0.2) / 0.7 is 58.1.
        (
            [[[150, 150, 0], [149, 150, 1]]],
            {"name": "m.png", "mode": "scale", "free_thresh": 0.2, "occupied_thresh": 0.9},
            [[-1, 58]],
        ),
        ([[0, 153, 255]], {**SCALE, "negate": 1, "occupied_thresh": 0.8}, [[0, 66, 100]]),
    ],
)
def test_pixels_are_read_as_by_map_server(tmp_path, pixels, given, expected):
    assert cells(tmp_path, pixels, **given) == expected


def test_intermediate_values_of_scale_are_no_obstacles(tmp_path):
    path = written(tmp_path, [[0, 153, 204, 255]], **SCALE)
    occupied = load_map(read_yaml(path), path).occupied(unknown_too=True)
    assert occupied.tolist() == [[True, False, False, False]]


def test_plain_pgm_colour_and_16_bit_png(tmp_path):
    assert cells(tmp_path, b"P2\n# drawn by hand\n3 1\n255\n0 205 254\n") == [[100, -1, 0]]
    assert cells(tmp_path, b"P5 2 1 15\n\x00\x0f") == [[100, 0]]
    assert cells(tmp_path, [[[0, 0, 0], [255, 255, 255], [0, 255, 255]]], name="m.png") == [
        [100, 0, -1]
    ]
    Image.fromarray(np.array([[0, 65000]], np.uint16)).save(tmp_path / "deep.png")
    assert cells(tmp_path, (tmp_path / "deep.png").read_bytes(), name="m.png") == [[100, 0]]


@pytest.mark.parametrize("ramp, remarks", [(False, 1), (True, 0)])
def test_the_colours_of_a_palette_count(tmp_path, ramp, remarks):
    """map_server would take the numbers 0, 1 and 2 of the colours for black."""
    grey = np.array([[0, 205, 254]], np.uint8)
    image = Image.fromarray(grey if ramp else np.array([[0, 1, 2]], np.uint8)).convert("P")
    if not ramp:
        image.putpalette([0, 0, 0, 205, 205, 205, 254, 254, 254])
    image.save(tmp_path / "palette.png")
    path = written(tmp_path, (tmp_path / "palette.png").read_bytes(), "m.png")
    read = load_map(read_yaml(path), path)
    assert (read.occupancy.tolist(), len(read.remarks)) == ([[100, -1, 0]], remarks)


@pytest.mark.parametrize(
    "drawing, count",
    [
        ("....", 0),
        ("#..#", 2),
        ("#### .##. .##.", 2),  # a wide top and the block below it
        (".#. ### .#.", 3),
        (".### .### .### ####", 2),  # higher than wide: the block, then the foot
        ("##.. ##.. ..## ..##", 2),
    ],
)
def test_covers_are_small(drawing, count):
    marked = np.array([[c == "#" for c in row] for row in drawing.split()])
    assert len(rectangles_of(marked)) == count


@pytest.mark.parametrize("density", [0.0, 0.1, 0.5, 0.9, 1.0])
def test_covers_are_exact_and_disjoint(density, monkeypatch):
    monkeypatch.setattr("quad_nav.sim.map_file._RECTANGLES_AT_ONCE", 7)
    marked = np.random.default_rng(1).random((37, 53)) < density
    times = np.zeros(marked.shape, int)
    for column, row, width, height in rectangles_of(marked):
        times[row : row + height, column : column + width] += 1
    assert (times == marked).all()


def test_boxes_stand_over_their_cells(tmp_path):
    scene = load_scene(written(tmp_path, np.full((20, 30), 254), origin=[-5.0, -2.0, 0.0]))
    assert scene.obstacles == ()
    pixels = np.full((20, 30), 254)
    pixels[17:19, 4:10] = 0  # rows 1 and 2 from below
    scene = load_scene(written(tmp_path, pixels, origin=[-5.0, -2.0, 0.0]))
    (box,) = scene.obstacles
    assert (box.name, box.x_m, box.y_m) == ("map_0", -1.5, -1.0)
    assert (box.size_x_m, box.size_y_m, box.height_m, box.bottom_m) == (3.0, 1.0, 2.0, 0.0)
    assert (scene.origin_x_m, scene.origin_y_m, scene.end_x_m, scene.end_y_m) == (-5, -2, 10, 8)


def test_a_rotated_map(tmp_path):
    """A quarter turn takes the image's right to +y and its upper edge to -x."""
    pixels = np.full((20, 30), 254)
    pixels[18:, :4] = 0
    scene = load_scene(written(tmp_path, pixels, origin=[1.0, 2.0, math.pi / 2]))
    (box,) = scene.obstacles
    assert (box.x_m, box.y_m) == pytest.approx((0.5, 3.0))
    assert (box.size_x_m, box.size_y_m, box.yaw_rad) == (2.0, 1.0, math.pi / 2)
    assert (scene.origin_x_m, scene.origin_y_m) == pytest.approx((-9.0, 2.0))
    assert (scene.end_x_m, scene.end_y_m) == pytest.approx((1.0, 17.0))


def test_unknown_cells_are_free_or_occupied(tmp_path):
    pixels = np.full((20, 20), 254)
    pixels[:10] = 205
    written(tmp_path, pixels)
    assert load_scene(tmp_path / "map.yaml").obstacles == ()
    path = tmp_path / "scene.yaml"
    path.write_text(
        "map: map.yaml\nunknown: occupied\nwalls: {height: 3.0}\naltitude: 1.5\n"
        "starts: [[2.0, 2.0, 1.0]]\n"
        "obstacles: [{shape: sphere, centre: [5, 2], radius: 0.5, bottom: 1}]\n"
    )
    scene = load_scene(path)
    upper, ball = scene.obstacles
    assert (upper.y_m, upper.size_x_m, upper.size_y_m, upper.height_m) == (7.5, 10.0, 5.0, 3.0)
    assert (ball.z_m, scene.altitude_m, scene.starts) == (1.5, 1.5, (Pose2D(2.0, 2.0, 1.0),))
    assert scene.remarks == ()


def test_starts_are_chosen_where_the_map_is_known_to_be_free(tmp_path):
    pixels = np.full((20, 40), 205)
    pixels[:, 25:] = 254  # x from 12.5 to 20; the arena's centre is (10, 5)
    scene = load_scene(written(tmp_path, pixels))
    assert scene.starts[0] == Pose2D(12.5, 5.0)
    assert len(scene.starts) == 8 and all(start.x_m >= 12.5 for start in scene.starts)
    for k, start in enumerate(scene.starts):
        assert scene.surface_distance_m(start.x_m, start.y_m, 1.0) >= 0.6
        assert all(start.distance_to(other) >= 2.0 for other in scene.starts[:k])


def test_a_map_without_free_starts_is_refused(tmp_path):
    assert faults(tmp_path, np.zeros((20, 20))) == [
        "map.yaml: starts: missing, and no free position was found in an arena of "
        "10 x 10 m; expected a scene file with world or map, origin and size of a larger "
        "arena, or starts"
    ]


def test_all_faults_of_the_yaml_are_listed(tmp_path):
    assert faults(
        tmp_path, resolution=-1, origin=[0, 0], negate=2, occupied_thresh=0.1, mode="grey"
    ) == [
        "map.yaml: resolution: -1, expected a number above 0",
        "map.yaml: origin: a list of 2, expected a list of 3 numbers",
        "map.yaml: negate: 2, expected 0 or 1",
        "map.yaml: free_thresh: 0.196 is above occupied_thresh, 0.1",
        "map.yaml: mode: 'grey', expected trinary, scale, raw",
    ]


@pytest.mark.parametrize(
    "pixels, problem",
    [
        (b"GIF89a", "m.pgm: is not a PGM or PNG image"),
        (b"P5 4 4 255\n12", "m.pgm: cannot be read: "),
        (b"P5 12000 10000 255\n", "m.pgm: is 12000 x 10000 pixels, expected 1 to 1e+08 pixels"),
        (b"P5 8771 8771 65535\n", "m.pgm: 8771 x 8771 pixels"),
        (b"P5 100000 100000 255\n", "m.pgm: cannot be read: Image size (10000000000 pixels)"),
    ],
)
def test_bad_images(tmp_path, pixels, problem):
    (fault,) = faults(tmp_path, pixels)
    assert fault.startswith(problem)


def test_the_image_of_another_machine_is_looked_for_beside_the_yaml(tmp_path):
    path = written(tmp_path, np.full((20, 20), 254))
    path.write_text(path.read_text().replace("m.pgm", "/home/somebody/maps/m.pgm"))
    assert load_scene(path).remarks[0] == (
        f"{path}: image: /home/somebody/maps/m.pgm is not here, {tmp_path / 'm.pgm'} is used"
    )


def test_numbers_are_those_of_map_server_s_parser(tmp_path):
    fields = written(tmp_path, np.full((20, 20), 254), resolution="5e-1", origin="[-5E0, 2e+0, 0]")
    scene = load_scene(fields)
    assert (scene.origin_x_m, scene.origin_y_m, scene.size_x_m) == (-5.0, 2.0, 10.0)


def test_keys_that_map_server_ignores_are_remarked(tmp_path):
    path = written(tmp_path, np.full((20, 20), 254), unknown_thresh=0.5)
    assert load_scene(path).remarks[0] == (
        f"{path}: unknown_thresh: ignored, map_server has no such key"
    )


@pytest.mark.parametrize(
    "scene, problem",
    [
        ("map: map.yaml\nworld: a.world\n", "map: given together with world, expected one of them"),
        ("map: map.yaml\norigin: [1, 1]\n", "size: missing, expected a list of 2 numbers"),
        ("map: map.yaml\nsize: [1, 1]\n", "origin: missing, expected a list of 2 numbers"),
        ("map: map.yaml\nunknown: maybe\n", "unknown: 'maybe', expected free or occupied"),
        (
            "size: [4, 4]\nstarts: [[2, 2]]\nunknown: free\n",
            "unknown: given without a map, expected the key map too",
        ),
    ],
)
def test_faults_of_a_scene_around_a_map(tmp_path, scene, problem):
    written(tmp_path, np.full((20, 20), 254))
    path = tmp_path / "s.yaml"
    path.write_text(scene)
    with pytest.raises(InputError) as caught:
        load_scene(path)
    assert caught.value.problems == [f"{path}: {problem}"]
