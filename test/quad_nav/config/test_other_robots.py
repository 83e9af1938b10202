"""Configurations of other robots: frames, topics, sensors and body of a quadcopter."""

from __future__ import annotations

import pytest
import yaml

from quad_nav.config import load
from quad_nav.config.files import load_files
from quad_nav.config.other_robots import input_faults
from quad_nav.config.robot_tree import RobotSource, fitted, robot_tree
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.errors import InputError
from quad_nav.scenario import robot_parameters
from quad_nav.scenario.flight_setup import FlightOptions, read_setup

DWA = "dwa_local_planner/DWAPlannerROS"
TRAJECTORY = "base_local_planner/TrajectoryPlannerROS"
ROBOT = """\
footprint: [[-0.2, -0.3], [-0.2, 0.3], [0.5, 0.3], [0.5, -0.3]]
global_costmap:
  global_frame: /map
  robot_base_frame: base_footprint
  static_map: true
local_costmap:
  global_frame: robot/odom_combined
  robot_base_frame: base_footprint
  rolling_window: true
  plugins:
    - {name: lasers, type: "costmap_2d::ObstacleLayer"}
    - {name: inflation, type: "costmap_2d::InflationLayer"}
  lasers:
    observation_sources: front bump rear camera
    front: {data_type: LaserScan, sensor_frame: front_laser, topic: front/scan, clearing: true,
            min_obstacle_height: 0.05, max_obstacle_height: 0.4}
    rear: {data_type: LaserScan, topic: rear/scan, clearing: true}
    bump: {data_type: PointCloud2, topic: bumper}
    camera: {data_type: PointCloud, topic: points}
"""


def tree_of(tmp_path, text):
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    return load_files([path])


@pytest.fixture
def robot(tmp_path):
    return tree_of(tmp_path, ROBOT)


def lines(tree):
    return {remark.place: f"{remark.kind}: {remark.text}" for remark in tree.remarks}


def test_frames_topics_and_sensors_of_a_quadcopter(robot):
    tree = fitted(robot, 3)
    local = load(tree).local_costmap
    assert (local.global_frame, local.robot_base_frame) == ("odom3", "base_link3")
    assert load(tree).global_costmap.global_frame == "map"
    (source,) = dict(local.layers)["lasers"].sources
    assert (source.name, source.topic, source.sensor_frame) == ("front", "/scan3", "Lidar3")
    assert (source.min_obstacle_height_m, source.max_obstacle_height_m) == (0.3, 2.0)
    assert list(input_faults(load(tree).costmaps, 3)) == []


def test_one_line_for_each_kind_of_change(robot):
    assert [f"{one.place}: {one.kind}: {one.text}" for one in fitted(robot, 3).remarks] == [
        "frames: caution: /map: tf2 refuses the leading slash, move_base in C++ does not run with"
        " it",
        "frames: mapped: base_footprint is base_link{i}, robot/odom_combined is odom{i},"
        " front_laser is Lidar{i}",
        "topics: mapped: front/scan is /scan{i}",
        "sensors: left out: bump (PointCloud2), camera (PointCloud): left out, a quadcopter has"
        " none",
        "sensors: left out: rear: left out, the one LIDAR sees all around",
        "heights: mapped: min_obstacle_height, max_obstacle_height: raised to the LIDAR of a"
        " flying robot",
        "body_radius: mapped: the simulated body is a disc of 0.2 m radius, which fits into the"
        " robot's footprint; set body_radius for another",
    ]
    assert fitted(robot, 0).remarks == fitted(robot, 12).remarks
    assert not [one for one in load(fitted(robot, 0)).remarks if "looks like a source" in one.text]


def test_a_navigator_under_ros_logs_the_same_lines(tmp_path, capsys):
    (tmp_path / "robot.yaml").write_text(ROBOT)
    config = str(tmp_path / "robot.yaml")
    assert robot_parameters.main(["--config", config, "--robot", "1", "--robots", "2"]) == 0
    on_the_server = yaml.safe_load(capsys.readouterr().out)
    told = [remark.text for remark in load(on_the_server, "/move_base1").remarks]
    offline = robot_tree(RobotSource(config, 1, 2)).remarks
    assert [remark.text for remark in offline if remark.kind != "caution"] == told[
        : len(offline) - 1
    ]
    assert load(on_the_server).body_radius_m == 0.2


def test_a_configuration_of_quadcopters_stays_as_it_is():
    for name in ("default", "tutorial", "barn"):
        tree = robot_tree(RobotSource(name, 1))
        assert fitted(tree, 1) is tree
        assert "body_radius" not in tree and lines(tree) == {}


def test_odometry_of_another_robot_is_that_of_the_quadcopter(robot):
    robot["DWAPlannerROS"] = {"odom_topic": "odometry/filtered"}
    tree = fitted(robot, 3)
    assert tree["DWAPlannerROS"]["odom_topic"] == "/odom3"
    assert any("odometry/filtered is /odom{i}" in remark.text for remark in tree.remarks)


def test_frames_of_another_quadcopter_are_a_fault(robot):
    robot["global_costmap"]["global_frame"] = "odom4"
    faults = list(input_faults(load(fitted(robot, 3)).costmaps, 3))
    assert faults == [("global_frame", "odom4; expected map or odom3")]


