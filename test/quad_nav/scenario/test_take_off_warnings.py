"""What a flight tells before it takes off, on missions in ``test/field_cases``."""

from __future__ import annotations

from pathlib import Path

import pytest

from quad_nav.files.shipped import shipped
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.scenario.goal_plans import unreachable_goals
from quad_nav.scenario.mission_setup import read_setup as read_mission
from quad_nav.scenario.simulator_setup import read_setup as read_simulator
from quad_nav.sim.obstacles import Box
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.unseen import unseen_obstacles

CASES = Path(__file__).parents[2] / "field_cases"


def setup_of(case):
    return read_setup(FlightOptions(CASES / case / "scene.yaml", CASES / case, "default"))


def test_goals_without_a_plan_are_named():
    lines = unreachable_goals(setup_of("goal_at_wall"))
    assert [line.partition(": no path from the start")[0] for line in lines] == [
        "quad0: goal 1 (7.69, 3)",
        "quad0: goal 2 (7.65, 5.65)",
        "quad0: goal 3 (4, 0.31)",
    ]


def test_starts_are_chosen_where_the_goals_can_be_reached():
    """The map has a closed room, from (8.5, 3) to (15.5, 9), around its middle."""
    case = CASES / "start_pocket"
    setup = read_setup(FlightOptions(case / "map.yaml", case, "default"))
    assert inside_room(setup.scene) == [1]  # only the goal of quad1 is inside
    assert unreachable_goals(setup) == []
    assert inside_room(load_scene(case / "map.yaml")) == []
    node = {"scene": str(case / "map.yaml"), "goals": str(case), "robots": 2}
    assert read_simulator(node, "/simulator").scene.starts == setup.scene.starts


@pytest.mark.parametrize(
    "parameters, is_told", [((), True), ((("global_costmap/static_map", True),), False)]
)
def test_a_map_that_the_costmap_does_not_use_is_told(parameters, is_told):
    case = CASES / "start_pocket"
    setup = read_setup(FlightOptions(case / "map.yaml", case, "default", parameters))
    lines = [one for one in setup.warnings if "does not use the scene's map" in one]
    assert [line.partition(": ")[0] for line in lines] == ["quad0, quad1"] * is_told
    assert all("expected --set global_costmap/static_map=true" in line for line in lines)


def test_the_sequencer_tells_of_the_map_with_the_file_to_change(tmp_path):
    case = CASES / "start_pocket"
    given = {"scene": str(case / "map.yaml"), "goals": str(case), "robots": 2}
    given["config"] = str(shipped("config", "default"))
    told = read_mission(given, "/sequencer", tmp_path / "result.json", tmp_path).warnings
    (line,) = [one for one in told if "does not use the scene's map" in one]
    assert "in robot0.yaml global_costmap: {static_map: true}, and map_server" in line


def test_goals_off_a_rolling_costmap_are_told():
    """From (12, 1.5), goal 1 is 9 m away along x, goal 2 from there 18 m."""
    rolls = (("rolling_window", True), ("width", 20.0), ("height", 20.0))
    case, parameters = CASES / "start_pocket", [(f"global_costmap/{k}", v) for k, v in rolls]
    setup = read_setup(FlightOptions(case / "map.yaml", case, "default", tuple(parameters)))
    (line,) = unreachable_goals(setup)
    assert line.startswith("quad0: goal 2 (21, 6): no path from goal 1")
    assert line.endswith("it rolls with the robot and ends before the goal")


def inside_room(scene):
    return [k for k, one in enumerate(scene.starts) if 9 < one.x_m < 15 and 3.5 < one.y_m < 8.5]


def test_a_table_that_the_lidar_misses_is_named():
    """Its top is from 0.985 to 1.015 m, the LIDAR at 1.06 m, the hull from 0.94 to 1.18 m."""
    (line,) = [one for one in setup_of("unseen_table").warnings if "LIDAR" in one]
    assert "altitude 1 m: quadcopters touch table_top, which their LIDARs do not see" in line
    assert line.endswith("expected an altitude of 0.80 m or 1.10 m")


def scene_with(*heights):
    boxes = [Box(f"b{k}", 2.0, 2.0, 1.0, 1.0, top - low, 0.0, low) for k, (low, top) in heights]
    return Scene("room", 8.0, 6.0, 1.0, Walls(), tuple(boxes), ())


def test_what_is_seen_or_not_touched_is_no_caution():
    assert unseen_obstacles(scene_with(*enumerate([(0.0, 1.07), (0.0, 0.93), (1.19, 3.0)]))) == []


def test_where_no_altitude_is_free():
    shelf = [(0.1 * k, 0.1 * k + 0.02) for k in range(32)]
    (line,) = unseen_obstacles(scene_with(*enumerate(shelf)))
    assert line.endswith("no altitude is better")
