"""Items of the page, with numbers by hand."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import quad_web
from quad_nav.geometry import (
    Pose2D,
    Pose3D,
    Scan,
    Twist2D,
    quaternion_from_euler,
    quaternion_from_yaw,
)
from quad_nav.grid import GridSpec
from quad_nav.mission.goal import Goal
from quad_nav.peers.right_of_way import Yield, YieldDecision
from quad_nav.sim.contacts import Contact
from quad_nav.sim.motion import Motion, Walkers
from quad_nav.sim.obstacles import SHAPES, Box, Cylinder, Sphere
from quad_nav.sim.scene import MovingObstacle, Scene, Walls
from quad_web.view.cells import buffered_cell, cell_items
from quad_web.view.items import (
    TRAIL_POINTS,
    UNKNOWN_BODY,
    ObstacleItems,
    Trails,
    body_row,
    costmap_item,
    line_item,
    poses_item,
    robots_item,
    scan_item,
    scene_item,
    track_item,
)
from quad_web.view.rows import (
    RobotNow,
    contacts_item,
    flight_item,
    gaps_m,
    goal_rows,
    samples_item,
)

SCENE = Scene(
    "room",
    8.0,
    6.0,
    1.0,
    Walls(2.0, 0.1),
    (
        Box("crate", 2.0, 3.0, 1.0, 0.5, 0.4, yaw_rad=0.5),
        Cylinder("pillar", 5.0, 4.0, 0.3, 1.0),
        Sphere("lamp", 4.0, 1.0, 2.0, 0.5),
    ),
    (Pose2D(1.0, 1.0),),
    origin_x_m=-1.0,
    origin_y_m=2.0,
)
SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))


def test_scene_has_the_arena_and_its_solids():
    scene = scene_item(SCENE).data
    assert (scene["size_m"], scene["origin_m"]) == ([8.0, 6.0], [-1.0, 2.0])
    assert scene["altitude_m"] == 1.0
    west, east, south, north = scene["walls"]
    assert (west["x"], west["y"], west["outline"][0]) == (-1.05, 5.0, [0.05, 3.0])
    assert (north["y"], north["outline"][0], north["crosses"]) == (8.05, [4.1, 0.05], True)
    crate, pillar, lamp = scene["solids"]
    assert crate == {
        "shape": "box",
        "outline": [[0.5, 0.25], [-0.5, 0.25], [-0.5, -0.25], [0.5, -0.25]],
        "x": 2.0,
        "y": 3.0,
        "bottom": 0.0,
        "height": 0.4,
        "yaw": 0.5,
        "name": "crate",
        "crosses": False,  # its top is at 0.4 m, the quadcopters fly at 1 m
        "reach": pytest.approx(0.559, abs=1e-3),
    }
    assert np.hypot(*np.transpose(pillar["outline"])) == pytest.approx(0.3, abs=1e-4)
    assert (pillar["shape"], pillar["crosses"]) == ("cylinder", True)
    assert (lamp["shape"], lamp["bottom"], lamp["height"]) == ("sphere", 1.5, 1.0)
    assert not lamp["crosses"]


STREET = replace(
    SCENE,
    moving=(
        MovingObstacle(Box("cart", 3.0, 3.0, 1.0, 0.5, 2.0), Motion((0.0,), ((3.0, 3.0, 0.0),))),
    ),
    walkers=Walkers(1, radius_m=0.25),
)


def test_solids_that_move_are_apart_from_the_others():
    scene = scene_item(STREET).data
    assert [solid["name"] for solid in scene["solids"]] == ["crate", "pillar", "lamp"]
    cart, person = scene["moving"]
    assert (cart["name"], cart["outline"][0], cart["person"]) == ("cart", [0.5, 0.25], False)
    assert (person["name"], person["reach"], person["person"]) == ("person_0", 0.25, True)


def test_obstacles_are_put_when_they_have_moved_and_people_look_where_they_walk():
    items = ObstacleItems()

    def put(*poses):
        """Return the yaw of cart and person, None if nothing is put."""
        made = items.items(STREET, poses)
        return made[0].arrays["poses"][:, 2].tolist() if made else None

    start = put((3.0, 3.0, 0.5), (1.0, 1.0, 0.0))
    assert start == pytest.approx([0.5, math.nan], nan_ok=True)
    assert put((3.0, 3.0, 0.5), (1.0, 1.0, 0.0)) is None
    north = pytest.approx([0.5, math.pi / 2], abs=1e-6)
    assert put((3.0, 3.0, 0.5), (1.0, 1.1, 0.0)) == north
    assert put((3.1, 3.0, 0.5), (1.0, 1.1, 0.0)) == north  # stands, and looks there still
    jump = put((3.1, 3.0, 0.5), (6.0, 1.1, 0.0))
    assert jump == pytest.approx([0.5, math.nan], nan_ok=True)
    assert put((3.1, 3.0, 0.5), (math.nan, math.nan, math.nan))[0] == 0.5
    items.clear()
    assert put((3.1, 3.0, 0.5), (math.nan, math.nan, math.nan))[0] == 0.5


def test_robots_have_the_colours_of_all_displays():
    robots = robots_item(["a", "b"], 0.3).data
    assert robots["colours"] == ["#2078dc", "#e66e14"]  # (32, 120, 220), (230, 110, 20)


def test_poses_have_tilt_and_velocity_in_map():
    """A robot at (1, 2, 3) faces along y, tilted, and flies ahead: along y of the map."""
    quaternion = quaternion_from_euler(0.1, -0.2, math.pi / 2)
    row = body_row(Pose3D(1.0, 2.0, 3.0, quaternion), Twist2D(0.5, 0.0, 0.25))
    item = poses_item(12.5, 99.0, [row, UNKNOWN_BODY])
    assert item.data == {"stamp_s": 12.5, "wall_s": 99.0}
    pose = item.arrays["pose"]
    assert pose.dtype == np.float32
    assert pose[0] == pytest.approx([1, 2, 3, 0.1, -0.2, math.pi / 2, 0, 0.5, 0.25], abs=1e-6)
    assert np.isnan(pose[1]).all()


def test_beams_hit_where_they_look():
    """The LIDAR at (1, 2) looks along y; the beam to its left sees nothing."""
    scan = Scan(0.5, 0.0, math.pi / 2, 0.02, 60.0, np.array([3.0, np.inf, 0.5], dtype=np.float32))
    pose = Pose3D(1.0, 2.0, 1.06, quaternion_from_yaw(math.pi / 2))
    expected = pytest.approx(np.array([[1.0, 5.0, 1.06], [1.0, 1.5, 1.06]]))
    item = scan_item(7, scan, pose)
    assert (item.key, item.data) == ("scan/7", {"stamp_s": 0.5})
    assert item.arrays["points"].dtype == np.float32
    assert item.arrays["points"] == expected


def test_costmap_lies_where_its_frame_is():
    """A grid's corner (1, 0) in a frame at (10, 20) that is turned by 90 degrees: (10, 21)."""
    costs = np.zeros((2, 3), np.int8)
    item = costmap_item(
        "local_costmap", 4, GridSpec(3, 2, 0.05, 1.0), costs, Pose2D(10, 20, math.pi / 2)
    )
    assert item.key == "local_costmap/4"
    assert item.data == pytest.approx(
        {"x": 10.0, "y": 21.0, "yaw": math.pi / 2, "resolution_m": 0.05}
    )
    assert item.arrays["costs"] is costs