def test_the_lidar_stands_in_where_no_laser_is_left(tmp_path):
    text = "local_costmap: {observation_sources: cloud sonar, cloud: {data_type: PointCloud2}}"
    tree = fitted(tree_of(tmp_path, text), 0)
    (source,) = dict(load(tree).local_costmap.layers)["obstacle_layer"].sources
    assert (source.name, source.data_type, source.topic) == ("cloud", "LaserScan", "/scan0")
    assert source.marking and source.clearing
    assert lines(tree)["sensors"] == "left out: sonar (PointCloud): left out, a quadcopter has none"
    assert ("mapped", "the LIDAR stands in for cloud") in [
        (remark.kind, remark.text) for remark in tree.remarks
    ]


def test_lasers_that_mark_and_clear_are_both_kept(tmp_path):
    text = """\
local_costmap:
  observation_sources: marks clears
  marks: {data_type: LaserScan, marking: true, clearing: false}
  clears: {data_type: LaserScan, marking: false, clearing: true}
"""
    layers = dict(load(fitted(tree_of(tmp_path, text), 0)).local_costmap.layers)
    assert [one.name for one in layers["obstacle_layer"].sources] == ["marks", "clears"]


def test_layers_with_sources_become_obstacle_layers(tmp_path):
    text = """\
local_costmap:
  plugins:
    - {name: depth, type: "my_costmap::DepthLayer"}
    - {name: map, type: "my_costmap::StaticLayer"}
    - {name: social, type: "my_costmap::SocialLayer"}
  depth: {observation_sources: scan, scan: {data_type: LaserScan}}
  map: {map_topic: /rtabmap/grid}
"""
    tree = fitted(tree_of(tmp_path, text), 0)
    layers = dict(load(tree).local_costmap.layers)
    assert isinstance(layers["depth"], ObstacleLayerParams)
    assert layers["map"].map_topic == "/map" and "social" not in layers
    assert lines(tree)["layers"] == (
        "mapped: my_costmap::DepthLayer is costmap_2d::ObstacleLayer,"
        " my_costmap::StaticLayer is costmap_2d::StaticLayer"
    )


def test_voxels_reach_the_lidar(tmp_path):
    text = """\
local_costmap:
  {map_type: voxel, origin_z: 0.0, z_voxels: 4, z_resolution: 0.1, mark_threshold: 2,
   max_obstacle_height: 0.6, observation_sources: scan, scan: {data_type: LaserScan}}
"""
    layer = dict(load(fitted(tree_of(tmp_path, text), 0)).local_costmap.layers)["obstacle_layer"]
    assert (layer.z_voxels, layer.z_resolution_m, layer.mark_threshold) == (4, 0.5, 0)
    assert layer.max_obstacle_height_m == 2.0


@pytest.mark.parametrize(
    "text, radius_m",
    [
        ("local_costmap: {robot_radius: 0.17}", 0.17),
        ("robot_radius: 0.22", 0.22),
        ("local_costmap: {footprint: '[[0.4, 0.1], [-0.4, 0.1], [-0.4, -0.1], [0.4, -0.1]]'}", 0.1),
        ("local_costmap: {footprint: []}", 0.46),  # move_base's default radius
        ("local_costmap: {robot_radius: 0.001}", 0.05),
        ("{body_radius: 0.4, robot_radius: 0.22}", 0.4),
    ],
)
def test_the_body_fits_into_the_footprint(tmp_path, text, radius_m):
    assert load(fitted(tree_of(tmp_path, text), 0)).body_radius_m == pytest.approx(radius_m)


@pytest.mark.parametrize(
    "planners, chosen, told",
    [
        (["DWAPlannerROS"], DWA, f"mapped: {DWA}, the only one with parameters"),
        (
            ["DWAPlannerROS", TRAJECTORY.split("/")[1]],
            DWA,
            f"; set base_local_planner={TRAJECTORY} for the other",
        ),
        (["TebLocalPlannerROS", TRAJECTORY.split("/")[1]], None, ""),
    ],
)
def test_the_planner_with_parameters_is_flown(tmp_path, planners, chosen, told):
    text = "".join(f"{name}: {{max_vel_x: 0.4}}\n" for name in planners)
    tree = fitted(tree_of(tmp_path, text), 0)
    assert tree.get("base_local_planner") == chosen
    assert lines(tree).get("base_local_planner", "").endswith(told)
    named = tree_of(tmp_path, f"{text}base_local_planner: {TRAJECTORY}")
    assert fitted(named, 0)["base_local_planner"] == TRAJECTORY


def test_a_flight_has_the_robots_body(tmp_path):
    (tmp_path / "robot.yaml").write_text(ROBOT)
    setup = read_setup(
        FlightOptions(None, None, str(tmp_path / "robot.yaml"), robots=2, size_m=12.0)
    )
    assert setup.robot_radius_m == setup.simulation.airframe.radius_m == 0.2
    assert setup.config_name == "robot.yaml"
    assert "sensors: rear: left out, the one LIDAR sees all around" in setup.warnings
    own = read_setup(FlightOptions(None, None, robots=2, size_m=12.0))
    assert own.robot_radius_m == 0.3


def test_a_body_too_large_for_a_goal_is_refused(tmp_path):
    (tmp_path / "robot.yaml").write_text("robot_radius: 1.2")
    (tmp_path / "quad0_goals.json").write_text('{"goals": [[1.0, 6.0]]}')
    with pytest.raises(InputError, match="1.00 m from"):
        read_setup(FlightOptions(None, tmp_path, str(tmp_path / "robot.yaml"), robots=1))
