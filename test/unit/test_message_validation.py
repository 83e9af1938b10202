"""Messages of anybody's: what is dropped, and that the rest does the costmaps no harm."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quad_nav.costmap.projection import scan_points, transform_points
from quad_nav.geometry import Pose3D, Scan, Twist2D
from quad_nav.topics import incoming

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
        scan(ranges=np.ones(incoming.MAX_BEAMS + 1)),
    ],
)
def test_scans_that_are_dropped(odd):
    assert incoming.scan_problem(odd)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(ODD, ODD, ODD, ODD, st.lists(ODD, max_size=20), st.booleans())
def test_scans_that_are_taken_give_a_point_a_beam(low_rad, step_rad, low_m, high_m, ranges, inf):
    taken = scan(low_rad, step_rad, low_m, high_m, ranges)
    if incoming.scan_problem(taken):
        return
    with np.errstate(all="ignore"):
        points = scan_points(taken, inf)
        moved = transform_points(points, Pose3D(1.0, 2.0, 1.0), 0.1, 2.0)
    assert len(moved) <= len(points) <= len(ranges)


def test_usual_messages_are_taken():
    assert incoming.scan_problem(scan(ranges=[math.nan, math.inf, -1.0])) == ""
    assert incoming.scan_problem(scan(high_m=math.inf)) == ""
    assert incoming.pose_problem(Pose3D(1.0, 2.0, 3.0)) == ""
    assert incoming.twist_problem(Twist2D(0.3, 0.0, -1.0)) == ""
    assert incoming.path_problem(np.array([[1.0, 2.0]])) == ""
    assert incoming.grid_problem(3, 2, 0.05, 6) == ""


@pytest.mark.parametrize(
    "pose, problem",
    [
        (Pose3D(math.nan, 0.0, 0.0), "is not on this earth"),
        (Pose3D(0.0, 0.0, math.inf), "is not on this earth"),
        (Pose3D(0.0, 1e7, 0.0), "is not on this earth"),
        (Pose3D(0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0)), "has the length 0, expected 1"),
        (Pose3D(0.0, 0.0, 0.0, (math.nan, 0.0, 0.0, 1.0)), "has the length nan"),
    ],
)
def test_poses_that_are_dropped(pose, problem):
    assert problem in incoming.pose_problem(pose)


@pytest.mark.parametrize("twist", [Twist2D(math.nan), Twist2D(0.0, math.inf), Twist2D(0, 0, 1e300)])
def test_velocities_that_are_dropped(twist):
    assert "holds what is no finite number" in incoming.twist_problem(twist)


def test_ways_that_are_dropped():
    assert "not finite" in incoming.path_problem(np.array([[1.0, math.nan]]))
    assert "at most" in incoming.path_problem(np.zeros((incoming.MAX_POSES + 1, 2)))


@pytest.mark.parametrize(
    "width, height, resolution_m, values, problem",
    [
        (0, 5, 0.05, 0, "0 x 5 cells"),
        (2**32 - 1, 2**32 - 1, 0.05, 1, "expected 1 to"),
        (3, 2, 0.05, 5, "5 values for 3 x 2 cells"),
        (1, 1, 0.0, 1, "cells of 0 m"),
        (1, 1, math.nan, 1, "cells of nan m"),
    ],
)
def test_maps_that_are_dropped(width, height, resolution_m, values, problem):
    assert problem in incoming.grid_problem(width, height, resolution_m, values)
