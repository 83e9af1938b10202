"""Tuned values in move_base's files: what changes, and that nothing else does."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from quad_nav import config
from quad_nav.config.files import set_value
from quad_tune.parameter_files import Change, FilesDiffer, base_value, write_parameters
from quad_tune.space import costmap_paths
from quad_tune.yaml_edit import inserted, replaced, value_text

ROOT = Path(__file__).resolve().parents[2]
TEXT = """\
# heading
planner:
  speed: 0.3        # an old reason that
                    # goes on
  # a remark about turns
  turns: {max: 1.0, min: -1.0}  # both
  frames: [a, b]
top: Lidar$(arg i)
"""
CHANGES = (
    Change("TrajectoryPlannerROS/occdist_scale", 0.02, "n"),
    Change("TrajectoryPlannerROS/sim_time", 2.0, "n"),
    Change("*_costmap/inflation_radius", 0.7, "n"),
    Change("*_costmap/base_scan/obstacle_range", 3.0, "n"),
    Change("global_costmap/update_frequency", 2.0, "n"),
    Change("controller_frequency", 20.0, "n"),
    Change("planner_frequency", 2.0, "n"),
    Change("peers/margin", 0.1, "n"),
)


def test_a_value_and_its_remark_are_replaced_and_nothing_else():
    assert replaced(TEXT, ["planner", "speed"], 0.5, "new") == TEXT.replace(
        "speed: 0.3        # an old reason that\n                    # goes on", "speed: 0.5  # new"
    )
    assert replaced(TEXT, ["top"], "x", "new") == TEXT.replace("Lidar$(arg i)", "x  # new")
    assert replaced(TEXT, ["planner", "turns", "max"], 2, "new") == TEXT.replace("1.0,", "2,")
    assert replaced(TEXT, ["planner", "frames"], "c", "new") == TEXT.replace("[a, b]", "c  # new")


def test_a_remark_of_several_lines_goes_also_when_the_value_gets_longer():
    assert replaced("a: 1  # long\n      # goes on\nb: 2\n", ["a"], 0.0125, "new") == (
        "a: 0.0125  # new\nb: 2\n"
    )


def test_what_is_not_there_is_not_replaced():
    assert replaced(TEXT, ["planner", "sped"], 0.5, "new") is None
    assert replaced(TEXT, ["planner"], 0.5, "new") is None
    assert replaced("", ["planner"], 0.5, "new") is None


def test_a_new_value_is_the_last_of_its_namespace():
    assert inserted(TEXT, ["planner", "x"], True, "new") == TEXT.replace(
        "[a, b]\n", "[a, b]\n  x: true  # new\n"
    )
    assert inserted(TEXT, ["planner", "turns", "z"], 3, "new") == TEXT.replace("{max", "{z: 3, max")
    assert inserted(TEXT, ["a", "b"], 1, "new") == TEXT + "a:\n  b: 1  # new\n"
    assert inserted("", ["a"], 1, "new") == "a: 1  # new\n"
    assert inserted("# only a remark", ["a"], 1, "new") == "# only a remark\na: 1  # new\n"
    assert inserted("a: 1  # long\n      # goes on\n", ["b"], 2, "new") == (
        "a: 1  # long\n      # goes on\nb: 2  # new\n"
    )


@pytest.mark.parametrize(
    "value, expected",
    [(0.0003, "0.0003"), (1e-05, "1.0e-05"), (True, "true"), (7, "7"), ("a: b", "'a: b'")],
)
def test_values_are_written_as_yaml_reads_them(value, expected):
    assert value_text(value) == expected


@pytest.mark.parametrize("name", ["default", "tutorial", "barn"])
def test_the_files_load_as_the_base_with_the_changes(name, tmp_path):
    base = ROOT / "config" / name
    write_parameters(base, tmp_path / "tuned", CHANGES)
    assert sorted(path.name for path in (tmp_path / "tuned").iterdir()) == sorted(
        path.name for path in base.glob("*.yaml")
    )
    tree = config.load_files(base, {"i": "1"})
    for change in CHANGES:
        first, _, rest = change.path.partition("/")
        for path in (
            [f"global_costmap/{rest}", f"local_costmap/{rest}"]
            if first == "*_costmap"
            else [change.path]
        ):
            set_value(tree, path, change.value, "test")
    written = config.load(config.load_files(tmp_path / "tuned", {"i": "1"}))
    assert written.to_tree() == config.load(tree).to_tree()


def test_only_lines_of_changed_parameters_differ(tmp_path):
    base = ROOT / "config" / "tutorial"
    write_parameters(base, tmp_path, [Change("TrajectoryPlannerROS/max_vel_x", 0.25, "why")])
    before = (base / "base_local_planner_params.yaml").read_text()
    after = (tmp_path / "base_local_planner_params.yaml").read_text()
    assert after == before.replace("max_vel_x: 0.3", "max_vel_x: 0.25  # why")
    for path in base.glob("costmap*.yaml"):
        assert (tmp_path / path.name).read_text() == path.read_text()


def test_numbered_files_and_a_robots_own_are_changed_too(tmp_path):
    base = tmp_path / "base"
    shutil.copytree(ROOT / "config" / "tutorial", base)
    for number in "01":
        shutil.copy(
            base / "costmap_common_params.yaml", base / f"costmap_common_params{number}.yaml"
        )
    (base / "costmap_common_params.yaml").unlink()
    (base / "robot1.yaml").write_text("local_costmap: {inflation_radius: 0.9}\n")
    write_parameters(base, tmp_path / "tuned", [Change("*_costmap/inflation_radius", 0.5, "why")])
    for robot in "01":
        tree = config.load_files(tmp_path / "tuned", {"i": robot})
        assert tree["local_costmap"]["inflation_radius"] == 0.5
        assert tree["global_costmap"]["inflation_radius"] == 0.5


def test_files_that_cannot_be_edited_are_not_half_written(tmp_path):
    base = tmp_path / "base"
    shutil.copytree(ROOT / "config" / "tutorial", base)
    path = base / "move_base_params.yaml"
    path.write_text(
        "".join(
            f"/move_base0:\n  {line}" if k == 0 else f"  {line}"
            for k, line in enumerate(
                ["conservative_reset_dist: 1.0\n", "controller_frequency: 1.0\n"]
            )
        )
    )
    with pytest.raises(FilesDiffer, match="controller_frequency"):
        write_parameters(base, tmp_path / "tuned", [Change("controller_frequency", 5.0, "why")])
    assert not (tmp_path / "tuned").exists()


def test_the_bases_own_value_is_found_where_a_layer_has_it():
    tree = config.load(config.load_files(ROOT / "config" / "tutorial", {"i": "0"})).to_tree()
    assert base_value(tree, "TrajectoryPlannerROS/max_vel_x") == 0.3
    assert base_value(tree, "*_costmap/inflation_radius") == 0.4
    assert base_value(tree, "*_costmap/cost_scaling_factor") == 10.0  # the original's default
    assert base_value(tree, "*_costmap/base_scan/obstacle_range") == 2.0
    assert base_value(tree, "planner_frequency") == 0.0
    assert base_value(tree, "no/such") is None


@pytest.mark.parametrize("name", ["barn", "default"])
def test_shipped_parameters_are_those_of_their_study(name):
    folder = ROOT / "config" / name
    tree = config.load_files(folder, {"i": "0"})
    rows = re.findall(
        r"^\| (\S+) +\| (\S+) +\| (\S+) +\| \S.*\|$",
        (folder / "STUDY.md").read_text().partition("## Effect of each change")[2],
        re.M,
    )
    found = {path: value for path, _, value in rows if path != "parameter"}
    assert len(found) >= 6
    for path, value in found.items():
        for place in costmap_paths(path):
            here = tree
            for key in place.split("/"):
                here = here[key]
            assert value_text(here) == value, place
    remarks = "".join(file.read_text() for file in folder.glob("*.yaml"))
    assert remarks.count("# tuned, was ") == len(found)
