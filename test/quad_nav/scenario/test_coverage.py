"""The global costmap covers the scene, unless the user sets its size."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from quad_nav import config
from quad_nav.config.files import ParameterTree, set_value
from quad_nav.config.robot_tree import COMMAND_LINE, RobotSource, robot_tree
from quad_nav.errors import InputError
from quad_nav.scenario.coverage import cover_area, robots_text, size_line
from quad_nav.scenario.fleet_setup import read_setup as read_fleet
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.scenario.robot_parameters import main

SCENE = "{{size: {size}, origin: {origin}, starts: [[{x}, {y}]]}}\n"


@pytest.fixture
def world(tmp_path):
    """Write a scene and a goal in its far corner; returns both paths."""

    def write(size, origin=(0.0, 0.0)):
        scene, goals = tmp_path / "scene.yaml", tmp_path / "goals"
        goals.mkdir(exist_ok=True)
        x, y = (low + 1.0 for low in origin)
        scene.write_text(SCENE.format(size=list(size), origin=list(origin), x=x, y=y))
        goal = [low + length - 1.0 for low, length in zip(origin, size)]
        (goals / "quad0_goals.json").write_text(json.dumps({"goals": [goal]}))
        return scene, goals

    return write


def place(costmap):
    return costmap.origin_x_m, costmap.origin_y_m, costmap.width_m, costmap.height_m


def flown(scene, goals, **more):
    setup = read_setup(FlightOptions(scene, goals, **more))
    return place(setup.configurations[0].global_costmap), setup.warnings


def tree_of(**costmap):
    tree = ParameterTree()
    for key, value in costmap.items():
        set_value(tree, f"global_costmap/{key}", value, "folder/global_costmap_params.yaml:3")
    return tree


@pytest.mark.parametrize(
    "size, origin",
    [((14.0, 14.0), (0.0, 0.0)), ((20.0, 16.0), (-10.0, -8.0)), ((3.02, 30.01), (-5.0, 2.5))],
)
def test_both_shells_cover_the_scene(world, capsys, size, origin):
    scene, goals = world(size, origin)
    expected, notes = flown(scene, goals)
    x, y, width, height = expected
    assert x <= origin[0] + 0.05 and y <= origin[1] + 0.05
    assert x + width >= origin[0] + size[0] - 0.05 and y + height >= origin[1] + size[1] - 0.05
    note = [line for line in notes if "global_costmap covers the scene" in line]
    assert len(note) == 1 and note[0].startswith("quad0: global_costmap covers the scene, x ")
    assert main(["--config", "default", "--robot", "0", "--scene", str(scene)]) == 0
    tree = yaml.safe_load(capsys.readouterr().out)
    assert place(config.load(tree).global_costmap) == expected
    assert tree["size_from_scene"] is True
    fleet = read_fleet({"config": "default", "robots": 1, "scene": str(scene)}, "fleet")
    assert place(fleet.configurations[0].global_costmap) == expected


def test_sizes_are_those_of_the_scene_in_whole_metres(world):
    assert flown(*world((14.0, 12.5)))[0] == (0.0, 0.0, 14.0, 13.0)
    assert flown(*world((13.98, 20.02), (-7.0, -10.01)))[0] == (-7.0, -10.01, 14.0, 21.0)


def test_a_costmap_that_covers_the_scene_stays(world):
    assert flown(*world((9.0, 12.04))) == ((0.0, 0.0, 12.0, 12.0), ())


@pytest.mark.parametrize("key, value", [("width", 13.0), ("origin_x", -1.0)])
def test_an_axis_that_the_user_sets_stays(key, value):
    tree = tree_of(width=12.0, height=12.0, origin_x=0.0, origin_y=0.0)
    set_value(tree, f"global_costmap/{key}", value, COMMAND_LINE)
    cover_area(tree, (-3.0, -4.0, 20.0, 20.0), 0)
    costmap = {"width": 12.0, "origin_x": 0.0, "height": 24.0, "origin_y": -4.0, key: value}
    assert tree["global_costmap"] == costmap


@pytest.mark.parametrize("name", ["robot0.yaml", "mine.yaml"])
def test_a_size_in_the_users_files_stays(tmp_path, name):
    folder = tmp_path / "config"
    folder.mkdir()
    for stem in ("costmap_common", "local_costmap", "global_costmap", "base_local_planner"):
        (folder / f"{stem}_params.yaml").write_text("{}")
    own = folder / name
    own.write_text("global_costmap: {width: 13.0, height: 13.0}\n")
    override = None if name == "robot0.yaml" else own
    tree = robot_tree(RobotSource(str(folder), 0, override=override))
    cover_area(tree, (-3.0, -4.0, 20.0, 20.0), 0, override)
    costmap = tree["global_costmap"]
    assert (costmap["width"], costmap["height"]) == (13.0, 13.0)
    assert not {"origin_x", "origin_y"} & set(costmap)


@pytest.mark.parametrize(
    "costmap",
    [
        {"rolling_window": True},
        {"static_map": True},
        {"plugins": [{"name": "s", "type": "costmap_2d::StaticLayer"}]},
        {"width": "wide"},
        {"resolution": 0.0},
    ],
)
def test_costmaps_without_a_fixed_size_and_faulty_ones_stay(costmap):
    tree = tree_of(**costmap)
    cover_area(tree, (-3.0, -4.0, 20.0, 20.0), 0)
    assert tree == {"global_costmap": costmap}


def test_plugins_decide_about_the_map():
    layers = [{"name": "o", "type": "costmap_2d::ObstacleLayer"}]
    tree = tree_of(plugins=layers, static_map=True)
    cover_area(tree, (0.0, 0.0, 20.0, 10.0), 0)
    assert tree["global_costmap"]["width"] == 20.0
    assert "height" not in tree["global_costmap"]  # 10 by default


@pytest.mark.parametrize("size", [(14.0, 14.0), (400.0, 30.0), (10_000.0, 10_000.0)])
def test_the_line_of_a_refusal_works(world, size):
    """Also for a scene that takes too much memory at the configuration's resolution."""
    scene, goals = world(size, (-2.0, 3.0))
    own = (("global_costmap/width", 5.0), ("global_costmap/height", 5.0))
    with pytest.raises(InputError) as refused:
        flown(scene, goals, parameters=own)
    off, line = refused.value.problems
    assert f"({size[0] - 3:g}, {size[1] + 2:g}) is off the global costmap, x 0 to 5 m" in off
    words = line[line.index("--set") :].split()
    assert set(words[::2]) == {"--set"}
    pairs = [word.split("=") for word in words[1::2]]
    parameters = tuple((path, float(value)) for path, value in pairs)
    (x, y, width, height), _ = flown(scene, goals, parameters=parameters)
    assert (x, y) == (-2.0, 3.0) and width >= size[0] and height >= size[1]


