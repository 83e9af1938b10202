"""Other people's lists of waypoints: each format, and the line of each fault."""

import json
import math

import pytest

from quad_nav.errors import InputError
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import parse_goals
from quad_nav.mission.qgroundcontrol import local_position

HALF = math.sqrt(0.5)  # z and w of a quaternion of 90 degrees
EAST, NORTH = Goal(1.0, 2.0, 0.0), Goal(3.0, -4.0, math.pi / 2)
POSE_1 = "position: {x: 1.0, y: 2.0, z: 0.0}"
POSE_2 = "position: {x: 3.0, y: -4.0, z: 0.0}"
ROTATION_1 = "orientation: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}"
ROTATION_2 = f"orientation: {{x: 0.0, y: 0.0, z: {HALF}, w: {HALF}}}"
ECHO = f"""header:
  seq: 3
  stamp: {{secs: 12, nsecs: 0}}
  frame_id: "map"
pose:
  {POSE_1}
  {ROTATION_1}
---
header: {{seq: 4, frame_id: "map"}}
pose:
  {POSE_2}
  {ROTATION_2}
---
"""

ROTATED = {
    "PoseArray": f"""header: {{frame_id: map}}
poses:
- {POSE_1}
  {ROTATION_1}
- {POSE_2}
  {ROTATION_2}
""",
    "Path": f"""poses:
- header: {{frame_id: map}}
  pose:
    {POSE_1}
    {ROTATION_1}
- pose: {{{POSE_2}, {ROTATION_2}}}
""",
    "echoed PoseStamped": ECHO,
    "echoed MoveBaseActionGoal": f"""goal: {{target_pose: {{pose: {{{POSE_1}, {ROTATION_1}}}}}}}
---
goal: {{target_pose: {{pose: {{{POSE_2}, {ROTATION_2}}}}}}}
""",
    "Nav2's panel": f"""waypoints:
  waypoint0:
    pose: [1.0, 2.0, 0.0]
    orientation: [1.0, 0.0, 0.0, 0.0]
  waypoint1:
    pose: [3.0, -4.0, 0.0]
    orientation: [{HALF}, 0.0, 0.0, {HALF}]
""",
    "Nav2's parameters": f"""waypoint_follower:
  ros__parameters:
    waypoints:
      wp1: [1.0, 2.0, 0.0]
      wp2: [3.0, -4.0, {math.pi / 2}]
""",
    "lists of seven": f"waypoints:\n- [1, 2, 0, 0, 0, 0, 1]\n- [3, -4, 0, 0, 0, {HALF}, {HALF}]\n",
    "position and rotation": f"""- name: start
  position: [1.0, 2.0, 0.0]
  orientation: [0.0, 0.0, 0.0, 1.0]
- name: end
  position: [3.0, -4.0, 0.0]
  orientation: [0.0, 0.0, {HALF}, {HALF}]
""",
    "names": f"kitchen: {{x: 1, y: 2, theta: 0}}\ndoor: {{x: 3, y: -4, theta: {math.pi / 2}}}\n",
    "planar quaternions": f"""- {{x: 1, y: 2, z: 0, w: 1}}
- {{x: 3, y: -4, z: {HALF}, w: {HALF}}}
""",
    "Euler angles": f"""waypoints:
- {{id: 1, position: {{x: 1, y: 2}}, euler_angle: {{z: 0}}}}
- {{id: 2, position: {{x: 3, y: -4}}, euler_angle: {{z: {math.pi / 2}}}}}
""",
    "columns": f"easting: [1, 3]\nnorthing: [2, -4]\nyaw: [0, {math.pi / 2}]\n",
    "a pose of the map beside": f"""server:
  position: {{x: 7, y: 8}}
  waypoints:
  - {{x: 1, y: 2, yaw: 0.0}}
  - {{x: 3, y: -4, yaw: {math.pi / 2}}}
""",
    "JSON": json.dumps(
        {"goals": [{"x": 1, "y": 2, "theta": 0}, {"x": 3, "y": -4, "theta": math.pi / 2}]}
    ),
    "JSON list with tabs": f"[\n\t[1, 2, 0],\n\t[3, -4, {math.pi / 2}]\n]",
    "YAML in braces": f"[\n{{X: 1, Y: 2, theta: 0}},\n{{X: 3, Y: -4, theta: {math.pi / 2}}}\n#]\n]",
    "follow_waypoints": f"1.0,2.0,0.0,0.0,0.0,0.0,1.0\n3.0,-4.0,0.0,0.0,0.0,{HALF},{HALF}\n",
    "seven columns and more": f"1,2,0,0,0,0,1,0,3\n3,-4,0,0,0,{HALF},{HALF},0,3\n",
    "x, y, yaw": f"1 2 0\n3 -4 {math.pi / 2}\n",
    "x, y, z, yaw": f"1;2;0;0\n\n3;-4;0;{math.pi / 2};\n",
    "a header": "name,y,x,theta_deg\nkitchen,2,1,0\ndoor,-4,3,90\n",
    "a header in a comment": "# s_m; x_m; y_m; yaw [deg]\n0; 1; 2; 0\n9; 3; -4; -270\n",
    "rostopic echo -p": "%time,field.pose.position.x,field.pose.position.y,"
    f"field.pose.orientation.z,field.pose.orientation.w\n1,1,2,0,1\n2,3,-4,{HALF},{HALF}\n",
}
POSITIONS = {
    "points": "waypoints:\n- point: {x: 1, y: 2, z: 0}\n- point: {x: 3, y: -4, z: 0}\n",
    "clicked points": "header: {seq: 1}\npoint: {x: 1, y: 2}\n---\npoint: {x: 3, y: -4}\n---\n",
    "rotations never set": f"""poses:
- {POSE_1}
  orientation: {{x: 0, y: 0, z: 0, w: 0}}
- {POSE_2}
""",
    "pairs": "[[1, 2], [3, -4]]",
    "x, y": "1, 2\n3, -4\n",
    "x, y with names": "x,y\n1e0,2\n3,-4,\n",
    "yaws that are empty": "x; y; yaw; command\n1; 2;; wait\n3;-4;\n",
    "odometry": """pose: {pose: {position: {x: 1, y: 2}}}
twist: {twist: {linear: {x: 9, y: 9}}}
---
pose: {pose: {position: {x: 3, y: -4}}}
""",
}


