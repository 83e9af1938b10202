"""The preview of a mission."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from quad_nav.cli.preview import preview as command
from quad_nav.errors import InputError
from quad_nav.grid import INSCRIBED, LETHAL
from quad_nav.report.preview_page import page_data
from quad_nav.report.preview_picture import cost_colours, preview_picture
from quad_nav.report.scene_drawing import MOVING
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.scenario.preview import MissionPreview

SCENE = """
name: hall
size: [8.0, 6.0]
altitude: 1.0
walls: {height: 2.0, thickness: 0.1}
obstacles:
  - {name: pillar, shape: cylinder, centre: [4.0, 3.0], radius: 0.5, height: 2.0}
starts: [[1.0, 1.0, 0.0], [7.0, 5.0, 3.14]]
"""
GOALS = '{\n  "retries": 2,\n  "goals": [\n    [1.0, 5.0],\n    [7.0, 3.50, 1.57]\n  ]\n}\n'
INSIDE = "is inside an obstacle; expected 0.30 m of free space around it"


@pytest.fixture
def hall(tmp_path):
    """Scene and goal files of two robots; the options that read them."""
    (tmp_path / "hall.yaml").write_text(SCENE)
    for robot in (0, 1):
        (tmp_path / f"quad{robot}_goals.json").write_text(GOALS)
    return FlightOptions(tmp_path / "hall.yaml", tmp_path)


def write_goals(options, robot, goals):
    (options.goals / f"quad{robot}_goals.json").write_text(json.dumps({"goals": goals}))


def test_costmap_is_that_of_the_whole_scene_with_the_configuration_s_inflation(hall):
    preview = MissionPreview(hall)
    costmap = preview.costmap(0)
    assert preview.costmap(1) is costmap  # equal robots share one

    def cost(x_m, y_m):
        column, row = costmap.spec.cell_of(x_m, y_m)
        return costmap.costs[row, column]

    assert cost(4.0, 3.0) == LETHAL
    assert cost(4.0 + 0.5 + 0.9 * costmap.inscribed_radius_m, 3.0) == INSCRIBED
    assert cost(0.01, 3.0) == LETHAL  # the wall's surface
    assert cost(2.5, 3.0) == 0
    assert 0 < cost(4.0 + 0.5 + costmap.inscribed_radius_m + 0.1, 3.0) < INSCRIBED


def test_plans_lead_from_goal_to_goal_around_obstacles(hall):
    write_goals(hall, 0, [[1.0, 3.0], [7.0, 3.0]])
    robot = MissionPreview(hall).robot(0)
    assert robot.faults == ("", "")
    assert robot.warnings == ()
    first, second = robot.plans
    assert first[-1] == pytest.approx((1.0, 3.0))
    assert (second[0], second[-1]) == (
        pytest.approx((1.0, 3.0), abs=0.06),
        pytest.approx((7.0, 3.0)),
    )
    assert np.hypot(*(second - (4.0, 3.0)).T).min() > 0.5 + 0.3


def test_faulty_goals_are_shown_with_the_fault_that_fly_reports(hall):
    write_goals(hall, 0, [[1.0, 5.0], [4.0, 3.0], [9.0, 3.0]])
    with pytest.raises(InputError) as refused:
        read_setup(hall)
    preview = MissionPreview(hall)
    assert preview.problems == tuple(refused.value.problems)
    assert preview.numbers == [0, 1]
    robot = preview.robot(0)
    assert robot.faults[:2] == ("", INSIDE)
    assert robot.faults[2].startswith("is outside the arena")
    assert [len(plan) > 0 for plan in robot.plans] == [True, False, False]


def test_a_goal_far_away_leaves_the_arena_its_size(hall):
    """90 instead of 9: an arrow at the edge, in an area with a margin of a tenth of 8 m."""
    write_goals(hall, 0, [[1.0, 5.0], [90.0, 3.0]])
    preview = MissionPreview(hall)
    robots = [preview.robot(number) for number in preview.numbers]
    assert page_data(preview, robots, "")["area"] == pytest.approx([-0.1, 8.8, -0.1, 6.1])
    (axes,) = preview_picture(preview, robots, "").axes
    (text,) = [one for one in axes.texts if "outside" in one.get_text()]
    assert text.get_text() == "(90, 3) is outside the arena"
    assert text.xy == pytest.approx((8.8 - 0.05 * 8.9, 3.0))


def test_files_with_a_bad_key_show_what_can_be_read(hall):
    hall.scene.write_text(SCENE.replace("altitude", "altitud"))
    (hall.goals / "quad0_goals.json").write_text(
        '{"goals": [[1, 5], [1, "x"], [7, 5]], "retry": 1}'
    )
    preview = MissionPreview(hall)
    assert [line.partition(": ")[2].partition(":")[0] for line in preview.problems] == [
        "altitud",
        "retry",
        "goals[1] (goal 2)",
    ]
    assert preview.scene is not None and len(preview.scene.obstacles) == 1
    assert preview.numbers == [0, 1]
    assert [goal.y_m for goal in preview.robot(0).sequence.goals] == [5.0]  # up to the bad one
    hall.scene.write_text(SCENE.replace("size", "siz"))
    assert MissionPreview(hall).scene is None


def test_goals_are_checked_with_the_body_of_the_configuration(hall):
    write_goals(hall, 0, [[4.0, 3.9]])
    wide = replace(hall, parameters=(("body_radius", 0.45),))
    preview = MissionPreview(wide)
    assert preview.robot_radius_m == 0.45
    (fault,) = preview.robot(0).faults
    assert "expected at least the robot's radius, 0.45 m" in fault
    assert len(preview.problems) == 1 and fault in preview.problems[0]


def test_a_goal_without_a_path_is_warned_about(hall):
    walled = SCENE.replace(
        "obstacles:\n",
        """obstacles:
  - {name: fence, shape: box, centre: [6.0, 3.0], size: [0.2, 6.0], height: 2.0}