def test_lines_have_x_and_y_alone():
    plan = np.array([[1.0, 2.0, 0.5], [3.0, 4.0, 0.5]])
    assert line_item("plan", 0, plan).arrays["points"].tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert line_item("plan", 0, np.zeros((0, 3))).arrays["points"].shape == (0, 2)


def test_trails_keep_spaced_points():
    trails = Trails()
    for x_m in (0.0, 0.05, 0.11, 0.2, 0.25, math.nan):
        trails.add(3, x_m, 1.0)
    (trail,) = trails.items([0, 3])
    assert trail.key == "trail/3"
    assert trail.arrays["points"][:, 0] == pytest.approx([0.0, 0.11, 0.25])
    assert trails.items([3]) == []  # it has not grown
    for k in range(TRAIL_POINTS):
        trails.add(3, 1.0 + k, 1.0)
    (trail,) = trails.items([3])
    assert trail.arrays["points"][:, 0].tolist() == [1.0 + k for k in range(TRAIL_POINTS)]
    trails.clear()
    assert trails.items([3]) == []


def test_tracks_and_their_velocities_are_turned_into_map():
    """The frame is at (1, 2), and its x axis is the map's y axis."""
    item = track_item(3, [(4.0, 0.0, 0.5, 0.0, 0.3, 2.0)], Pose2D(1.0, 2.0, math.pi / 2))
    assert item.key == "track/3" and item.arrays["rows"].dtype == np.float32
    assert item.arrays["rows"][0].tolist() == pytest.approx([1.0, 6.0, 0.0, 0.5, 0.3, 2.0])
    assert track_item(0, np.empty((0, 6))).arrays["rows"].shape == (0, 6)


