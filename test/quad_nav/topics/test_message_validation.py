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

ANY = st.floats(width=32)
ODD = st.one_of(st.sampled_from([math.nan, math.inf, -math.inf, 0.0, 3.4e38, -1e-40]), ANY)


def scan(angle_min_rad=-3.0, increment_rad=0.01, low_m=0.02, high_m=60.0, ranges=(1.0, 2.0)):
    return Scan(1.0, angle_min_rad, increment_rad, low_m, high_m, np.array(ranges, np.float32))


@pytest.mark.parametrize(
    "odd",
    [
        scan(math.nan),
        scan(increment_rad=math.inf),
        scan(low_m=-math.inf),
        scan(high_m=math.nan),
        scan(ranges=np.ones(validation.MAX_BEAMS + 1)),
        scan(ranges=[]),
        scan(increment_rad=0.0),
        scan(increment_rad=1e30),
        scan(1e30),
        scan(low_m=60.0, high_m=0.02),
        scan(low_m=-1.0),
        scan(high_m=-1.0),
    ],
)
def test_invalid_scans(odd):
    assert validation.scan_problem(odd)


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
    assert validation.pose_problem(Pose3D(1.0, 2.0, 3.0)) == ""
    assert validation.twist_problem(Twist2D(0.3, 0.0, -1.0)) == ""
    assert validation.path_problem(np.array([[1.0, 2.0]])) == ""
    assert validation.grid_problem(3, 2, 0.05, 6) == ""


@pytest.mark.parametrize(
    "pose, problem",
    [
        (Pose3D(math.nan, 0.0, 0.0), "expected finite coordinates"),
        (Pose3D(0.0, 0.0, math.inf), "expected finite coordinates"),
        (Pose3D(0.0, 1e7, 0.0), "expected finite coordinates"),
        (Pose3D(0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0)), "quaternion of length 0, expected 1"),
        (Pose3D(0.0, 0.0, 0.0, (math.nan, 0.0, 0.0, 1.0)), "quaternion of length nan"),
    ],
)
def test_invalid_poses(pose, problem):
    assert problem in validation.pose_problem(pose)


@pytest.mark.parametrize("twist", [Twist2D(math.nan), Twist2D(0.0, math.inf), Twist2D(0, 0, 1e300)])
def test_invalid_velocities(twist):
    assert "expected finite numbers" in validation.twist_problem(twist)


def test_invalid_paths():
    assert "not finite" in validation.path_problem(np.array([[1.0, math.nan]]))
    assert "at most" in validation.path_problem(np.zeros((validation.MAX_POSES + 1, 2)))


@pytest.mark.parametrize(
    "width, height, resolution_m, values, problem",
    [
        (0, 5, 0.05, 0, "0 x 5 cells"),
        (2**32 - 1, 2**32 - 1, 0.05, 1, "expected 1 to"),
        (3, 2, 0.05, 5, "5 values for 3 x 2 cells"),
        (1, 1, 0.0, 1, "resolution 0 m"),
        (1, 1, math.nan, 1, "resolution nan m"),
        (1, 1, 1e-300, 1, "resolution 1e-300 m"),
        (1, 1, 1e30, 1, "expected 0.001 to 100"),
    ],
)
def test_invalid_maps(width, height, resolution_m, values, problem):
    assert problem in validation.grid_problem(width, height, resolution_m, values)


@pytest.mark.parametrize("origin_m", [(math.nan, 0.0), (0.0, -math.inf), (1e7, 0.0)])
def test_invalid_origins_of_maps(origin_m):
    assert "origin" in validation.grid_problem(1, 1, 0.05, 1, origin_m)


def test_stamps_and_ids():
    assert validation.stamp_problem(11.0, 10.0) == validation.stamp_problem(0.0, 10.0) == ""
    assert "1.50 s ahead of the clock" in validation.stamp_problem(11.5, 10.0)
    assert validation.goal_id_problem("a" * 256, 10.0, 10.0) == ""
    assert "a ... (1000000 characters)'" in validation.goal_id_problem("a" * 10**6, 0.0, 0.0)
    assert "ahead of the clock" in validation.goal_id_problem("a", 4.29e9, 10.0)


@pytest.mark.parametrize(
    "frame, pose, twist, problem",
    [
        ("odom0", Pose3D(1.0, 2.0, 1.0), Twist2D(0.1), ""),
        ("", Pose3D(1.0, 2.0, 1.0), Twist2D(), "frame '', expected"),
        ("o" * 201, Pose3D(1.0, 2.0, 1.0), Twist2D(), "frame 'ooo"),
        ("odom0", Pose3D(math.nan, 2.0, 1.0), Twist2D(), "position (nan, 2, 1) m"),
        ("odom0", Pose3D(1.0, -math.inf, 1.0), Twist2D(), "position (1, -inf, 1) m"),
        ("odom0", Pose3D(1.0, 2.0, 1e300), Twist2D(), "position (1, 2, 1e+300) m"),
        ("odom0", Pose3D(1.0, 2.0, 1.0, (0.0, 0.0, 0.0, 0.0)), Twist2D(), "quaternion of length 0"),
        ("odom0", Pose3D(1.0, 2.0, 1.0, (0.0, 0.0, 0.0, math.nan)), Twist2D(), "length nan"),
        ("odom0", Pose3D(1.0, 2.0, 1.0, (1e200, 0.0, 0.0, 0.0)), Twist2D(), "length inf"),
        ("odom0", Pose3D(1.0, 2.0, 1.0), Twist2D(0.0, 0.0, math.nan), "velocity (0.0, 0.0, nan)"),
    ],
)
def test_odometry(frame, pose, twist, problem):
    found = validation.odometry_problem(frame, pose, twist)
    assert found.startswith(problem) if problem.startswith("frame") else problem in found
    assert bool(found) == bool(problem)