def test_too_large_a_scene_is_refused_with_the_reason(world):
    scene, goals = world((10_000.0, 10_000.0))
    with pytest.raises(InputError) as refused:
        flown(scene, goals)
    assert "with cells of 0.05 m a costmap of the scene takes more than 1 GB" in str(refused.value)


def test_the_line_for_a_file_is_yaml():
    line = size_line((-1.0, 2.5, 10.0, 12.52), 0.05, in_a_file=True)
    size = {"width": 11, "height": 11, "origin_x": -1, "origin_y": 2.5}
    assert yaml.safe_load(line) == {"global_costmap": size}


@pytest.mark.parametrize("resolution_m", [0.01, 0.03, 0.05, 0.1, 0.7])
def test_whole_metres_survive_the_division_by_the_resolution(resolution_m):
    """A costmap has ``int(width / resolution)`` cells."""
    for tenths in range(1, 400, 7):
        tree = tree_of(width=0.0, height=0.0, resolution=resolution_m)
        cover_area(tree, (0.0, 0.0, 10 + tenths / 10, 11.0), 0)
        width_m = tree["global_costmap"]["width"]
        assert width_m == int(width_m) <= 11 + tenths / 10 + resolution_m
        assert int(width_m / resolution_m) * resolution_m >= 10 + tenths / 10 - 1e-6


def test_robots_are_named_in_runs():
    assert robots_text([0, 1]) == "quad0, quad1"
    assert robots_text([0, 2, 3, 4, 9]) == "quad0, quad2 to quad4, quad9"


def test_scenes_are_read_without_the_engine(world):
    scene, _ = world((14.0, 14.0))
    code = (
        "import sys; from quad_nav.scenario.robot_parameters import main;"
        f"main(['--config', 'default', '--robot', '0', '--scene', {str(scene)!r}]);"
        "sys.exit(bool({'numba', 'pybullet', 'scipy'} & set(sys.modules)))"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(config.__file__).parents[2])}
    run = subprocess.run([sys.executable, "-c", code], env=environment, check=False)
    assert run.returncode == 0


def test_a_faulty_scene_ends_roslaunch_with_its_faults(tmp_path, capsys, monkeypatch):
    scene = tmp_path / "scene.yaml"
    scene.write_text("size: [1]")
    arguments = ["--config", "default", "--robot", "0", "--scene", str(scene)]
    assert main(arguments) == 2
    assert f"{scene}: size: a list of 1, expected a list of 2" in capsys.readouterr().err
    monkeypatch.setenv("QUAD_COLLECT_FAULTS", "1")  # the simulator lists them
    assert main(arguments) == 0


def test_goals_that_nobody_gave_are_explained(tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text("size: [5, 5]\nstarts: [[1, 1], [4, 4]]\n")
    with pytest.raises(InputError) as refused:
        read_setup(FlightOptions(scene, None))
    assert refused.value.problems[-1].startswith("goals: not given, so that the goals of the tut")
    assert "outside the arena" in refused.value.problems[0]
