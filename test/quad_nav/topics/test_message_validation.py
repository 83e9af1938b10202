"""Invalid messages are dropped; valid ones do not harm the costmaps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quad_nav.costmap.projection import scan_points, transform_points
from quad_nav.geometry import Pose3D, Scan, Twist2D
from quad_nav.topics import validation

HERE = Pose3D(1.0, 2.0, 1.0)
ANY = st.floats(width=32)
ODD = st.one_of(st.sampled_from([math.nan, math.inf, -math.inf, 0.0, 3.4e38, -1e-40]), ANY)


def scan(angle_min_rad=-3.0, increment_rad=0.01, low_m=0.02, high_m=60.0, ranges=(1.0, 2.0)):
    return Scan(1.0, angle_min_rad, increment_rad, low_m, high_m, np.array(ranges, np.float32))


@pytest.mark.parametrize(
    "odd",
    [
        *({"angle_min_rad": value} for value in (math.nan, 1e30)),
        *({"increment_rad": value} for value in (math.inf, 0.0, 1e30)),
        *({"low_m": value} for value in (-math.inf, -1.0, 60.0)),
        *({"high_m": value} for value in (math.nan, -1.0)),
        *({"ranges": value} for value in ((), np.ones(validation.MAX_BEAMS + 1))),
    ],
)
def test_invalid_scans(odd):
    assert validation.scan_problem(scan(**odd))


@settings(max_examples=300, deadline=None, derandomize=True)
@given(ODD, ODD, ODD, ODD, st.lists(ODD, max_size=20), st.booleans())
def test_valid_scans_give_at_most_a_point_per_beam(low_rad, step_rad, low_m, high_m, ranges, inf):
    accepted = scan(low_rad, step_rad, low_m, high_m, ranges)
    if validation.scan_problem(accepted):
        return
    with np.errstate(all="ignore"):
        points = scan_points(accepted, inf)
        moved = transform_points(points, Pose3D(1.0, 2.0, 1.0), 0.1, 2.0)
    assert len(moved) <= len(points) <= len(ranges)


def test_valid_messages():
    assert validation.scan_problem(scan(ranges=[math.nan, math.inf, -1.0])) == ""
    assert validation.scan_problem(scan(high_m=math.inf)) == ""
    assert validation.scan_problem(scan(increment_rad=0.0, ranges=[1.0])) == ""
    assert validation.path_problem(np.array([[1.0, 2.0]])) == ""
    assert validation.grid_problem(3, 2, 0.05, 6) == ""


@pytest.mark.parametrize(
    "frame, pose, twist, problem",
    [
        ("odom0", HERE, Twist2D(0.1), ""),
        ("", HERE, Twist2D(), "frame '', expected"),
        ("o" * 201, HERE, Twist2D(), "frame 'ooo"),
        ("odom0", Pose3D(math.nan, 2.0, 1.0), Twist2D(), "position (nan, 2, 1) m"),
        ("odom0", Pose3D(1.0, -math.inf, 1e7), Twist2D(), "position (1, -inf, 1e+07) m"),
        ("odom0", Pose3D(1.0, 2.0, 1.0, (0.0, 0.0, 0.0, 0.0)), Twist2D(), "quaternion of length 0"),
        ("odom0", Pose3D(1.0, 2.0, 1.0, (0.0, 0.0, 0.0, math.nan)), Twist2D(), "length nan"),
        ("odom0", HERE, Twist2D(0.0, 0.0, math.nan), "velocity (0.0, 0.0, nan)"),
        ("odom0", HERE, Twist2D(0.0, 1e300), "expected finite numbers"),
    ],
)
def test_odometry(frame, pose, twist, problem):
    found = validation.odometry_problem(frame, pose, twist)
    assert problem in found and bool(found) == bool(problem)


def test_invalid_paths():
    assert "not finite" in validation.path_problem(np.array([[1.0, math.nan]]))
    assert "at most" in validation.path_problem(np.zeros((validation.MAX_POSES + 1, 2)))


@pytest.mark.parametrize(
    "changed, problem",
    [
        ({"width": 0, "values": 0}, "0 x 2 cells"),
        ({"width": 2**32 - 1, "height": 2**32 - 1}, "expected 1 to"),
        ({"values": 5}, "5 values for 3 x 2 cells"),
        ({"resolution_m": math.nan}, "resolution nan m"),
        ({"resolution_m": 1e-300}, "resolution 1e-300 m"),
        ({"origin_m": (math.nan, 0.0)}, "origin"),
        ({"origin_m": (0.0, 1e7)}, "origin"),
    ],
)
def test_invalid_maps(changed, problem):
    grid = {"width": 3, "height": 2, "resolution_m": 0.05, "values": 6, **changed}
    assert problem in validation.grid_problem(**grid)


def test_stamps_and_ids():
    assert validation.stamp_problem(11.0, 10.0) == validation.stamp_problem(0.0, 10.0) == ""
    assert "1.50 s ahead of the clock" in validation.stamp_problem(11.5, 10.0)
    assert validation.goal_id_problem("a" * 256, 10.0, 10.0) == ""
    assert "a ... (1000000 characters)'" in validation.goal_id_problem("a" * 10**6, 0.0, 0.0)
    assert "ahead of the clock" in validation.goal_id_problem("a", 4.29e9, 10.0)


def test_one_node_at_a_time_controls_a_quadcopter_while_its_commands_are_in_force():
    lease, first, other = validation.CommandLease(0.6), "/move_base0", "/rogue"
    assert lease.holder(0, first, 1.0) == first
    assert lease.holder(0, other, 1.5) == first and lease.holder(1, other, 1.5) == other
    assert lease.holder(0, first, 1.55) == first
    assert lease.holder(0, other, 2.14) == first
    assert lease.holder(0, other, 2.15) == lease.holder(0, first, 2.2) == other
    lease.clear()
    assert lease.holder(0, first, 2.3) == first
