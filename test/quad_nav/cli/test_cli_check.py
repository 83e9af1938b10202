"""``quad check``: sets of files, faults and remarks, exit status."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from quad_nav.cli import main
from quad_nav.config import Remark
from quad_nav.config.check import Report, check_files, check_source, report_text
from quad_nav.config.file_sets import FileSet, file_sets
from quad_nav.config.files import COSTMAPS, PlacedFile

CONFIG = Path(__file__).resolve().parents[3] / "config"
SEEING = (
    "observation_sources: scan\nscan: {data_type: LaserScan}\nrobot_base_frame: base_link$(arg i)\n"
)
STANDARD = {
    "costmap_common_params.yaml": SEEING,
    "local_costmap_params.yaml": "local_costmap: {width: 3.0}\n",
    "global_costmap_params.yaml": "global_costmap: {width: 12.0}\n",
    "base_local_planner_params.yaml": "TrajectoryPlannerROS: {max_vel_x: 0.3}\n",
}


def write(folder, texts):
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def quad(*arguments):
    """(exit status, what was printed)"""
    result = CliRunner().invoke(main, ["check", *map(str, arguments)], env={"COLUMNS": "100"})
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return result.exit_code, result.output


def sets(folder, number=None):
    """Name of each set -> its files, with the namespaces of those that have their own."""
    found = {}
    for one in file_sets(folder, number)[0]:
        name = "/".join(filter(None, [str(one.folder.relative_to(folder)), one.name]))
        found[name] = [str(file.path.relative_to(folder)) for file in one.files]
    return found


# -- sets of files -----------------------------------------------------------------------


def test_shipped_configurations_have_no_errors():
    status, output = quad("default", "tutorial", "barn")
    assert status == 0
    assert f"{CONFIG / 'default'}: no errors, " in output
    assert f"{CONFIG / 'tutorial'}: no errors, 1 warning" in output
    assert "\n3 configurations: no errors, " in output


def test_the_four_files_are_one_set_in_the_launch_files_order(tmp_path):
    write(tmp_path, {**STANDARD, "move_base_params.yaml": "", "amcl_params.yaml": "kld_err: 0.1"})
    (one,), left = file_sets(tmp_path)
    assert [file.path.name for file in one.files] == [*STANDARD, "move_base_params.yaml"]
    assert one.files[0].namespaces == ("global_costmap", "local_costmap")
    assert left == [tmp_path / "amcl_params.yaml"]


def test_every_robot_with_files_of_its_own(tmp_path):
    write(tmp_path, {**STANDARD, "local_costmap_params2.yaml": "", "robot10.yaml": ""})
    common, local, *others = STANDARD
    assert sets(tmp_path) == {
        "./robot 2": [common, "local_costmap_params2.yaml", *others],
        "./robot 10": [common, local, *others, "robot10.yaml"],
    }
    assert list(sets(tmp_path, "2")) == ["./robot 2"]


RADIUS, PLANNER, WIDTH = "robot_radius: 0.5", "DWAPlannerROS: {max_vel_x: 1.0}", "width: 3"
RATE = "controller_frequency: 5.0"


@pytest.mark.parametrize(
    "texts, expected",
    [
        (  # alternatives of one name belong together
            {
                "costmap_common_params_big.yaml": RADIUS,
                "costmap_common_params_small.yaml": RADIUS,
                "dwa_params_big.yaml": PLANNER,
                "dwa_params_small.yaml": PLANNER,
                "move.yaml": RATE,
            },
            {
                f"./{name}": [f"costmap_common_params_{name}.yaml", f"dwa_params_{name}.yaml"]
                + ["move.yaml"]
                for name in ("big", "small")
            },
        ),
        (  # their names are whole words
            dict.fromkeys(["common_costmap_cat.yaml", "common_costmap_car_2.yaml"], RADIUS),
            {"./car_2": ["common_costmap_car_2.yaml"], "./cat": ["common_costmap_cat.yaml"]},
        ),
        (  # or numbers
            {"costmap_common0.yaml": RADIUS, "costmap_common1.yaml": RADIUS},
            {"./0": ["costmap_common0.yaml"], "./1": ["costmap_common1.yaml"]},
        ),
        (  # folders of changes come after what they change
            {
                "costmap_common.yaml": RADIUS,
                "costmap_local.yaml": WIDTH,
                "one/costmap_common.yaml": RADIUS,
                "one/costmap_local.yaml": WIDTH,
                "two/move_base.yaml": RATE,
            },
            {
                "one": [
                    "costmap_common.yaml",
                    "one/costmap_common.yaml",
                    "costmap_local.yaml",
                    "one/costmap_local.yaml",
                ],
                "two": ["costmap_common.yaml", "costmap_local.yaml", "two/move_base.yaml"],
            },
        ),
        (  # folders with parts are one set
            {
                "nav/costmaps/costmap_common.yaml": RADIUS,
                "nav/costmaps/local.yaml": "local_costmap: {width: 3.0}",
                "nav/planners/dwa/dwa.yaml": PLANNER,
                "nav/planners/slow/other.yaml": "TrajectoryPlannerROS: {max_vel_x: 0.3}",
                "nav/move_base.yaml": RATE,
                "ekf/ekf.yaml": "sensor_timeout: 0.2\nfrequency: 30",
            },
            {
                "nav": [
                    "nav/costmaps/costmap_common.yaml",
                    "nav/costmaps/local.yaml",
                    "nav/planners/dwa/dwa.yaml",
                    "nav/planners/slow/other.yaml",
                    "nav/move_base.yaml",
                ],
            },
        ),
    ],
    ids=["alternatives", "words", "numbers", "folders", "parts"],
)
def test_sets_of_other_folders(tmp_path, texts, expected):
    assert sets(write(tmp_path, texts)) == expected


@pytest.mark.parametrize(
    "name, text, namespaces",
    [
        ("costmap_common.yaml", "robot_radius: 0.5", ("global_costmap", "local_costmap")),
        ("costmap_local.yaml", "width: 3", ("local_costmap",)),
        ("nav_global_costmap.yml", "width: 3", ("global_costmap",)),
        ("costmaps.yaml", "local_costmap: {width: 3}", ("",)),
        ("costmap_house.yaml", "rolling_window: true", ("local_costmap",)),
        ("costmap_house.yaml", "rolling_window: false", ("global_costmap",)),
        ("costmap.yaml", "robot_radius: 0.5", ("global_costmap", "local_costmap")),
        ("layers.yaml", "inflation_radius: 0.5", ("global_costmap", "local_costmap")),
        ("x.yaml", "TrajectoryPlannerROS: {max_vel_x: 0.3}", ("",)),
        ("x.yaml", "recovery_behaviors: []", ("",)),
        ("x.yaml", "move_base: {controller_frequency: 5.0}", ("",)),
        ("planner.yaml", "a: [", ("",)),
    ],
)
def test_where_a_file_is_loaded(tmp_path, name, text, namespaces):
    write(tmp_path, {name: text})
    (one,), left = file_sets(tmp_path)
    assert [file.namespaces for file in one.files] == [namespaces]
    assert left == []


@pytest.mark.parametrize(
    "name, text",
    [
        ("map.yaml", "image: a.pgm\nresolution: 0.05\norigin: [0, 0, 0]"),
        ("amcl.yaml", "transform_tolerance: 0.1\nglobal_frame_id: map"),
        ("broken.yaml", "a: ["),
        (".hidden/move_base.yaml", "controller_frequency: 5.0"),
    ],
)
def test_files_of_other_nodes_are_left_out(tmp_path, name, text):
    write(tmp_path, {name: text})
    assert file_sets(tmp_path) == ([], [] if "hidden" in name else [tmp_path / name])
    status, output = quad(tmp_path)
    assert status == 2
    assert output.strip() == (
        f"{tmp_path}: no move_base parameters found; expected files such as"
        " costmap_common_params.yaml"
    )


def test_files_are_loaded_in_the_order_given(tmp_path):
    write(tmp_path, {"a.yaml": "controller_frequency: 5.0", "b.yaml": "controller_frequency: x"})
    first, second = tmp_path / "a.yaml", tmp_path / "b.yaml"
    assert quad(first, second)[0] == 2
    assert quad(second, first)[0] == 0


def test_a_costmaps_name_before_a_file(tmp_path):
    write(tmp_path, {"house.yaml": "widht: 3.0"})
    status, output = quad(f"local_costmap={tmp_path / 'house.yaml'}")
    assert status == 0
    assert "local_costmap/widht" in output and "global_costmap/widht" not in output


# -- reports -----------------------------------------------------------------------------


def test_table(tmp_path, monkeypatch):
    write(
        tmp_path,
        {
            **STANDARD,
            "move_base_params.yaml": "recovery_behaviour_enabled: true\n",
            "base_local_planner_params.yaml": (
                "TrajectoryPlannerROS:\n  pdist_scale: 1.0\n  max_vel_x: 25\n"
            ),
            "costmap_common_params.yaml": SEEING + "zzz: 1\n",
        },
    )
    monkeypatch.chdir(tmp_path)
    status, output = quad(".", "--strict")
    assert status == 1
    assert (
        output.rstrip()
        == """\