def read(text, robot=0):
    return parse_goals(text, "list", robot=robot)


def faults(text):
    with pytest.raises(InputError) as caught:
        read(text)
    return caught.value.problems


@pytest.mark.parametrize("name", ROTATED)
def test_a_list_with_rotations(name):
    sequence = read(ROTATED[name])
    assert [(one.x_m, one.y_m) for one in sequence.goals] == [(1.0, 2.0), (3.0, -4.0)]
    assert [one.yaw_rad for one in sequence.goals] == pytest.approx([0.0, math.pi / 2])
    assert sequence.read_as.startswith("read as ") and "2 goals" in sequence.read_as


@pytest.mark.parametrize("name", POSITIONS)
def test_a_list_of_positions(name):
    assert read(POSITIONS[name]).goals == (Goal(1.0, 2.0), Goal(3.0, -4.0))


def test_waits_and_heights_and_frames():
    sequence = read("- {x: 1, y: 2, z: 1.5, wait_time: 3}\n- {x: 3, y: 4, frame_id: odom}\n")
    assert sequence.goals == (Goal(1.0, 2.0, wait_s=3.0), Goal(3.0, 4.0))
    assert sequence.read_as == (
        "read as waypoints in YAML or JSON: 2 goals; heights (z) left out; frame odom taken as map"
    )


def test_the_columns_of_a_table_are_named():
    assert read("1,2,0.5\n3,4,0.1\n").read_as == (
        "read as a table without names, of the columns x, y, yaw: 2 goals"
    )


def test_degrees_taken_for_metres_are_noticed():
    assert (
        "all of them within 0.00014 m: expected metres"
        in read("easting: [8.6815056, 8.6816464]\nnorthing: [47.4503488, 47.4503328]\n").read_as
    )


# -- fleets -------------------------------------------------------------------------------

