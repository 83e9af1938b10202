"""Map files: maps come back cell for cell, and a scene's map has its walls."""

from __future__ import annotations

import numpy as np
import pytest

from quad_localization.map_files import read_map, save_map
from quad_nav.costmap.static import StaticMap
from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.grid import GridSpec

CELLS = np.array([[0, 100, -1, 0], [-1, 0, 100, 100], [0, 0, 0, -1]], np.int8)


def test_a_saved_map_comes_back_cell_for_cell(tmp_path):
    grid = StaticMap(CELLS, GridSpec(4, 3, 0.05, -1.25, 0.1 + 0.2), yaw_rad=0.3)
    save_map(grid, tmp_path / "hall")
    found = read_map(tmp_path / "hall.yaml", 1.0)
    assert np.array_equal(found.occupancy, CELLS)
    assert (found.spec, found.yaw_rad) == (grid.spec, 0.3)


def test_a_name_with_a_dot_keeps_it(tmp_path):
    save_map(StaticMap(CELLS, GridSpec(4, 3, 0.05)), tmp_path / "hall.v2")
    assert read_map(tmp_path / "hall.v2.yaml", 1.0).occupancy.shape == (3, 4)


def test_values_between_the_limits_are_saved_as_unknown(tmp_path):
    """map_saver: free up to 25, occupied from 65 on."""
    cells = np.array([[0, 25, 26, 64, 65, 100, -1]], np.int8)
    grid = StaticMap(cells, GridSpec(7, 1, 0.1))
    save_map(grid, tmp_path / "map")
    found = read_map(tmp_path / "map.yaml", 1.0).occupancy
    assert found.tolist() == [[0, 0, -1, -1, 100, 100, -1]]
    save_map(grid, tmp_path / "map", 26, 10)
    assert read_map(tmp_path / "map.yaml", 1.0).occupancy.tolist() == [
        [0, -1, 100, 100, 100, 100, -1]
    ]


def test_the_map_of_a_scene_is_drawn_at_its_altitude(tmp_path):
    """A room of 2 m by 1 m with walls of 0.1 m; a table is lower than the flight."""
    scene = tmp_path / "room.yaml"
    scene.write_text(
        "size: [2.0, 1.0]\naltitude: 1.0\nwalls: {height: 2.0, thickness: 0.1}\nobstacles:\n"
        "  - {shape: box, centre: [0.5, 0.5], size: [0.2, 0.2], height: 0.5}\n"
        "  - {shape: box, centre: [1.5, 0.5], size: [0.2, 0.2], height: 1.5}\n"
        "starts: [[1.0, 0.5, 0.0]]\n"
    )
    grid = read_map(scene, 0.1)
    assert grid.occupancy.shape == (12, 22)
    assert (grid.spec.origin_x_m, grid.spec.origin_y_m) == pytest.approx((-0.1, -0.1))
    inner = grid.occupancy[1:-1, 1:-1]
    assert np.argwhere(inner).tolist() == [[4, 14], [4, 15], [5, 14], [5, 15]]
    assert grid.occupancy[0].min() == grid.occupancy[:, 0].min() == 100


def test_the_shipped_arena_survives_a_save(tmp_path):
    grid = read_map(shipped("scenes", "arena.yaml"), 0.05)
    save_map(grid, tmp_path / "arena")
    assert np.array_equal(read_map(tmp_path / "arena.yaml", 1.0).occupancy, grid.occupancy)


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file/map: .*expected a place for a map"):
        save_map(StaticMap(CELLS, GridSpec(4, 3, 0.05)), tmp_path / "file" / "map")
