"""The same scenarios are refused offline and under ROS, with the same messages."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import pytest

from quad_nav import config
from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.scenario import flight_setup, mission_setup, simulator_setup
from quad_nav.scenario.flight_setup import FlightOptions
from quad_nav.scenario.goal_checks import cover_warnings
from quad_nav.sim.scene import Scene, Walls

ARENA = shipped("scenes", "arena.yaml")
GOAL = [1.5, 6.0]
DWA = "dwa_local_planner/DWAPlannerROS"
GLOBAL = "global_costmap:\n"
LOW = GLOBAL + "  height: 3.0\n"
OFF = "(1.5, 6) is off the global costmap, x 0 to 12 m, y 0 to 3 m; expected a position on it"


class Case(NamedTuple):
    """A goal file's content for each robot, the robots' number, parameters on top, and faults."""

    goals: Sequence[Any]
    robots: int = 1
    parameters: str = ""
    faults: Sequence[str] = ()
    scene: str = str(ARENA)


CASES = {
    "flyable": Case([{"goals": [GOAL]}]),
    "off the global costmap": Case([{"goals": [GOAL]}], 1, LOW, [f"goals[0] (goal 1): {OFF}"]),
    "second robot off the global costmap": Case(
        [{"goals": [[1.5, 2.0]]}, {"goals": [[1.5, 2.0], GOAL]}],
        2,
        LOW,
        [f"quad1_goals.json: goals[1] (goal 2): {OFF}"],
    ),
    "a costmap that follows the robot": Case(
        [{"goals": [GOAL]}], 1, LOW + "  rolling_window: true\n"
    ),
    "a costmap with its map's size": Case([{"goals": [GOAL]}], 1, LOW + "  static_map: true\n"),
    "two faulty files": Case(
        [{"goals": [[20.0, 4.0], [2.2, 4.0], [0.1, 4.0]]}, {"gaols": [GOAL]}],
        2,
        faults=["is outside the arena", "is inside an obstacle", "robot's radius, 0.30 m"]
        + ["gaols: is not a key", "has no goals"],
    ),
    "no file for a robot": Case([{"goals": [GOAL]}], 2, faults=["has no quad1_goals.json"]),
    "no scene file": Case(
        [{"goals": [GOAL]}], faults=["nowhere.yaml: cannot be read"], scene="/nowhere.yaml"
    ),
}


def write(folder: Path, case: Case) -> None:
    """Write goal files and a configuration with the case's parameters on top."""
    (folder / "goals").mkdir()
    for number, goals in enumerate(case.goals):
        (folder / "goals" / f"quad{number}_goals.json").write_text(json.dumps(goals))
    (folder / "config").mkdir()
    for path in shipped("config", "default").glob("*.yaml"):
        (folder / "config" / path.name).write_text(path.read_text())
    for number in range(case.robots):
        (folder / "config" / f"robot{number}.yaml").write_text(case.parameters)


def problems_of(read, *arguments) -> List[str]:
    try:
        read(*arguments)
    except InputError as error:
        return error.problems
    return []


def offline(folder: Path, case: Case) -> List[str]:
    return problems_of(
        flight_setup.read_setup,
        FlightOptions(
            Path(case.scene), folder / "goals", str(folder / "config"), robots=case.robots
        ),
    )


def sequencer(folder: Path, parameters: Dict[str, Any], server: Any = {}):  # noqa: B006
    """The sequencer's set-up of the goals in the folder."""
    parameters = {"goals": str(folder / "goals"), "robots": 1, **parameters}
    result = folder / "result.json"
    return mission_setup.read_setup(parameters, "sequencer", result, folder, server)


def on_the_server(folder: Path, robots: int) -> Dict[str, Any]:
    return {
        f"move_base{number}": dict(config.load_files(folder / "config", {"i": str(number)}))
        for number in range(robots)
    }


