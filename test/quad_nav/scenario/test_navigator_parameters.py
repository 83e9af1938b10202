"""The launch files: the form of the tutorial's, and parameters that the nodes complete."""

import re
from xml.etree import ElementTree

import pytest

from quad_nav.config.robot_tree import RobotSource, robot_tree
from quad_nav.files.shipped import shipped
from quad_nav.scenario.navigator_parameters import load_navigator

LAUNCH = shipped("launch")
TWO_QUADS = LAUNCH / "two_quads.launch"
SCENE = "{size: [20.0, 16.0], origin: [-10.0, -8.0], starts: [[0.0, 0.0]]}\n"


@pytest.mark.parametrize("name", ["default", "tutorial", "barn"])
def test_the_launch_file_loads_what_the_folder_has(name):
    for number in (0, 1):
        loaded = robot_tree(RobotSource(f"{TWO_QUADS}:config={name}", number))
        assert loaded.pop("cover_scene") is True
        assert loaded == robot_tree(RobotSource(name, number, 2))


def test_the_groups_differ_in_the_robots_number():
    groups = [group for group in ElementTree.parse(TWO_QUADS).getroot().iter("group")]
    first, second = (
        re.sub(r"\s", "", ElementTree.tostring(group, "unicode"))
        for group in groups
        if group.find("node/remap") is not None
    )
    assert first != second
    assert re.sub(r"(?<=[a-z\"])[0-9]|--robot[0-9]", "#", first) == re.sub(
        r"(?<=[a-z\"])[0-9]|--robot[0-9]", "#", second
    )


def test_the_navigators_package_is_one_attribute():
    users = [
        element.tag + " " + name
        for element in ElementTree.parse(TWO_QUADS).getroot().iter()
        for name, value in element.attrib.items()
        if "$(arg nav)" in value
    ]
    assert users == ["node pkg"] * 2


def test_the_launch_files_have_every_argument_that_documents_name():
    text = "".join(path.read_text() for path in LAUNCH.glob("*.launch"))
    declared = {
        *re.findall(r'<arg name="(\w+)"', text),
        "address",
        "nav3",
    }  # `make fly` has address
    pages = [*shipped("docs").glob("*.md"), shipped("docs").parent / "README.md"]
    for page in pages:
        assert set(re.findall(r"\b([a-z]\w*):=", page.read_text())) - declared == set(), page


def test_a_global_costmap_covers_the_scene_but_for_sizes_of_the_user(tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text(SCENE)
    everything = {"simulator": {"scene": str(scene), "rate": 2.0}}
    tree = {**robot_tree(RobotSource("default", 0)), "cover_scene": True}

    def size(**more):
        costmap = load_navigator({**tree, **more}, "/move_base0", everything).global_costmap
        return costmap.origin_x_m, costmap.width_m, costmap.origin_y_m, costmap.height_m

    assert size() == (-10.0, 20.0, -8.0, 16.0)
    assert size(override={"global_costmap": {"width": 12.0}}) == (0.0, 12.0, -8.0, 16.0)
    assert size(cover_scene=False) == (0.0, 12.0, 0.0, 12.0)
    everything["simulator"]["scene"] = ""
    assert size() == (0.0, 12.0, 0.0, 12.0)