""",
    )
    hall.scene.write_text(walled)
    robot = MissionPreview(hall).robot(0)
    assert [len(plan) > 0 for plan in robot.plans] == [True, False]
    assert len(robot.warnings) == 1
    assert robot.warnings[0].startswith("quad0: goal 2 (7, 3.5): no path from goal 1 ")


def test_a_rolling_costmap_covers_a_scene_without_too_many_cells(hall):
    rolling = replace(hall, parameters=(("global_costmap/rolling_window", True),))
    spec = MissionPreview(rolling).costmap(0).spec
    assert (spec.origin_x_m, spec.origin_y_m) == (-0.1, -0.1)
    assert spec.size_x * spec.resolution_m == pytest.approx(8.2)
    hall.scene.write_text(SCENE.replace("[8.0, 6.0]", "[80000.0, 60000.0]"))
    preview = MissionPreview(rolling)
    assert preview.costmap(0) is None
    assert preview.robot(0).warnings == (
        "quad0: no costmap and no plans: the scene has too many cells",
    )


def test_what_cannot_be_read_is_left_out(hall):
    (hall.goals / "quad1_goals.json").write_text("{")
    preview = MissionPreview(hall)
    assert preview.numbers == [0]
    assert any("quad1_goals.json" in problem for problem in preview.problems)
    hall.scene.write_text("size: 3")
    preview = MissionPreview(hall)
    assert preview.scene is None
    assert preview.robot(0).plans[0].size == 0


def test_costs_have_the_colours_of_rviz():
    colours = cost_colours(np.array([[0, 1, 252, INSCRIBED, LETHAL]], dtype=np.uint8))[0]
    assert colours[:, :3].tolist()[1:] == [[0, 0, 255], [255, 0, 0], [0, 255, 255], [255, 0, 255]]
    assert colours[0, 3] == 0 < colours[1, 3]


@pytest.mark.parametrize(
    "suffix, start", [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".html", b"<!DOCTYPE html>")]
)
def test_command_writes_the_picture_and_returns_the_status_of_fly(hall, tmp_path, suffix, start):
    output = tmp_path / f"out{suffix}"
    words = ["--scene", str(hall.scene), "--goals", str(hall.goals), "-o", str(output)]
    assert CliRunner().invoke(command, words).exit_code == 0
    assert output.read_bytes().startswith(start)
    write_goals(hall, 0, [[4.0, 3.0]])
    refused = CliRunner().invoke(command, words)
    assert refused.exit_code == 2
    assert f"goals[0] (goal 1): (4, 3) {INSIDE}" in refused.output


def test_command_refuses_other_names(tmp_path):
    result = CliRunner().invoke(command, ["-o", str(tmp_path / "out.jpg")])
    assert result.exit_code == 2
    assert "expected a name that ends in .png or .svg or .html" in result.output


def test_moving_obstacles_are_drawn_where_they_start_with_their_paths(hall):
    cart = """
  - name: cart
    shape: box
    size: [1.0, 0.5]
    height: 2.0
    motion: {keyframes: [{time: 0.0, x: 1.0, y: 2.0}, {time: 8.0, x: 5.0, y: 2.0}]}
walkers: {count: 2}
starts"""
    hall.scene.write_text(SCENE.replace("\nstarts", cart))
    preview = MissionPreview(hall)
    assert preview.problems == ()
    assert [solid.name for solid in preview.moving] == ["cart", "person_0", "person_1"]
    assert (preview.moving[0].x_m, preview.moving[0].y_m) == (1.0, 2.0)
    (axes, *_) = preview_picture(preview, [preview.robot(0)], "hall").axes
    brown = [line for line in axes.lines if line.get_color() == MOVING]
    assert [line.get_xydata()[[0, -1]].tolist() for line in brown] == [[[1.0, 2.0], [5.0, 2.0]]]
    data = page_data(preview, [preview.robot(0)], "hall")
    assert [[path[0], path[-1]] for path in data["motions"]] == [[[1.0, 2.0], [5.0, 2.0]]]
    cart, *people = data["moving"]
    assert np.mean(cart[:4], axis=0) == pytest.approx([1.0, 2.0])
    assert [np.mean(person[:-1], axis=0) for person in people] == [
        pytest.approx([solid.x_m, solid.y_m], abs=1e-3) for solid in preview.moving[1:]
    ]


def test_people_without_room_are_a_problem(hall):
    hall.scene.write_text(SCENE.replace("\nstarts", "\nwalkers: {count: 200, radius: 0.5}\nstarts"))
    preview = MissionPreview(hall)
    assert preview.moving == ()
    assert "no room for person" in "".join(preview.problems)
