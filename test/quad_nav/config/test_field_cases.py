"""Configurations of other robots, as their authors lay them out, in ``test/field_cases``."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from quad_nav.cli import main
from quad_nav.config.check import check_source
from quad_nav.config.configuration import load
from quad_nav.config.robot_tree import RobotSource, robot_tree
from quad_nav.config.sources import robot_set
from quad_nav.config.substitution import Substitution, Unresolved
from quad_nav.files.shipped import shipped
from quad_nav.scenario.flight_setup import FlightOptions, read_setup

CASES = Path(__file__).parents[2] / "field_cases"


def tree_of(name, number=0):
    return robot_tree(RobotSource(str(CASES / name), number))


def test_a_folder_with_the_four_names_and_another_file_flies_all_of_them():
    tree = tree_of("standard_folder_dwa")
    assert tree["DWAPlannerROS"]["max_vel_x"] == 0.4
    assert tree["base_local_planner"] == "dwa_local_planner/DWAPlannerROS"


@pytest.mark.parametrize("first", [0, 1])
def test_robot_i_flies_with_the_i_th_namespace_of_a_launch_file(first):
    source = f"ns_launch/two_robot{first}.launch"
    for number in (0, 1):
        lines = [str(one) for one in tree_of(source, number).remarks]
        assert any(
            f"robot {number} flies with robot{first + number}/move_base" in one for one in lines
        )
    chosen = [str(one) for one in tree_of(f"{source}:robot1").remarks]
    assert not any("flies with" in one for one in chosen)


def test_every_navigator_of_a_launch_file_is_checked():
    result = CliRunner().invoke(main, ["check", str(CASES / "ns_launch" / "two_robot0.launch")])
    assert result.exit_code == 0
    assert "robot0/move_base: no errors" in result.output
    assert "robot1/move_base: no errors" in result.output


def test_a_launch_file_has_no_navigator_of_this_name():
    result = CliRunner().invoke(main, ["check", f"{CASES}/ns_launch/two_robot0.launch:robot7"])
    assert result.exit_code == 2
    assert "expected one named robot7" in result.output


def test_folders_with_numbers_belong_to_robots(tmp_path):
    for number in (1, 2):
        folder = tmp_path / f"rb_{number}"
        folder.mkdir()
        (folder / "costmap_common_params.yaml").write_text("robot_radius: 0.2\n")
        (folder / "planner.yaml").write_text(f"DWAPlannerROS: {{max_vel_x: 0.{number}}}\n")
    folders = [robot_set(str(tmp_path), number).folder.name for number in ("0", "1")]
    assert folders == ["rb_1", "rb_2"]


# As resolve_args of roslaunch 1.16 resolves them with the package's folder for {}.
@pytest.mark.parametrize(
    "text, resolved",
    [
        ("$(find my_pkg)params/a.yaml", "{}/params/a.yaml"),
        ("$(find my_pkg)$(arg x)", "{}/params/a.yaml"),
        ("$(find my_pkg)/$(arg x)", "{}/params/a.yaml"),
        ("$(find my_pkg) b", "{} b"),
        ("a $(find my_pkg)params", "a {}/params"),
        ("$(find my_pkg).yaml", "{}/.yaml"),
        ("$( arg x )", "params/a.yaml"),
        ("$(dirname)/a", "{}/a"),
        ("$(optenv NOT_SET a  b)", "a b"),
        ("$(eval find('my_pkg') + 'params')", "{}params"),
        ("$(eval 2 * 3 - 1)", "5"),
        ("$(eval 1/2)", "0.5"),
        ("$(eval -3 % 2)", "1"),
        ("$(eval 1 < 2 < 3)", "True"),
        ("$(eval n + 1)", "4"),
        ("$(eval sqrt(16))", "4.0"),
        ("$(eval pi)", "3.141592653589793"),
        ("$(eval x[0] + x[-1])", "pl"),
        ("$(eval arg('x').startswith('p'))", "True"),
        ("$(eval n == 4 or x)", "params/a.yaml"),
        ("$(eval not true)", "False"),
        ("$(eval max(n, round(5.6)))", "6"),
    ],
)
def test_substitutions_are_those_of_roslaunch(text, resolved):
    package = CASES / "find_no_slash" / "my_pkg"
    words = Substitution(package / "move.launch", {"x": "params/a.yaml", "n": "3"})
    assert words.text(text) == resolved.format(package)


@pytest.mark.parametrize("text", ["'a' * 9", "[1] * 9", "2 ** 9", "x.format(1)", "x['a']", "x[99]"])
def test_expressions_that_could_take_all_memory_or_have_no_value_are_refused(text):
    words = Substitution(CASES / "move.launch", {"x": "params/a.yaml"})
    with pytest.raises(Unresolved):
        words.text(f"$(eval {text})")


def test_a_launch_file_without_a_slash_after_find():
    assert tree_of("find_no_slash/my_pkg/move.launch")["local_costmap"]["robot_radius"] > 0.0


def test_the_value_of_an_argument_in_yaml(monkeypatch):
    monkeypatch.chdir(CASES)
    result = CliRunner().invoke(main, ["check", "arg_in_yaml"])
    assert "add :scan_topic=VALUE" in " ".join(result.output.split())
    assert CliRunner().invoke(main, ["check", "arg_in_yaml:scan_topic=scan"]).exit_code == 0


TEB = """\
max_vel_x: 0.4
max_vel_x_backwards: 0.2
max_vel_theta: 0.8
acc_lim_x: 0.5
xy_goal_tolerance: 0.15
footprint_model: {type: circular, radius: 0.2}
"""
EBAND = "{max_vel_lin: 0.6, max_vel_th: 1.5, max_acceleration: 0.3}"


def planner_of(tmp_path, text):
    (tmp_path / "robot.yaml").write_text(text)
    configuration = load(robot_tree(RobotSource(str(tmp_path / "robot.yaml"), 0)))
    return configuration, " ".join(map(str, configuration.remarks))


def test_dwa_flies_with_the_limits_of_a_planner_that_is_not_here(tmp_path):
    lines = TEB.replace("\n", "\n  ").rstrip(" ")
    found, told = planner_of(tmp_path, f"TebLocalPlannerROS:\n  {lines}")
    planner = found.local_planner
    assert (planner.max_vel_x_mps, planner.max_vel_trans_mps) == (0.4, 0.4)
    assert (planner.max_vel_theta_radps, planner.acc_lim_x_mps2) == (0.8, 0.5)
    assert (planner.max_vel_y_mps, planner.min_vel_y_mps, planner.vy_samples) == (0.0, 0.0, 1)
    assert found.local_costmap.robot_radius_m == found.body_radius_m == 0.2
    assert "TebLocalPlannerROS is not here: dwa_local_planner/DWAPlannerROS flies with" in told
    assert "without max_vel_x_backwards, footprint_model" in told


def test_names_of_other_planners_and_ones_own_parameters(tmp_path):
    name = "base_local_planner: eband_local_planner/EBandPlannerROS"
    planner = planner_of(tmp_path, f"{name}\nEBandPlannerROS: {EBAND}")[0].local_planner
    assert (planner.max_vel_x_mps, planner.max_vel_theta_radps) == (0.6, 1.5)
    own = f"{name}\nEBandPlannerROS: {EBAND}\nDWAPlannerROS: {{max_vel_x: 0.2}}"
    assert planner_of(tmp_path, own)[0].local_planner.max_vel_x_mps == 0.2


def cautions_of(source):
    ((report,), _) = check_source(str(source))
    return " ".join(str(one) for one in report.lines if one.kind == "caution")


@pytest.mark.parametrize(
    "case, caution",
    [
        ("inflation_small/cfg", "0.2 m is below the inscribed radius of 0.40 m"),
        ("slow_control/cfg", "a command is flown for 10 s, which is 3.0 m"),
    ],
)
def test_what_may_let_a_robot_touch_something_is_told(case, caution):
    assert caution in cautions_of(CASES / case)


@pytest.mark.parametrize(
    "parameters, caution",
    [
        (
            "local_costmap: {static_map: true, observation_sources: ''}",
            "sees nothing but the map",
        ),
        (
            "TrajectoryPlannerROS: {max_vel_x: 1.0, max_vel_theta: 0.1, holonomic_robot: false}",
            "turns with a radius of 10.0 m",
        ),
        (
            "{base_local_planner: dwa_local_planner/DWAPlannerROS, controller_frequency: 20.0,"
            " DWAPlannerROS: {acc_lim_x: 0.5, acc_lim_theta: 0.5}}",
            "reaches 0.025 m/s and 0.025 rad/s, less than min_vel_trans",
        ),
        ("base_global_planner: carrot_planner/CarrotPlanner", "CarrotPlanner flies straight on"),
    ],
)
def test_cautions_on_planners_and_costmaps(tmp_path, parameters, caution):
    (tmp_path / "robot.yaml").write_text(parameters)
    assert caution in cautions_of(tmp_path / "robot.yaml")


def test_a_footprint_smaller_than_the_body_is_told_at_take_off(tmp_path):
    options = {"config": "default", "parameters": (("local_costmap/robot_radius", 0.2),)}
    setup = read_setup(FlightOptions(None, shipped("goals"), robots=1, **options))
    assert "inscribed radius of 0.20 m, the body 0.3 m" in " ".join(setup.warnings)
