"""The command with which roslaunch loads a robot's parameters."""

import shutil

import pytest
import yaml

from quad_nav import config
from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.scenario.robot_parameters import COLLECT, FAULTS, main
from quad_nav.scenario.scenario import read_configurations


@pytest.fixture
def folder(tmp_path):
    shutil.copytree(shipped("config", "default"), tmp_path / "config")
    return tmp_path / "config"


def printed(capsys, *arguments):
    assert main(list(map(str, arguments))) == 0
    return yaml.safe_load(capsys.readouterr().out)


@pytest.mark.parametrize("name", ["default", "tutorial", "barn"])
def test_both_shells_fly_with_the_same_parameters(name, capsys):
    tree = printed(capsys, "--config", name, "--robot", 1, "--robots", 2)
    offline = read_configurations(name, 2, numbered=True)[1]
    assert config.load(tree).to_tree() == offline.to_tree()
    assert offline.global_costmap.robot_base_frame == "base_link1"


def test_a_robots_own_file_and_the_override_are_on_top(folder, tmp_path, capsys):
    (folder / "robot1.yaml").write_text("controller_frequency: 5.0\nplanner_frequency: 2.0\n")
    override = tmp_path / "own.yaml"
    override.write_text("planner_frequency: 3.0\nlocal_costmap: {global_frame: odom$(arg i)}\n")
    tree = printed(capsys, "--config", folder, "--robot", 1, "--override", override)
    assert (tree["controller_frequency"], tree["planner_frequency"]) == (5.0, 3.0)
    assert tree["local_costmap"]["global_frame"] == "odom1"
    assert "robots" not in tree


def test_files_may_have_the_number_of_their_robot(folder, capsys):
    for path in list(folder.glob("*_params.yaml")):
        path.rename(path.with_name(path.stem + "1.yaml"))
    tree = printed(capsys, "--config", folder, "--robot", 1)
    assert tree["global_costmap"]["robot_base_frame"] == "base_link1"
    assert main(["--config", str(folder), "--robot", "0"]) == 2


def test_every_file_with_a_fault_is_named(folder, tmp_path, capsys, monkeypatch):
    (folder / "local_costmap_params.yaml").write_text("a: [")
    (folder / "move_base_params.yaml").write_text("a: $(arg j)")
    arguments = ["--config", str(folder), "--robot", "0", "--override", str(tmp_path / "none")]
    assert main(arguments) == 2
    errors = capsys.readouterr().err.splitlines()
    assert errors[0] == "quad0: invalid configuration:"
    assert len(errors) == 4
    assert errors[2] == (
        f"  {folder}/move_base_params.yaml:1: unknown $(arg j); expected $(arg i), "
        "or a value: add :j=VALUE after the name of the folder"
    )
    monkeypatch.setenv(COLLECT, "1")
    assert [f"  {line}" for line in printed(capsys, *arguments)[FAULTS]] == errors[1:]


def test_an_unknown_name_of_the_configuration_package_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'lod'"):
        _ = config.lod
    with pytest.raises(InputError):
        config.load({"controller_frequency": -1.0})
