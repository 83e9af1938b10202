"""Launch files that are only read: how much, from where, and what of it is recorded."""

from __future__ import annotations

import json
import os

import pytest

from quad_nav import config
from quad_nav.config.differences import differences
from quad_nav.config.files import ParameterTree, load_files, set_value
from quad_nav.config.launch_file import load_launch_file
from quad_nav.config.substitution import MAX_ELEMENTS, MAX_TEXT, Shared, Substitution, Unresolved
from quad_nav.errors import InputError
from quad_nav.files.user_files import limit_memory
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.topics.flight_info import mission_info

NODE = '<node pkg="move_base" type="move_base" name="move_base">{}</node>'
MEMORY_BYTES = 500_000_000


def launch(path, content):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"<launch>{content}</launch>")
    return path


def refusal(path):
    with limit_memory(MEMORY_BYTES), pytest.raises(InputError) as caught:
        load_launch_file(path)
    return "\n".join(caught.value.problems)


def doubled(times, word):
    args = "".join(f'<arg name="a{k + 1}" value="{word.format(k)}" />' for k in range(times))
    return f'<arg name="a0" value="abcdefghij" />{args}'


def test_arguments_that_double_forty_times_are_refused(tmp_path):
    words = doubled(40, "$(arg a{0})$(arg a{0})") + NODE.format("")
    assert f"more than {MAX_TEXT} characters" in refusal(launch(tmp_path / "x.launch", words))


def test_expressions_that_double_forty_times_are_not_read(tmp_path):
    words = doubled(40, "$(eval a{0} + '' + a{0})")
    path = launch(tmp_path / "x.launch", words + NODE.format('<param name="a" value="1" />'))
    with limit_memory(MEMORY_BYTES):
        tree = load_launch_file(path)
    assert tree == {"a": 1}
    # 10 characters doubled 7 times are 1280.
    assert "<arg> a8 not read" in tree.remarks[0].text
    assert "an argument of more than 1000 characters" in tree.remarks[0].text


def test_a_text_with_many_long_arguments_is_refused(tmp_path):
    text = f"a: {'$(arg a10) ' * 100_000}"  # of 10240 characters each: 1 GB
    words = doubled(10, "$(arg a{0})$(arg a{0})")
    words += NODE.format(f'<rosparam subst_value="true">{text}</rosparam>')
    assert f"more than {MAX_TEXT} characters" in refusal(launch(tmp_path / "x.launch", words))


@pytest.mark.parametrize(
    "content",
    [
        pytest.param('<include file="{me}" /><include file="{me}" />', id="itself-twice"),
        pytest.param(f'<include file="{{me}}" />{"<a/>" * 15_000}', id="elements"),
        pytest.param(f'<include file="{{me}}" /><!--{"x" * 3_000_000}-->', id="comment"),
        pytest.param(f'{"<group>" * 90}<include file="{{me}}" />{"</group>" * 90}', id="groups"),
        pytest.param(f"{'<a/>' * 900_000}", id="one-file"),
    ],
)
def test_a_launch_file_without_end_is_refused(tmp_path, content):
    path = tmp_path / "x.launch"
    problem = refusal(launch(path, content.format(me=path)))
    limits = (
        f"{MAX_TEXT} characters",
        f"{MAX_ELEMENTS} elements",
        "100 elements inside each other",
    )
    assert any(f"more than {limit}" in problem for limit in limits)


def test_a_chain_of_files_counts_as_one(tmp_path):
    for k in range(20):
        content = f'<include file="{tmp_path}/{k + 1}.launch" />{"<a/>" * 1000}'
        launch(tmp_path / f"{k}.launch", content)
    launch(tmp_path / "20.launch", NODE.format('<param name="a" value="1" />'))
    assert load_launch_file(tmp_path / "1.launch") == {"a": 1}  # 19 * 1002 + 3 elements
    assert f"more than {MAX_ELEMENTS} elements" in refusal(tmp_path / "0.launch")


def test_files_of_parameters_count_each_time(tmp_path):
    (tmp_path / "x.yaml").write_text(f"a: 1\n#{' ' * (MAX_TEXT // 2)}")
    name = f'<rosparam file="{tmp_path}/x.yaml" />'
    problem = refusal(launch(tmp_path / "x.launch", NODE.format(name * 2)))
    assert f"more than {MAX_TEXT} characters" in problem


def test_a_long_namespace_above_many_parameters_is_refused(tmp_path):
    params = "".join(f'<param name="move_base/a{k}" value="1" />' for k in range(15_000))
    path = launch(tmp_path / "x.launch", f'<group ns="{"x" * 1_000_000}">{params}</group>')
    assert "expected 200 characters at most" in refusal(path)


def test_a_long_name_above_many_values_of_yaml_is_refused(tmp_path):
    values = ", ".join(f"a{k}: 1" for k in range(2_000))
    (tmp_path / "x.yaml").write_text(f"? {'x' * 500_000}\n: {{{values}}}")
    with limit_memory(MEMORY_BYTES), pytest.raises(InputError, match="not the name of a parameter"):
        load_files([tmp_path / "x.yaml"])


