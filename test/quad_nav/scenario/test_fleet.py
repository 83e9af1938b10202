"""A fleet's names, parameters and RViz file: what needs no ROS to be looked at."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.scenario.coverage import scene_bounds
from quad_nav.scenario.fleet_setup import read_setup
from quad_nav.scenario.random_mission import random_mission
from quad_nav.scenario.rules import MAX_ROBOTS
from quad_nav.scenario.scenario import read_configurations, scene_of
from quad_nav.sim.colours import ROBOT_COLOURS
from quad_nav.topics.markers import number_markers, quadcopter_markers
from quad_nav.topics.publishing import in_fleet, own_node
from quad_nav.topics.rviz_file import document

CONFIG = str(shipped("config", "default"))


@pytest.mark.parametrize(
    "name, called",
    [
        ("~local_costmap/costmap", "/move_base7/local_costmap/costmap"),
        ("~", "/move_base7"),
        ("cmd_vel", "/cmd_vel7"),
        ("/scan", "/scan7"),
        ("move_base_simple/goal", "/move_base_simple/goal7"),
        ("move_base", "/move_base7"),
        ("move_base/goal", "/move_base7/goal"),
        ("move_base/recovery_status", "/move_base7/recovery_status"),
        ("scan7", "/scan7"),
        ("/camera/points", "/camera/points"),
        ("map", "/map"),
    ],
)
def test_names_in_a_fleet_are_those_of_the_launch_files_remaps(name, called):
    assert in_fleet(7)(name) == called
    assert own_node(name) == name


def test_the_launch_file_remaps_the_same_names():
    lines = shipped("launch", "quad.launch").read_text().splitlines()
    remaps = [line.split('"') for line in lines if "<remap" in line]
    assert len(remaps) == 12
    for _, name, _, called, _ in remaps:
        assert in_fleet(3)(name) == called.replace("$(arg i)", "3")


def test_hosts_share_the_robots():
    shares = [
        read_setup({"config": CONFIG, "robots": 5, "hosts": 2, "host": host}, "fleet")
        for host in (0, 1)
    ]
    assert [list(share.configurations) for share in shares] == [[0, 2, 4], [1, 3]]
    one = shares[1].configurations[3]
    assert (one.robot, one.robots) == (3, 5)
    assert one.global_costmap.robot_base_frame == "base_link3"


def test_global_costmaps_cover_the_random_arena():
    mission = random_mission(30, 4)
    assert mission.scene == scene_of({"robots": 30, "seed": 4, "size": 0.0, "scene": "random"})
    area = scene_bounds(mission.scene)
    costmap = read_configurations(CONFIG, 30, area)[29].global_costmap
    assert (costmap.width_m, costmap.height_m) == (33.0, 33.0)  # 30 x 36 m2


def test_a_robots_own_file_goes_on_top(tmp_path):
    copy_config(tmp_path)
    (tmp_path / "robot1.yaml").write_text("controller_frequency: 5.0\n")
    made = read_configurations(str(tmp_path), 3, numbered=True)
    assert [one.navigator.controller_frequency_hz for one in made] == [10.0, 5.0, 10.0]


def test_every_fault_is_reported_once_with_its_place(tmp_path):
    copy_config(tmp_path)
    (tmp_path / "move_base_params.yaml").write_text("planner_frequency: never\n")
    (tmp_path / "robot1.yaml").write_text("controller_frequency: often\n")
    with pytest.raises(InputError) as refused:
        read_configurations(str(tmp_path), 3)
    common, own = refused.value.problems
    assert "move_base_params.yaml:1" in common and "robot1.yaml:1" in own


@pytest.mark.parametrize(
    "parameters, fault",
    [
        ({"robots": 101}, "robots: is 101"),
        ({"robots": 2, "hosts": 3}, "expected a robot for each host"),
        ({"hosts": 2, "host": 2}, "expected a robot for each host"),
        ({"seed": -1}, "seed: is -1"),
        ({"robot": 3}, "expected robots"),
    ],
)
def test_parameters_of_a_fleet_are_checked(parameters, fault):
    with pytest.raises(InputError) as refused:
        read_setup({"config": CONFIG, **parameters}, "fleet")
    assert fault in str(refused.value)


def test_rviz_shows_every_quadcopter_in_its_colour():
    displays = document(6, random_mission(6, 0).scene)["Visualization Manager"]["Displays"]
    groups = [one for one in displays if one["Class"] == "rviz/Group"]
    assert [group["Name"] for group in groups] == [f"Quadcopter {i}" for i in range(6)]
    for number, group in enumerate(groups):
        topics = {one["Name"]: one.get("Topic") for one in group["Displays"]}
        assert topics["Scan"] == f"/scan{number}"
        tracked = next(one for one in group["Displays"] if one["Name"] == "Tracked obstacles")
        assert tracked["Marker Topic"] == f"/move_base{number}/moving_obstacles"
        assert topics["Local costmap"] == f"/move_base{number}/local_costmap/costmap"
        assert topics["Particles"] == f"/particlecloud{number}"
        for method in ("amcl", "slam"):
            name = f"Estimate of {method}"
            assert topics[name] == f"/{method}_pose{number}"
            estimate = next(one for one in group["Displays"] if one["Name"] == name)
            ellipse = estimate["Covariance"]["Position"]["Color"]
            assert ellipse == "; ".join(map(str, ROBOT_COLOURS[number]))
        path = next(one for one in group["Displays"] if one["Name"] == "Flown path")
        assert path["Color"] == "; ".join(map(str, ROBOT_COLOURS[number]))


def test_rviz_keeps_all_markers_until_their_frames_are_known():
    scene = random_mission(MAX_ROBOTS, 0).scene
    displays = document(MAX_ROBOTS, scene)["Visualization Manager"]["Displays"]
    markers = len(quadcopter_markers(MAX_ROBOTS) + number_markers(MAX_ROBOTS, scene))
    shown = {one["Name"]: one for one in displays if one["Class"] == "rviz/MarkerArray"}
    assert all(one["Queue Size"] >= markers for one in shown.values()) and "Quadcopters" in shown


def test_rviz_of_many_listens_to_the_overview_only():
    def shown(robots):
        displays = document(robots, random_mission(robots, 0).scene)
        group = displays["Visualization Manager"]["Displays"][-1]
        return {one["Name"] for one in group["Displays"] if one["Enabled"]}

    assert shown(5) == {"Global plan", "Flown path"}
    assert {"Scan", "Global costmap"} <= shown(4)


def test_rviz_numbers_the_tools_of_few_quadcopters():
    def tools(robots):
        tools = document(robots, random_mission(robots, 0).scene)["Visualization Manager"]["Tools"]
        return {one["Class"]: one.get("Topic") for one in tools if one["Class"].startswith("quad/")}

    fleet = {
        "quad/GoalFleet": "/move_base_simple/goal",
        "quad/PoseFleet": "/initialpose",
        "quad/SelectQuadcopter": "/clicked_point",
    }
    assert tools(5) == fleet
    assert tools(3) == {
        **fleet,
        **{f"quad/Goal{i}": f"/move_base_simple/goal{i}" for i in range(3)},
        **{f"quad/Pose{i}": f"/initialpose{i}" for i in range(3)},
        **{f"quad/PointQuad{i}": f"/clicked_point{i}" for i in range(3)},
    }


def test_rviz_finds_a_class_and_an_icon_for_each_tool():
    plugin = ElementTree.parse(shipped("rviz", "tools.xml"))
    classes = {one.get("name") for one in plugin.iter("class")}
    tools = {f"quad/{kind}{i}" for kind in ("Goal", "Pose", "PointQuad") for i in range(4)}
    assert classes == tools | {"quad/GoalFleet", "quad/PoseFleet", "quad/SelectQuadcopter"}
    icons = Path(__file__).resolve().parents[3] / "icons" / "classes"
    assert {f"quad/{path.stem}" for path in icons.glob("*.svg")} == classes


def test_rviz_looks_at_the_middle_of_the_arena():
    view = document(25, random_mission(25, 0).scene)["Visualization Manager"]["Views"]["Current"]
    assert (view["X"], view["Y"], view["Scale"]) == (15.0, 15.0, 25.0)


def copy_config(folder: Path) -> None:
    for path in Path(CONFIG).iterdir():
        (folder / path.name).write_text(path.read_text())