def under_ros(folder: Path, case: Case, fleet: bool) -> List[str]:
    """Problems of the sequencer's set-up, for a fleet or for navigators on the server."""
    parameters = {"scene": case.scene, "robots": case.robots}
    if fleet:
        return problems_of(sequencer, folder, {**parameters, "config": str(folder / "config")})
    return problems_of(sequencer, folder, parameters, on_the_server(folder, case.robots))


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_both_shells_refuse_the_same_with_the_same_words(tmp_path, case):
    write(tmp_path, case)
    problems, options = without_sizes(offline(tmp_path, case), "--set global_costmap/width=12 ")
    assert len(problems) == len(case.faults)
    assert all(fault in problem for fault, problem in zip(case.faults, problems))
    for fleet in (True, False):
        same, lines = without_sizes(under_ros(tmp_path, case, fleet), "{width: 12, height: 12, ")
        assert same == problems
        assert len(lines) == len(options) == ("off the global costmap" in "".join(problems))


def without_sizes(problems: List[str], size: str) -> Tuple[List[str], List[str]]:
    """The problems without the lines to copy, and these lines."""
    lines = [problem for problem in problems if size in problem]
    return [problem for problem in problems if problem not in lines], lines


def test_faulty_values_do_not_hide_faults_in_files(tmp_path):
    write(tmp_path, Case([{"goals": [GOAL, "x"]}], 1, LOW))
    parameters = {"scene": "/nowhere.yaml", "size": -1.0, "config": str(tmp_path / "config")}
    problems = problems_of(sequencer, tmp_path, parameters)
    expected = ("sequencer: size: is -1.0", "nowhere.yaml: cannot be read", "goals[1] (goal 2)")
    assert len(problems) == 3
    assert all(fault in problem for fault, problem in zip(expected, problems))


@pytest.mark.parametrize(
    "tree, given, expected_rad",
    [
        ("TrajectoryPlannerROS:\n  yaw_goal_tolerance: 0.2\n", None, 0.2),
        ("TrajectoryPlannerROS:\n  yaw_goal_tolerance: 0.2\n", 0.3, 0.3),
        (f"base_local_planner: {DWA}\nDWAPlannerROS:\n  yaw_goal_tolerance: 0.15\n", None, 0.15),
    ],
)
def test_the_tolerance_of_yaws_is_the_local_planners(tmp_path, tree, given, expected_rad):
    goals = {"goals": [[*GOAL, 1.0]], **({"yaw_tolerance": given} if given else {})}
    write(tmp_path, Case([goals], 1, tree))
    folder = str(tmp_path / "config")
    for setup in (
        flight_setup.read_setup(FlightOptions(ARENA, tmp_path / "goals", folder)),
        sequencer(tmp_path, {"scene": str(ARENA)}, on_the_server(tmp_path, 1)),
        sequencer(tmp_path, {"scene": str(ARENA), "config": folder}),
    ):
        sequence = setup.robots[0].sequence
        assert sequence.yaw_tolerance_rad(sequence.goals[0]) == expected_rad


def test_unknown_navigators_have_a_tolerance_of_yaws_and_the_node_may_set_one(tmp_path):
    write(tmp_path, Case([{"goals": [[*GOAL, 1.0]]}]))
    for more, expected_rad in (({}, 0.1), ({"yaw_tolerance": 0.7}, 0.7)):
        sequence = sequencer(tmp_path, more).robots[0].sequence
        assert sequence.yaw_tolerance_rad(sequence.goals[0]) == expected_rad


def test_tolerances_below_the_local_planners_are_named(tmp_path):
    goals = [[1.5, 3.0, 0.5], {"x": 1.5, "y": 6.0, "tolerance": 0.05}]
    write(tmp_path, Case([{"goals": goals, "yaw_tolerance": 0.02}, {"goals": [GOAL]}], 2))
    setup = flight_setup.read_setup(
        FlightOptions(ARENA, tmp_path / "goals", str(tmp_path / "config"))
    )
    warnings = [line for line in setup.warnings if "quad0_goals.json" in line]
    assert len(warnings) == 2 and not [line for line in setup.warnings if "quad1_g" in line]
    assert "a tolerance of 0.05 m is below the local planner's xy_goal_tolerance" in warnings[0]
    assert "a tolerance of 0.02 rad is below the local planner's yaw_goal_tol" in warnings[1]


@pytest.mark.parametrize("robots", [0, "two", True])
def test_a_faulty_number_of_robots_is_the_only_fault(tmp_path, robots):
    write(tmp_path, CASES["flyable"])
    for given in ({"scene": str(ARENA)}, {"scene": "random", "goals": "random"}):
        (problem,) = problems_of(sequencer, tmp_path, {**given, "robots": robots})
        assert problem.startswith(f"sequencer: robots: is {robots!r}; expected a whole number")


