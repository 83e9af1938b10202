"""Names of configurations: folders with alternatives, files, and launch files."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from quad_nav.cli import main
from quad_nav.config.check import check_source
from quad_nav.config.launch_file import load_launch_file
from quad_nav.config.robot_tree import RobotSource, unfitted_tree
from quad_nav.config.sources import config_label, robot_set
from quad_nav.config.substitution import Substitution, Unresolved
from quad_nav.errors import InputError

LAYOUT = {
    "costmap_common_params_big.yaml": "robot_radius: 0.5",
    "costmap_common_params_small.yaml": "robot_radius: 0.1",
    "dwa_params_big.yaml": "DWAPlannerROS: {max_vel_x: 1.0}",
    "dwa_params_small.yaml": "DWAPlannerROS: {max_vel_x: 2.0}",
    "costmap_global_static.yaml": "{global_frame: map, static_map: true}",
    "costmap_global_laser.yaml": "{global_frame: odom, static_map: false, rolling_window: true}",
    "move_base_params.yaml": "controller_frequency: 5.0",
}
LAUNCH = """\
<launch>
  <arg name="model" />
  <arg name="rate" default="4.0" />
  <include file="$(find my_nav)/launch/move.xml.launch" pass_all_args="true" />
</launch>
"""
MOVE = """\
<launch>
  <arg name="model" default="big" />
  <arg name="rate" />
  <group ns="robot" if="$(eval model in ['big', 'small'])">
    <node pkg="move_base" type="move_base" name="move_base">
      <rosparam file="$(find my_nav)/param/common_$(arg model).yaml" ns="local_costmap" />
      <rosparam file="$(find my_nav)/param/common_$(arg model).yaml" ns="global_costmap" />
      <rosparam subst_value="true">
        controller_frequency: $(arg rate)
      </rosparam>
      <param name="base_local_planner" value="dwa_local_planner/DWAPlannerROS" />
      <param name="global_costmap/width" value="30.0" unless="$(arg slim)" />
    </node>
  </group>
