"""``docs/limits.md`` says what the code does."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from quad_nav import errors
from quad_nav.config import workload
from quad_nav.costmap.layered import CostmapParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.costmap.voxel import VoxelLayerParams
from quad_nav.errors import InputError
from quad_nav.files import document, plain_yaml, values, xml_tree
from quad_nav.mission import goal, goal_file
from quad_nav.recording import bag_trace
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim import (
    imported_scene,
    map_file,
    map_image,
    mesh,
    scene_file,
    stage_file,
    world_file,
)
from quad_nav.topics import flight_info, validation

TABLE = (Path(__file__).parents[2] / "docs" / "limits.md").read_text(encoding="utf-8")
ROWS = {
    "messages about one file": [errors.MAX_PROBLEMS],
    "goal file": [
        goal_file.MAX_BYTES,
        goal_file.MAX_GOALS,
        goal.MAX_COORDINATE_M,
        goal.MAX_TIMEOUT_S,
    ],
    "YAML: scenes, maps, parameters": [
        plain_yaml.MAX_BYTES,
        plain_yaml.MAX_NODES,
        plain_yaml.MAX_LEVELS,
        plain_yaml.MAX_DIGITS,
    ],
    "numbers in a scene": [document.MAX_MAGNITUDE, scene_file.MAX_SIZE_M, document.MAX_TEXT_LENGTH],
    "starts in a scene": [scene_file.MAX_STARTS],
    "starts chosen by `quad`": [imported_scene.MAX_START_CELLS],
    "Gazebo world": [
        xml_tree.MAX_BYTES,
        xml_tree.MAX_ELEMENTS,
        xml_tree.MAX_DEPTH,
        world_file.MAX_BYTES,
        world_file.MAX_INCLUDES,
    ],
    "Stage world": [
        stage_file.MAX_BYTES,
        stage_file.MAX_ENTITIES,
        stage_file.MAX_DEPTH,
        stage_file.MAX_INCLUDES,
    ],
    "mesh": [
        mesh.MAX_BYTES,
        world_file.MAX_MESH_BYTES,
        mesh.CELL_M,
        mesh.MAX_CELL_M,
        mesh.MAX_BOXES,
    ],
    "models, links and collisions": [world_file.MAX_PARTS, world_file.MAX_OBSTACLES],
    "image of a map": [map_image.MAX_BYTES, map_image.MAX_CELLS, values.MAX_MEMORY_BYTES // 10**9],
    "cells of a map": [map_file.MIN_RESOLUTION_M, map_file.MAX_RESOLUTION_M, map_file.MAX_BOXES],
    "costmap": [values.MAX_MEMORY_BYTES // 10**9, workload.MAX_POINTS],
    "recording that is read": [
        bag_trace.MAX_MEMORY_BYTES / 1e9,
        bag_trace.LONGEST_FLIGHT_S / 86400,
        flight_info.MAX_ROBOTS,
    ],
    "scan": [validation.MAX_BEAMS],
    "point cloud": [validation.MAX_POINTS],
    "odometry, commands, goals": [validation.MAX_MAGNITUDE],
    "intention of a peer": [validation.MAX_POSES],
    "map on a topic": [validation.MAX_CELLS, values.MAX_MEMORY_BYTES // 10**9],
}


def spellings(number):
    return {str(number), f"{number:g}", f"{number:g}".replace("e+0", "e"), f"{number:.0f}"}


def missing_numbers(row, numbers):
    """The numbers that the row of the table does not have."""
    (line,) = [line for line in TABLE.splitlines() if line.startswith(f"| {row} |")]
    words = set(line.replace(",", " ").replace(";", " ").split())
    return [number for number in numbers if not spellings(number) & words]


@pytest.mark.parametrize("row", ROWS)
def test_the_table_has_the_limits_in_force(row):
    assert missing_numbers(row, ROWS[row]) == []


def costmap(side_m, *layers, **fields):
    """A square costmap with cells of 5 cm."""
    named = tuple((str(number), layer) for number, layer in enumerate(layers))
    return CostmapParams(width_m=side_m, height_m=side_m, layers=named, **fields)


@pytest.mark.parametrize(
    "layers, bytes_per_cell, side_m",
    [
        ((), 36, 263.5),  # 5270.46 cells in 1 GB: the square root of 1e9 / 36
        ((StaticLayerParams(),), 39, 253.1),
        ((VoxelLayerParams(z_voxels=10),), 57, 209.4),
        ((StaticLayerParams(), VoxelLayerParams(z_voxels=16)), 72, 186.3),
    ],
)
def test_a_costmap_takes_a_gigabyte_at_most(layers, bytes_per_cell, side_m):
    largest = costmap(side_m, *layers)
    assert largest.bytes_per_cell == bytes_per_cell
    assert workload.size_problem(largest) == ""
    problem = workload.size_problem(costmap(side_m + 0.1, *layers))
    assert f"cells of {bytes_per_cell} bytes each take 1.00" in problem
    assert "larger resolution" in problem


@pytest.mark.parametrize(
    "mode, side", [("L", 10000), ("RGB", 10000), ("LA", 9128), ("RGBA", 9128), ("I", 8770)]
)
def test_an_image_takes_a_gigabyte_at_most(mode, side):
    image = Image.new(mode, (1, 1))
    image._size = (side, side)  # as after reading no more than the head of the file
    map_image._check_size(Path("map.png"), image)
    image._size = (side + 1, side + 1)
    with pytest.raises(InputError, match="of memory; expected 1 GB at most|pixels, expected 1 to"):
        map_image._check_size(Path("map.png"), image)


def test_a_map_on_a_topic_takes_a_gigabyte_at_most():
    params = costmap(10.0, StaticLayerParams())
    assert params.bytes_per_map_cell == 39 + 9
    assert costmap(10.0, StaticLayerParams(), rolling_window=True).bytes_per_map_cell == 3 + 9
    side = 4564  # the square root of 1e9 / 48
    for more in (0, 1):
        cells = (side + more) ** 2
        problem = validation.grid_problem(
            side + more, side + more, 0.05, cells, bytes_per_cell=params.bytes_per_map_cell
        )
        assert problem.startswith(f"{side + 1} x {side + 1} cells of 48 bytes" if more else "")
        assert bool(problem) == bool(more)


def test_a_scene_whose_map_does_not_fit_is_refused_before_it_flies(tmp_path):
    scene = tmp_path / "large.yaml"
    scene.write_text("name: large\nsize: [90000, 90000]\nstarts:\n  - [2.0, 2.0, 0.0]\n")
    (tmp_path / "goals").mkdir()
    (tmp_path / "goals" / "quad0_goals.json").write_text('{"goals": [[3.0, 3.0]]}')
    layers = [{"name": "static", "type": "costmap_2d::StaticLayer"}]
    with pytest.raises(InputError) as raised:
        read_setup(
            FlightOptions(
                scene, tmp_path / "goals", parameters=(("global_costmap/plugins", layers),)
            )
        )
    assert "quad0: global_costmap: 1800004 x 1800004 cells of the scene's map" in str(raised.value)
    assert "expected 1 GB at most (a smaller scene" in str(raised.value)