def test_navigators_without_parameters_on_the_server_are_not_checked(tmp_path):
    write(tmp_path, CASES["off the global costmap"])
    assert sequencer(tmp_path, {"scene": str(ARENA)}, {"move_base7": {}}).parameters == ({},)


@pytest.mark.parametrize("frame, problems", [("map", 1), ("odom0", 0)])
def test_without_a_simulation_only_costmaps_in_the_map_have_a_known_place(
    tmp_path, frame, problems
):
    write(tmp_path, Case([{"goals": [GOAL]}], 1, LOW + f"  global_frame: {frame}\n"))
    server = on_the_server(tmp_path, 1)
    assert len(problems_of(sequencer, tmp_path, {"simulation": False}, server)) == problems


def test_an_edited_goal_file_is_checked_against_the_global_costmap(tmp_path):
    case = Case([{"goals": [[1.5, 2.0]]}], 1, LOW)
    write(tmp_path, case)
    options = FlightOptions(ARENA, tmp_path / "goals", str(tmp_path / "config"))
    (robot,) = flight_setup.read_setup(options).robots
    robot.file.path.write_text(json.dumps({"goals": [GOAL]}))
    assert robot.file.poll() is None  # the content has to be the same twice
    with pytest.raises(InputError, match="is off the global costmap"):
        robot.file.poll()


@pytest.mark.parametrize(
    "robots, size, fault", [(50, 8.0, "no room for"), (2, -1.0, "size: is -1.0")]
)
def test_both_shells_refuse_the_same_random_missions(tmp_path, robots, size, fault):
    (problem,) = problems_of(
        flight_setup.read_setup, FlightOptions(None, None, robots=robots, size_m=size)
    )
    assert fault in problem
    parameters = {"scene": "random", "goals": "random", "robots": robots, "size": size}
    (same,) = problems_of(sequencer, tmp_path, parameters)
    assert same.replace("sequencer: ", "") == problem


@pytest.mark.parametrize("rate", [0.0, 7.0, 480.0, math.nan])
def test_both_shells_refuse_the_same_scan_rates(rate):
    (problem,) = problems_of(
        flight_setup.read_setup, FlightOptions(None, None, robots=1, scans_per_s=rate)
    )
    parameters = {"scene": str(ARENA), "lidar_rate": rate}
    (same,) = problems_of(simulator_setup.read_setup, parameters, "simulator")
    assert same == f"simulator: {problem}"
    assert "expected scans per second that divide 240" in problem


# Global costmaps that end within the arena are allowed, with a warning.

SCENE = Scene("s", 12.0, 8.0, 1.0, Walls(), (), (), origin_x_m=-6.0)
HELD = {"origin_x": -6.0, "origin_y": 0.0, "width": 12.0, "height": 8.0, "static_map": False}


def warnings(**changes) -> list:
    tree = {"global_costmap": {**HELD, **changes}, "local_costmap": {"rolling_window": True}}
    return cover_warnings(SCENE, [config.load(tree), None], in_a_file=False)


@pytest.mark.parametrize(
    "changes, count",
    [
        ({}, 0),
        ({"origin_x": -7.0, "width": 14.0}, 0),
        ({"origin_x": -5.96, "width": 13.0}, 0),  # a cell may be missing
        ({"rolling_window": True, "width": 3.0}, 0),
        ({"static_map": True, "width": 3.0}, 0),
        ({"origin_y": 0.2}, 1),
        ({"width": 11.0}, 1),
        ({"height": 7.0}, 1),
    ],
)
def test_costmaps_that_end_within_the_arena_are_warned_about(changes, count):
    assert len(warnings(**changes)) == count


def test_the_warning_names_both_areas():
    assert warnings(origin_x=0.0) == [
        "quad0: global_costmap covers x 0 to 12 m, y 0 to 8 m, but the scene is "
        "x -6 to 6 m, y 0 to 8 m: no plan leads beyond the costmap; expected "
        "--set global_costmap/width=12 --set global_costmap/height=8 "
        "--set global_costmap/origin_x=-6 --set global_costmap/origin_y=0"
    ]