def test_cell_ends_half_way_less_the_safety_radius():
    """The peer is 4 m to the right: the border is 2 m less 0.5 m away."""
    cell = buffered_cell(np.array([[2.0, 5.0], [6.0, 5.0]]), 0, SQUARE, 0.5)
    assert sorted(cell) == [(0.0, 0.0), (0.0, 10.0), (3.5, 0.0), (3.5, 10.0)]


def test_cell_of_a_robot_that_is_too_near_ends_at_its_centre():
    cell = buffered_cell(np.array([[2.0, 5.0], [2.6, 5.0]]), 0, SQUARE, 0.5)
    assert max(x for x, _ in cell) == 2.0


def test_cells_of_many_robots_hold_what_is_nearest():
    """Each point of the arena lies in the cell of the robot that is nearest, and in no other."""
    random = np.random.default_rng(5)
    positions = random.uniform(0.0, 10.0, (30, 2))
    cells = [buffered_cell(positions, robot, SQUARE, 0.0) for robot in range(30)]
    for point in random.uniform(0.0, 10.0, (100, 2)):
        inside = [robot for robot, cell in enumerate(cells) if contains(cell, point)]
        assert inside == [int(np.argmin(np.hypot(*(positions - point).T)))]


def contains(polygon, point):
    corners = np.array(polygon)
    edges, offsets = np.roll(corners, -1, axis=0) - corners, point - corners
    return bool((edges[:, 0] * offsets[:, 1] - edges[:, 1] * offsets[:, 0] >= 0).all())


def test_unknown_robots_have_no_cell_and_bound_none():
    positions = [[1.0, 5.0], [math.nan, math.nan]]
    (cell,) = cell_items(SCENE, positions, {0: 0.5, 1: 0.5})
    assert cell.key == "cell/0"
    assert sorted(map(tuple, cell.arrays["points"].tolist())) == [(-1, 2), (-1, 8), (7, 2), (7, 8)]


def test_goals_before_the_active_one_have_ended():
    goals = [Goal(1.0, 2.0), Goal(3.0, 4.0, 0.5), Goal(5.0, 6.0), Goal(7.0, 8.0)]
    rows = goal_rows(1, goals, 2, True, failed=[1])
    assert [row["state"] for row in rows] == ["reached", "failed", "active", "pending"]
    assert rows[1] == {"robot": 1, "index": 1, "x": 3.0, "y": 4.0, "yaw": 0.5, "state": "failed"}
    assert rows[0]["yaw"] is None
    assert goal_rows(1, goals, 2, False)[2]["state"] == "pending"


def test_yields_name_the_peer_and_the_place():
    names = ["a", "b", "c"]
    holds = YieldDecision("c", Yield.MAKE_ROOM, Pose2D(1.0, 2.0))
    assert RobotNow(yielding=holds, limited_by="b").yield_rows(0, names) == [
        {"robot": 0, "peer": 2, "kind": "makes room", "hold": [1.0, 2.0]},
        {"robot": 0, "peer": 1, "kind": "limited", "hold": None},
    ]
    (waits,) = RobotNow(yielding=YieldDecision("b", Yield.WAIT)).yield_rows(0, names)
    assert waits["kind"] == "waits"
    stranger = RobotNow(yielding=YieldDecision("stranger", Yield.WAIT), limited_by="other")
    assert stranger.yield_rows(0, names) == []


