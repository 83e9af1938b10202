"""Map files: maps come back cell for cell, and a scene's map has its walls."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from quad_localization import start
from quad_localization.map_files import read_map, save_map
from quad_nav.costmap.static import StaticMap
from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec
from quad_nav.scenario.random_mission import random_mission
from quad_nav.scenario.scene_map import scene_map

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


RANDOM = {"robots": 3, "seed": 7, "size": 14.0}


def test_amcl_begins_where_the_simulator_starts(capsys):
    options = [f"--{name}={value}" for name, value in RANDOM.items()]
    assert start.main(["--scene", "random", *options]) == 0
    expected = random_mission(3, 7, 14.0).scene.starts
    found = yaml.safe_load(capsys.readouterr().out)
    assert [Pose2D(*found[f"quad{k}"]) for k in range(3)] == list(expected)


@pytest.mark.parametrize(
    "faulty", [["--scene", "no file"], ["--robots", "-3"], ["--seed", "-1"], ["--size", "nan"]]
)
def test_amcl_has_no_start_where_the_simulator_tells_a_fault(faulty, capsys):
    assert start.main(["--scene", "random", "--robots", "3", *faulty]) == 0
    assert yaml.safe_load(capsys.readouterr().out) == {}


def test_map_server_draws_the_random_mission_s_scene():
    pytest.importorskip("quad.msg", reason="needs ROS and `make workspace`")
    from ros.fake_ros import FakePublisher, FakeRos

    from quad_localization.ros.map_server import MapServer

    with FakeRos("/map_server") as ros:
        ros._parameters.update({f"~{name}": value for name, value in RANDOM.items()})
        MapServer(Path("random"), 0.1, "map")
        grid = FakePublisher.all["/map"].last
        expected = scene_map(random_mission(3, 7, 14.0).scene, 0.1).occupancy
        assert list(grid.data) == expected.ravel().tolist()
        ros._parameters["~robots"] = 0
        with pytest.raises(InputError, match="map_server: robots: is 0; expected a whole number"):
            MapServer(Path("random"), 0.1, "map")
