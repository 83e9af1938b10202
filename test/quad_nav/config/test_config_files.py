"""YAML files: namespaces, the robot's number, and errors."""

from __future__ import annotations

import pytest

from quad_nav.config import load, load_files
from quad_nav.config.files import PlacedFile
from quad_nav.errors import InputError

FILES = {
    "costmap_common_params": (
        "robot_radius: 0.35\nbase_scan: {topic: scan$(arg i), marking: true}\n"
    ),
    "local_costmap_params": "local_costmap:\n  width: 3.0\n  robot_radius: 0.2\n",
    "global_costmap_params": "global_costmap: {width: 12.0}\n",
    "base_local_planner_params": "TrajectoryPlannerROS: {max_vel_x: 0.3}\n",
}


@pytest.fixture
def folder(tmp_path):
    for stem, text in FILES.items():
        (tmp_path / f"{stem}.yaml").write_text(text)
    return tmp_path


def problems(*arguments):
    with pytest.raises(InputError) as caught:
        load_files(*arguments)
    return caught.value.problems


def test_common_goes_into_both_costmaps_and_the_own_file_wins(folder):
    scan = {"topic": "scan7", "marking": True}
    assert load_files(folder, {"i": "7"}) == {
        "global_costmap": {"robot_radius": 0.35, "width": 12.0, "base_scan": scan},
        "local_costmap": {"robot_radius": 0.2, "width": 3.0, "base_scan": scan},
        "TrajectoryPlannerROS": {"max_vel_x": 0.3},
    }


def test_move_base_file_the_robots_own_on_top_and_sets_numbered_by_hand(folder):
    (folder / "move_base_params.yaml").write_text("controller_frequency: 5.0\n")
    (folder / "local_costmap_params2.yaml").write_text("local_costmap: {width: 4.0}\n")
    (folder / "robot1.yaml").write_text(
        "controller_frequency: 9.0\nlocal_costmap: {base_scan: {marking: false}}\n"
    )
    one, two = (load_files(folder, {"i": number}) for number in "12")
    assert (one["controller_frequency"], two["controller_frequency"]) == (9.0, 5.0)
    assert one["local_costmap"]["base_scan"] == {"topic": "scan1", "marking": False}
    assert (one["local_costmap"]["width"], two["local_costmap"]["width"]) == (3.0, 4.0)


def test_list_of_files_in_the_order_given(folder):
    (folder / "other.yaml").write_text("local_costmap/width: 9.0\n")
    names = ["local_costmap_params.yaml", "other.yaml"]
    assert load_files([folder / name for name in names])["local_costmap"]["width"] == 9.0
    assert load_files([folder / name for name in names[::-1]])["local_costmap"]["width"] == 3.0


def test_values_remember_their_file_and_line(folder):
    path = folder / "local_costmap_params.yaml"
    path.write_text("local_costmap:\n  width: three\n")
    with pytest.raises(InputError) as caught:
        load(load_files(folder, {"i": "0"}), "/move_base0")
    assert caught.value.problems == [
        f"/move_base0/local_costmap/width ({path}:2): 'three' is not a number; expected a positive"
        " number of metres"
    ]


def test_every_missing_file_is_named(tmp_path):
    (tmp_path / "global_costmap_params.yaml").write_text("")
    assert problems(tmp_path, {"i": "0"}) == [
        f"{tmp_path}: missing {stem}.yaml or {stem}0.yaml"
        for stem in ("costmap_common_params", "local_costmap_params", "base_local_planner_params")
    ]
    assert problems(tmp_path / "nowhere") == [
        f"{tmp_path / 'nowhere'}: no such folder; expected a folder with costmap_common_params.yaml"
    ]


def test_every_broken_file_is_named_with_its_line(folder):
    broken = {
        "costmap_common": ("a:\n\tb: 1\n", "2:1: not YAML: "),  # a tab
        "local_costmap": ("local_costmap:\n  width: [1\n", "3:1: not YAML: "),
        "global_costmap": ("- 1\n", "1: not a mapping; expected names of parameters with values"),
        "base_local_planner": (
            "# $(arg i)\na: $(find quad)\n",
            "2: unknown $(find quad); expected $(arg i)",
        ),
    }
    for stem, (text, _) in broken.items():
        (folder / f"{stem}_params.yaml").write_text(text)
    told = sorted(problems(folder, {"i": "0"}))
    for line, (stem, (_, fault)) in zip(told, sorted(broken.items())):
        assert line.startswith(f"{folder}/{stem}_params.yaml:{fault}")


def test_key_that_is_set_twice_has_its_last_value_and_a_remark(folder):
    path = folder / "local_costmap_params.yaml"
    path.write_text("local_costmap:\n  width: 3.0\n  height: 3.0\n  width: 5.0\n")
    tree = load_files(folder, {"i": "0"})
    assert tree["local_costmap"]["width"] == 5.0
    assert [str(remark) for remark in load(tree, "").remarks if "twice" in remark.text] == [
        f"local_costmap/width ({path}:4): set twice; YAML uses the last value"
    ]


def test_empty_file_sets_nothing(folder):
    (folder / "base_local_planner_params.yaml").write_text("# nothing yet\n")
    assert "TrajectoryPlannerROS" not in load_files(folder, {"i": "0"})


def test_anchors_and_merge_keys(folder):
    (folder / "base_local_planner_params.yaml").write_text(
        "x: &fast {max_vel_x: 0.5, min_vel_x: 0.1}\n"
        "TrajectoryPlannerROS: {<<: *fast, max_vel_x: 0.7}\n"
    )
    tree = load_files(folder, {"i": "0"})
    assert tree["TrajectoryPlannerROS"] == {"max_vel_x": 0.7, "min_vel_x": 0.1}
    assert tree.remarks == []  # a merge key's value under an own one is no duplicate


def test_costmaps_own_files_may_leave_the_namespace_to_roslaunch(tmp_path):
    texts = {
        "costmap_common.yaml": "width: 1.0\nheight: 2.0\n",
        "costmap_local.yaml": "width: 3.0\n",
        "global_costmap_params.yaml": "width: 4.0\n",
        "planner.yaml": "width: 5.0\n",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    placed = PlacedFile(tmp_path / "planner.yaml", ("TrajectoryPlannerROS",))
    tree = load_files([*(tmp_path / name for name in texts), placed])
    assert tree == {
        "local_costmap": {"width": 3.0, "height": 2.0},
        "global_costmap": {"width": 4.0, "height": 2.0},
        "width": 5.0,
        "TrajectoryPlannerROS": {"width": 5.0},
    }
    assert tree.origins["local_costmap/width"] == f"{tmp_path / 'costmap_local.yaml'}:1"


def test_dump_of_a_parameter_server(tmp_path):
    (tmp_path / "dump.yaml").write_text(
        "move_base0:\n  controller_frequency: 1.0\nmove_base1:\n  controller_frequency: 2.0\n"
        "rosversion: '1.15'\n"
    )
    trees = [load_files([tmp_path / "dump.yaml"], {"i": number}) for number in "01"]
    assert trees == [{"controller_frequency": 1.0}, {"controller_frequency": 2.0}]
    assert trees[1].origins == {"controller_frequency": f"{tmp_path / 'dump.yaml'}:4"}