TUW = """tuw_multi_robot_msgs::RobotGoalsArray @1970-01-01T00:01:38.200000
frame_id: map
  1537351493,    493800055
robot_0
   -0.00,    -5.00,    0,    0,    0,    0,    1
robot_1
   -2.00,    -6.20,    0,    1.5
    2.00,    -3.75,    0,    0,    0,    0,    1
"""
FLEETS = {
    "tuw_multi_robot": TUW,
    "lists by names": """robot_1: {goals: [[-2, -6.2, 1.5], [2, -3.75, 0]]}
robot_0: {goals: [[0, -5, 0]]}
""",
    "a list of robots": """robots:
- {name: robot_0, destinations: [{x: 0, y: -5, yaw: 0}]}
- {name: robot_1, destinations: [{x: -2, y: -6.2, yaw: 1.5}, {x: 2, y: -3.75, yaw: 0}]}
""",
    "JSON": '{"robot_0": [[0, -5, 0]], "robot_1": [[-2, -6.2, 1.5], [2, -3.75, 0]]}',
    "lists of lists": "[[[0, -5, 0]], [[-2, -6.2, 1.5], [2, -3.75, 0]]]",
}


@pytest.mark.parametrize("name", FLEETS)
def test_the_goals_of_a_fleet(name):
    assert read(FLEETS[name]).goals == (Goal(0.0, -5.0, 0.0),)
    assert read(FLEETS[name], 1).goals == (Goal(-2.0, -6.2, 1.5), Goal(2.0, -3.75, 0.0))
    with pytest.raises(InputError, match="list: has goals of 2 robots; expected one for each of 3"):
        read(FLEETS[name], 2)


def test_a_robot_of_a_fleet_is_named():
    assert "2 goals of robot_1, one of 2 robots" in read(TUW, 1).read_as


# -- QGroundControl -----------------------------------------------------------------------

HOME = (47.0, 8.0)
WPL = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t47.0\t8.0\t400\t1

# take off
1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t10\t1
2\t0\t3\t16\t5\t0\t0\t0\t47.0009\t8.0\t10\t1
3\t0\t3\t16\t0\t0\t0\t90\t47.0\t8.0013\t10\t1
4\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""


def item(command, lat, lon, hold=0, heading=None):
    params = [hold, 0, 0, heading, lat, lon, 10]
    return {"type": "SimpleItem", "command": command, "frame": 3, "params": params}


def plan(items, home=(*HOME, 400)):
    return json.dumps(
        {"fileType": "Plan", "mission": {"items": items, "plannedHomePosition": list(home)}},
        indent="\t",
    )


SURVEY = {
    "type": "ComplexItem",
    "complexItemType": "survey",
    "TransectStyleComplexItem": {"Items": [item(16, 47.0, 8.0013, heading=90)]},
}
PLAN = plan([item(22, 47.0, 8.0), item(16, 47.0009, 8.0, 5), SURVEY])


def test_a_degree_on_the_ellipsoid():
    # Radii of curvature of WGS 84 at 47 degrees: 6369 km along the meridian, 6390 km across it.
    east_m, north_m = local_position((47.0009, 8.0), HOME)
    assert (east_m, north_m) == pytest.approx((0.0, math.radians(0.0009) * 6369_640), abs=0.01)
    east_m, north_m = local_position((47.0, 8.0013), HOME)
    across_m = math.radians(0.0013) * 6389_584 * math.cos(math.radians(47.0))
    assert (east_m, north_m) == pytest.approx((across_m, 0.0), abs=0.01)


@pytest.mark.parametrize("text, left_out", [(WPL, "20, 22"), (PLAN, "22")])
def test_a_mission_of_qgroundcontrol(text, left_out):
    sequence = read(text)
    first, second = sequence.goals
    assert (first.x_m, first.y_m) == pytest.approx((0.0, 100.05), abs=0.02)
    assert (second.x_m, second.y_m) == pytest.approx((98.87, 0.0), abs=0.02)
    assert (first.yaw_rad, first.wait_s, second.wait_s) == (None, 5.0, 0.0)
    assert second.yaw_rad == pytest.approx(0.0)  # 90 degrees of a compass
    assert "(0, 0) is home, lat 47.0000000, lon 8.0000000" in sequence.read_as
    assert f"commands left out: {left_out}" in sequence.read_as