def test_parentheses_that_never_close_are_looked_at_once(tmp_path):
    (tmp_path / "x.yaml").write_text(f"a: 1 # {'$(' * 200_000}")
    assert load_files([tmp_path / "x.yaml"]) == {"a": 1}


@pytest.mark.parametrize(
    "text",
    [
        f"$(eval {'1+' * 100_000}1)",
        "$(eval digits + 1)",
        "$(eval int(digits))",
        f"$(eval int({'+'.join(['hundred'] * 100)}))",
    ],
)
def test_expressions_that_take_long_are_not_resolved(text):
    words = {"digits": "9" * 10**6, "hundred": "x" + "9" * 99}
    with pytest.raises(Unresolved):
        Substitution("x.launch", words, Shared(text_left=10**9)).text(text)


@pytest.fixture
def secret(tmp_path):
    (tmp_path / "secret.yaml").write_text("a: {b: 1}\nkey: hidden8")
    (tmp_path / "secret.launch").write_text("<launch><hidden8></launch>")
    return tmp_path


@pytest.mark.parametrize(
    "name",
    [
        "{0}/secret.yaml",
        "$(dirname)/../secret.yaml",
        "$(dirname)/link.yaml",
        "$(dirname)/below/secret.yaml",
        "$(find secrets)/secret.yaml",
        "$(env HIDDEN_FOLDER)/secret.yaml",
        "$(find etc)/passwd",
    ],
)
def test_a_launch_file_names_no_parameters_of_other_folders(secret, monkeypatch, name):
    monkeypatch.setenv("HIDDEN_FOLDER", str(secret))
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{secret}:/")
    (secret / "secrets").symlink_to(secret)
    path = launch(
        secret / "mission" / "x.launch",
        NODE.format(f'<rosparam file="{name.format(secret)}" ns="global_costmap" />'),
    )
    (path.parent / "link.yaml").symlink_to(secret / "secret.yaml")
    (path.parent / "below").symlink_to(secret)
    problem = refusal(path)
    assert f"leads out of {path.parent}, to " in problem
    assert "hidden8" not in problem


def test_a_launch_file_includes_none_of_other_folders(secret):
    path = launch(secret / "mission" / "x.launch", '<include file="$(dirname)/../secret.launch" />')
    assert "leads out of" in refusal(path)  # and not "mismatched", as a file that is read would be


def test_files_of_packages_of_folders_that_are_allowed_and_that_the_user_gives(
    tmp_path, monkeypatch
):
    names = ("$(find arms)/a.yaml", "$(arg b)", f"{tmp_path}/maps/c.yaml", "$(dirname)/../d/d.yaml")
    content = "".join(f'<rosparam file="{name}" />' for name in names)
    path = launch(
        tmp_path / "legs" / "launch" / "x.launch", f'<arg name="b" />{NODE.format(content)}'
    )
    for number, name in enumerate(("arms/a.yaml", "mine/b.yaml", "maps/c.yaml", "legs/d/d.yaml")):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(f"{name[-6]}: {number}")
    for package in ("arms", "legs"):
        (tmp_path / package / "package.xml").write_text(
            f"<package><name>{package}</name></package>"
        )
    monkeypatch.setenv("QUAD_FILES_PATH", str(tmp_path / "maps"))
    given = [("b", str(tmp_path / "mine" / "b.yaml"))]
    assert load_launch_file(path, arguments=given) == {"a": 0, "b": 1, "c": 2, "d": 3}


def test_files_are_relative_to_the_folder_in_which_one_types(tmp_path, monkeypatch):
    (tmp_path / "x.yaml").write_text("a: 1")
    path = launch(tmp_path / "x.launch", NODE.format('<rosparam file="x.yaml" />'))
    monkeypatch.chdir(tmp_path)
    assert load_launch_file(path) == {"a": 1}
    monkeypatch.chdir(os.sep)
    assert "no such file" in refusal(path)


def test_recordings_hold_known_parameters_alone():
    tree = ParameterTree()
    for place in ("note", "TebLocalPlannerROS/note", "global_costmap/note"):
        set_value(tree, place, "hidden8", "")
    set_value(tree, "local_costmap/inflation_layer/note", {"deep": ["hidden8"]}, "")
    set_value(tree, "global_costmap/width", 12.0, "")
    set_value(tree, "local_costmap/inflation_radius", 0.4, "")
    set_value(tree, "recovery_behaviors", [{"name": "r", "type": "ClearCostmapRecovery"}], "")
    set_value(tree, "recovery_behaviors", [{**tree["recovery_behaviors"][0], "x": "hidden8"}], "")
    flown = config.load(tree).to_tree()
    assert "hidden8" in json.dumps(flown)
    sequences = {"quad0": GoalSequence(())}
    (robot,) = mission_info(sequences, [flown], 0.1).robots
    recorded = robot.parameters
    assert "hidden8" not in json.dumps(recorded)
    assert recorded["recovery_behaviors"] == [{"name": "r", "type": "ClearCostmapRecovery"}]
    assert recorded["global_costmap"]["width"] == 12.0
    assert recorded["local_costmap"]["inflation_layer"]["inflation_radius"] == 0.4
    assert differences(recorded) == differences(flown)