</launch>
"""


def write(folder, texts):
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


@pytest.fixture
def package(tmp_path):
    return write(
        tmp_path / "my_nav",
        {
            "package.xml": "<package><name>my_nav</name></package>",
            "launch/nav.launch": LAUNCH,
            "launch/move.xml.launch": MOVE.replace(' unless="$(arg slim)"', ""),
            "param/common_big.yaml": "robot_radius: 0.5",
            "param/common_small.yaml": "robot_radius: 0.1",
        },
    )


def tree(name, number=0):
    return unfitted_tree(RobotSource(str(name), number))


def refusal(name):
    with pytest.raises(InputError) as caught:
        robot_set(str(name), "0")
    return "\n".join(caught.value.problems)


def test_a_flight_needs_a_choice_and_the_refusal_has_it_to_copy(tmp_path):
    write(tmp_path, LAYOUT)
    assert refusal(tmp_path) == (
        f"config: {tmp_path}: 4 configurations; expected one: --config {tmp_path}:big,laser or"
        f" --config {tmp_path}:big,static or --config {tmp_path}:small,laser or --config"
        f" {tmp_path}:small,static"
    )
    assert f"--config {tmp_path}:small,static" in refusal(f"{tmp_path}:small")
    chosen = tree(f"{tmp_path}:small,static")
    assert chosen["local_costmap"] == {"robot_radius": 0.1}
    assert chosen["global_costmap"]["static_map"] is True
    assert chosen["DWAPlannerROS"] == {"max_vel_x": 2.0}
    assert tree(f"{tmp_path}:costmap_global_laser.yaml,small")["global_costmap"]["rolling_window"]
    assert config_label(f"{tmp_path}:small,static") == f"{tmp_path.name}:small,static"


RATES = {"fast": 20.0, "slow": 5.0}


def test_values_of_arguments_in_the_files_of_a_folder(tmp_path):
    write(tmp_path, {"costmap_common_a.yaml": "robot_base_frame: $(arg prefix)base"})
    assert tree(f"{tmp_path}:prefix=my_")["local_costmap"] == {"robot_base_frame": "my_base"}
    assert "unknown $(arg prefix)" in refusal_of_tree(tmp_path)[0]
    rates = {f"move_{name}.yaml": f"controller_frequency: {rate}" for name, rate in RATES.items()}
    write(tmp_path, rates)
    for given in ("slow:prefix=my_", "slow,prefix=my_", "prefix=my_,slow"):
        chosen = tree(f"{tmp_path}:{given}")
        assert chosen["local_costmap"] == {"robot_base_frame": "my_base"}
        assert chosen["controller_frequency"] == RATES["slow"]


def test_unknown_choice_lists_what_there_is(tmp_path):
    write(tmp_path, LAYOUT)
    assert refusal(f"{tmp_path}:medium").endswith(
        "no configuration 'medium'; there are big,laser, big,static, small,laser, small,static"
    )


def test_a_file_that_changes_a_few_parameters_comes_after_the_one_it_changes(tmp_path):
    write(
        tmp_path,
        {
            "planner.yaml": "{controller_frequency: 5.0, planner_frequency: 1.0}",
            "planner_slow.yaml": "{controller_frequency: 2.0}",
        },
    )
    slow = {"controller_frequency": 2.0, "planner_frequency": 1.0}
    assert tree(f"{tmp_path}:planner_slow") == slow


def test_files_that_share_no_parameter_are_all_loaded(tmp_path):
    write(
        tmp_path,
        {
            "costmap_common.yaml": "robot_radius: 0.5",
            "costmap_layers.yaml": "inflation_radius: 0.7",
            "a.yaml": "{controller_frequency: 5.0, planner_patience: 1, robots: 2}",
            "b.yaml": "{controller_frequency: 5.0, NavfnROS: {allow_unknown: true, x: 1, y: 2}}",
        },
    )
    loaded = tree(tmp_path)
    assert loaded["local_costmap"] == {"robot_radius": 0.5, "inflation_radius": 0.7}
    assert loaded["NavfnROS"]["allow_unknown"] is True


def test_a_subfolder_changes_the_folder_above_it(tmp_path):
    write(
        tmp_path,
        {
            "costmap_common.yaml": "{robot_radius: 0.5, inflation_radius: 1.0}",
            "slim/costmap_common.yaml": "robot_radius: 0.2",
            "wide/costmap_common.yaml": "robot_radius: 0.7",
        },
    )
    expected = {"robot_radius": 0.2, "inflation_radius": 1.0}
    assert tree(f"{tmp_path}:slim")["local_costmap"] == expected
    assert tree(tmp_path / "slim")["local_costmap"] == expected
    assert f"{tmp_path}:slim or --config {tmp_path}:wide" in refusal(tmp_path)


def test_one_file_several_files_and_dumps(tmp_path):
    write(
        tmp_path,
        {
            "one.yaml": "robot7: {move_base: {controller_frequency: 3.0}}\nrosdistro: noetic",
            "house.yaml": "width: 4.0",
            "move.yaml": "controller_frequency: 2.0",
        },
    )
    assert tree(tmp_path / "one.yaml") == {"controller_frequency": 3.0}
    several = f"{tmp_path / 'move.yaml'},local_costmap={tmp_path / 'house.yaml'}"
    assert tree(several) == {"controller_frequency": 2.0, "local_costmap": {"width": 4.0}}


def test_launch_file_with_packages_arguments_and_includes(package):
    loaded = tree(f"{package / 'launch' / 'nav.launch'}:model=small,rate:=7.0")
    assert loaded == {
        "local_costmap": {"robot_radius": 0.1},
        "global_costmap": {"robot_radius": 0.1, "width": 30.0},
        "controller_frequency": 7.0,
        "base_local_planner": "dwa_local_planner/DWAPlannerROS",
    }
    assert loaded.origins["local_costmap/robot_radius"] == f"{package}/param/common_small.yaml:1"


def test_what_a_launch_file_leaves_open_is_named(package):
    path = package / "launch" / "move.xml.launch"
    assert refusal_of_tree(path) == [
        f"{path}:8: <rosparam>  not read: $(arg rate) has no value; add rate=VALUE after the file"
        " and :"
    ]
    write(package, {"launch/nav.launch": LAUNCH.replace("my_nav", "no_such_package")})
    assert any(
        "$(find no_such_package): no folder of this name around" in line
        for line in refusal_of_tree(f"{package / 'launch' / 'nav.launch'}:model=big")
    )


def refusal_of_tree(name):
    with pytest.raises(InputError) as caught:
        tree(name)
    return caught.value.problems


@pytest.mark.parametrize(
    "text, expected",
    [
        ("$(arg a)/$(arg b)", "1/two"),
        ("$(eval a == 1 and b != 'x')", "True"),
        ("$(eval 'yes' if arg('a') > 3 else b + '!')", "two!"),
        ("$(eval not (b in ['two']))", "False"),
        ("$(optenv NO_SUCH_VARIABLE a default)", "a default"),
        ("$(anon node)", "node"),
    ],
)
def test_substitutions(tmp_path, text, expected):
    words = Substitution(tmp_path / "x.launch", {"a": "1", "b": "two"})
    assert words.text(text) == expected


def test_substitutions_that_are_not_resolved(tmp_path):
    words = Substitution(tmp_path / "x.launch", {"a": "1"})
    texts = ["$(env NO_SUCH_VARIABLE)", "$(find ../..)", "$(find /etc)", "$(c d)"]
    evils = ["__import__('os').getcwd()", "a.b", "int(1e999)", "(" * 500 + ")" * 500]
    for text in texts + [f"$(eval {evil})" for evil in evils]:
        with pytest.raises(Unresolved):
            words.text(text)


def test_check_and_fly_tell_the_same(tmp_path):
    write(tmp_path, {**LAYOUT, "move_base_params.yaml": "base_local_planner: [1]"})
    source = f"{tmp_path}:small,static"
    checked = CliRunner().invoke(main, ["check", source])
    flown = CliRunner().invoke(main, ["fly", "--config", source])
    assert checked.exit_code == flown.exit_code == 2
    fault = "is not a string; expected a plugin's name"
    assert fault in flown.output
    ((report,), _) = check_source(source)
    assert [fault in line.text for line in report.lines].count(True) == 1


def test_check_lists_what_to_fly(tmp_path):
    write(tmp_path, LAYOUT)
    output = CliRunner().invoke(main, ["check", str(tmp_path)]).output
    assert f"To fly, choose one: --config {tmp_path}:big,laser or " in output.replace("\n", " ")


def test_a_launch_file_with_twelve_nodes_has_one_for_each_robot(tmp_path):
    node = '<node pkg="move_base" type="move_base" name="move_base{i}">{text}</node>'
    param = '<param name="controller_frequency" value="{i}.5" />'
    nodes = "".join(node.format(i=i, text=param.format(i=i)) for i in range(12))
    (tmp_path / "fleet.launch").write_text(f"<launch>{nodes}</launch>")
    for number in (0, 1, 10, 11):
        tree = load_launch_file(tmp_path / "fleet.launch", str(number))
        assert tree["controller_frequency"] == number + 0.5


def test_a_file_name_that_is_too_long_is_a_file_that_is_missing(tmp_path):
    include = f'<include file="{"x" * 5000}" />'
    (tmp_path / "nav.launch").write_text(f"<launch>{include}</launch>")
    with pytest.raises(InputError, match="no such file"):
        load_launch_file(tmp_path / "nav.launch")