def test_contacts_have_the_number_of_the_robot():
    item = contacts_item(
        [Contact(1.5, "b", "crate", 2.0, 3.0), Contact(2.0, "x", "a", 0.0, 0.0)], ["a", "b"]
    )
    first, second = item.data["contacts"]
    assert first == {"time_s": 1.5, "robot": 1, "other": "crate", "x": 2.0, "y": 3.0}
    assert second["robot"] is None


def test_gaps_are_between_hulls():
    """Robots at 0, 2 and 5 m: the nearest are 2, 2 and 3 m away, less two radii of 0.3 m."""
    positions = np.array([[0.0, 0.0], [2.0, 0.0], [5.0, 0.0]])
    assert gaps_m(positions, 0.3) == pytest.approx([1.4, 1.4, 2.4])
    assert np.isnan(gaps_m(positions[:1], 0.3)).all()
    unknown = gaps_m(np.array([[0.0, 0.0], [math.nan, math.nan], [4.0, 0.0]]), 0.3)
    assert unknown == pytest.approx([3.4, math.nan, 3.4], nan_ok=True)


def test_samples_of_known_and_unknown_robots():
    """One robot 1 m from the western wall at 0.5 m/s, one that is unknown."""
    poses = np.full((2, 9), math.nan)
    poses[0] = [0.0, 7.0, 1.0, 0.0, 0.0, 0.0, 0.3, 0.4, 0.0]
    item = samples_item(3.0, poses, 0.3, SCENE, cycles_s=[0.02, math.nan])
    values = item.arrays["values"]
    assert values.dtype == np.float32
    assert values[0] == pytest.approx([math.nan, 0.7, 0.5, 0.02], nan_ok=True)
    assert np.isnan(values[1]).all()
    assert np.isnan(samples_item(3.0, poses, 0.3, None).arrays["values"][0, 1])


def test_clearance_is_also_that_to_moving_obstacles():
    """The person's centre is 0.9 m away: less its radius of 0.25 m and the robot's of 0.3 m."""
    poses = np.zeros((1, 9))
    poses[0, :2] = [2.0, 6.0]
    moving = STREET.moving_solids([(math.nan, math.nan, math.nan), (2.0, 6.9, 0.0)])
    assert [solid.name for solid in moving] == ["person_0"]
    item = samples_item(3.0, poses, 0.3, STREET, moving)
    assert item.arrays["values"][0, 1] == pytest.approx(0.35)


WAITS = YieldDecision("b", Yield.WAIT)
MAKES_ROOM = YieldDecision("b", Yield.MAKE_ROOM, Pose2D(0.0, 0.0))


@pytest.mark.parametrize(
    "expected, navigator, speed_mps, facts",
    [
        ("flying", "controlling", 0.2, {}),
        ("hovering", "controlling", 0.02, {}),
        ("waiting", "controlling", 0.0, {"yielding": WAITS}),
        ("making room", "planning", 0.3, {"yielding": MAKES_ROOM}),
        ("recovering", "clearing", 0.3, {"yielding": WAITS}),
        ("planning", "planning", 0.0, {}),
        ("idle", "idle", 0.0, {}),
        ("done", "idle", 0.0, {"is_done": True}),
        ("stopped", "controlling", 0.0, {"is_stopped": True}),
        ("lost", "controlling", 0.2, {"is_lost": True, "is_stopped": True}),
        ("stopped", "controlling", 0.2, {"has_ended": True}),
    ],
)
def test_state_is_the_first_that_is_true(expected, navigator, speed_mps, facts):
    assert RobotNow(navigator, **facts).state(speed_mps) == expected


def test_unknown_numbers_are_none():
    row = RobotNow(recoveries=(1, 4)).status_row(2, 0.5, math.nan)
    assert row.get("goal_distance") is row["gap_m"] is row["goal"] is None
    assert (row["speed_mps"], row["recoveries"]) == (0.5, [1, 4])
    assert flight_item("ros", "room", "running", 1.0, rate=math.inf).data["rate"] is None


def test_the_page_knows_every_shape():
    script = (Path(quad_web.__file__).parent / "static" / "orbit_scene.js").read_text()
    (table,) = re.findall(r"^const GEOMETRIES = \{\n(.*?)^\};", script, re.M | re.S)
    assert set(re.findall(r"^  (\w+):", table, re.M)) == set(SHAPES)