.: no errors, 5 warnings
  costmap_common_params.yaml, local_costmap_params.yaml, global_costmap_params.yaml,
  base_local_planner_params.yaml, move_base_params.yaml

parameter                           kind     message
----------------------------------  -------  -----------------------------------------------------
recovery_behaviour_enabled          unknown  nothing reads it; did you mean
  move_base_params.yaml:1                    recovery_behavior_enabled?
TrajectoryPlannerROS/pdist_scale    renamed  old name of path_distance_bias
  base_local_planner_params.yaml:2
TrajectoryPlannerROS/max_vel_x      clamped  25 clamped to 20.0, the largest that move_base allows
  base_local_planner_params.yaml:3
*_costmap/zzz                       unknown  nothing reads it
  costmap_common_params.yaml:4
controller_frequency                caution  a command is flown for 0.05 s, which is 1.0 m; the
                                             local costmap reaches 1.5 m"""
    )


def test_all_errors_at_once_and_remarks_after_them(tmp_path):
    local = "local_costmap:\n  width: three\n  static_mapp: true\n  height: -1.0\n"
    write(tmp_path, {**STANDARD, "local_costmap_params.yaml": local})
    status, output = quad(tmp_path)
    assert status == 2
    assert f"{tmp_path}: 2 errors, 1 warning\n" in output
    places = [line.split()[:2] for line in output.splitlines() if line.startswith("local_costmap/")]
    assert places == [
        ["local_costmap/width", "error"],
        ["local_costmap/height", "error"],
        ["local_costmap/static_mapp", "unknown"],
    ]


def test_files_that_cannot_be_read_hide_no_other_errors(tmp_path):
    write(
        tmp_path,
        {
            **STANDARD,
            "local_costmap_params.yaml": "local_costmap:\n\twidth: 1\n",
            "global_costmap_params.yaml": "global_costmap: {width: three, q: 1}\n",
        },
    )
    ((report,), left) = check_source(tmp_path)
    assert [line.kind for line in report.lines] == ["error", "error"]
    assert report.lines[0].origin == f"{tmp_path / 'local_costmap_params.yaml'}:2:1"
    assert report.lines[0].text.startswith("not YAML: ")
    assert report.lines[1].place == "/global_costmap/width"


def test_missing_file(tmp_path):
    status, output = quad(tmp_path / "nowhere.yaml")
    assert status == 2
    assert "cannot be read" in output


def test_the_robots_number(tmp_path):
    write(tmp_path, STANDARD)
    assert quad(tmp_path, "--robot", 3)[0] == 0
    assert quad(tmp_path, "--robot", -1)[0] == 2
    report = check_files([PlacedFile(tmp_path / "costmap_common_params.yaml", ())], "3")
    assert report.files.number == "3" and report.errors == 0


@pytest.mark.parametrize("width", [100, 80])
def test_tables_keep_to_the_width(width):
    lines = (
        Remark(
            "/global_costmap/obstacle_layer/base_scan/expected_update_rate",
            "caution",
            "a long text " * 20,
            "some/folder/costmap_common_params.yaml:12",
        ),
        Remark(
            "/recovery_behaviour_enabled",
            "unknown",
            "unknown parameter, nothing reads it",
            "move_base.yaml:2",
            "recovery_behavior_enabled",
        ),
        Remark("/local_costmap", "unsupported", "an_endless_name::" * 10),
    )
    text = report_text(Report(FileSet(None, "", (), "0"), lines), width)
    assert max(map(len, text.splitlines())) <= width
    assert "recovery_behavior_enabled" in text


def test_remarks_that_differ_between_the_costmaps_are_not_merged(tmp_path):
    colours = {f"{name}_params.yaml": f"{name}: {{colour: 1}}" for name in COSTMAPS}
    write(tmp_path, {**STANDARD, **colours})
    ((report,), _) = check_source(tmp_path)
    assert [line.place for line in report.lines] == [
        "/global_costmap/colour",
        "/local_costmap/colour",
    ]


def test_usage():
    assert quad()[0] == 2
    assert "SOURCE | [COSTMAP=]FILE..." in quad("--help")[1]