def test_the_first_waypoint_is_the_datum_without_home():
    for text in (plan([item(16, 47.0, 8.0)], (0, 0, 0)), "lat,lon\n47.0,8.0\n"):
        sequence = read(text)
        assert sequence.goals == (Goal(0.0, 0.0),)
        assert "(0, 0) is the first waypoint, lat 47" in sequence.read_as


# -- faults -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text, problem",
    [
        ("x,y\n1,2\n3,b\n", "line 3 (goal 2): y is 'b'; expected a finite number"),
        ("x,y\n1,2\n3\n", "line 3 (goal 2): has 1 columns; expected 2"),
        ("1,2\n3,nan\n", "line 2 (goal 2): y is 'nan'; expected a finite number"),
        ("1,2\n3,4,5\n", "line 2 (goal 2): has 3 columns; expected 2"),
        ("1,2,3,4,5\n", "line 1: 5 columns without names; expected 2 (x, y), 3 (x, y, yaw)"),
        ("a,b\n1,2\n", "line 1: a, b; expected the names of columns, x and y among them"),
        ("1,2,90\n", "line 1 (goal 1): yaw is 90; expected radians, or a name with a unit"),
        ("- {x: 1, y: 2}\n- {x: 3}\n", "line 2 (goal 2): has no y; expected a number of metres"),
        ("a: {x: 1, y: 2}\nb: {x: 3}\n", "line 2 (goal 2): has no y; expected a number of metres"),
        ("x: [1, 2]\ny: [3]\n", "line 1 (goal 2): has no y; expected a number of metres"),
        ("- [1, 2]\n- home\n", "line 2 (goal 2): is no waypoint; expected x and y"),
        ("- {x: 1, y: 2, yaw: up}\n", "line 1 (goal 1): yaw is 'up'; expected a finite number"),
        (
            "- {position: {x: 1, y: 2}, orientation: {x: 1, y: 0, z: 0, w: 1}}\n",
            "line 1 (goal 1): the rotation (1, 0, 0, 1) tilts the robot; expected a quaternion",
        ),
        ("- {x: 1e7, y: 0}\n", "line 1 (goal 1): x is 1e+07; expected 1e+06 metres at most"),
        ("a: {x: 1, y: 2}\na: {x: 3, y: 4}\n", "line 2, column 1: key 'a' twice"),
        ("waypoints:\n- x: 1\n y: 2\n", "line 3, column 2: "),
        ("QGC WPL 110\n0 1 0 16\n", "line 2: '0 1 0 16'; expected 12 numbers"),
        (
            WPL.replace("\t3\t16", "\t2\t16", 1),
            "line 6 (goal 1): lat 47.0009, lon 8.0 in frame 2.0",
        ),
        (plan([item(16, 0, 0)]), "line 5 (goal 1): lat 0, lon 0 in frame 3; expected degrees"),
        (
            plan([item(22, 47.0, 8.0)]),
            "has 0 waypoints; commands left out: 22; expected 1 to 10000",
        ),
        (
            plan([{"complexItemType": "survey"}]),
            "line 5: survey has neither; expected seven params, or the Items",
        ),
        (TUW.replace("robot_0\n", ""), "line 4: a goal; expected the name of its robot before it"),
        (TUW + "robot_2\n", "robot_2: has no goals; expected one"),
        ("a: \x00", "not YAML: unacceptable character"),
        ("x,y\n", "has 0 waypoints; expected 1 to 10000"),
        ("lat,lon\n91,8\n", "line 2 (goal 1): lat 91, lon 8; expected degrees"),
    ],
)
def test_each_fault_has_its_line(text, problem):
    (found,) = faults(text)
    assert found.startswith(f"list: {problem}")


def test_all_faults_come_at_once():
    assert [one.partition(" (")[0] for one in faults("x,y\na,2\n1,2\n1,b\n")] == [
        "list: line 2",
        "list: line 4",
    ]
