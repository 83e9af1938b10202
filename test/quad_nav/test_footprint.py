from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav import footprint as footprints
from quad_nav.geometry import Pose2D

RECTANGLE = [(0.3, 0.2), (0.3, -0.2), (-0.25, -0.2), (-0.25, 0.2)]
PADDING = float(np.float32(0.01))


def test_circle_has_sixteen_points_counter_clockwise():
    points = footprints.circle(2.0)
    assert points.shape == (16, 2)
    np.testing.assert_allclose(
        points[[0, 2, 4, 8]], [(2, 0), (math.sqrt(2), math.sqrt(2)), (0, 2), (-2, 0)], atol=1e-12
    )


def test_padding_moves_coordinates_away_from_zero():
    padded = footprints.pad([(0.3, -0.2), (0.0, 0.4), (-0.1, 0.0)], 0.01)
    assert padded.tolist() == [
        [0.3 + PADDING, -0.2 - PADDING],
        [0.0, 0.4 + PADDING],
        [-0.1 - PADDING, 0.0],
    ]


def test_circle_of_the_tutorial_is_wider_than_its_radius():
    # cos(pi / 2) is not quite zero, so the four points on the axes are padded sideways too.
    inscribed_m, circumscribed_m = footprints.radii(footprints.pad(footprints.circle(0.35), 0.01))
    assert inscribed_m == pytest.approx(0.353021, abs=5e-7)
    assert circumscribed_m == pytest.approx(0.364142, abs=5e-7)


def test_radii_of_a_rectangle():
    assert footprints.radii(RECTANGLE) == pytest.approx((0.2, math.hypot(0.3, 0.2)))


def test_inscribed_radius_when_the_origin_is_outside():
    assert footprints.radii([(1.0, 1.0), (3.0, 1.0), (3.0, -1.0), (1.0, -1.0)]) == pytest.approx(
        (1.0, math.hypot(3.0, 1.0))
    )


def test_nearest_corner_when_the_foot_of_the_perpendicular_is_outside_every_edge():
    assert footprints.radii([(3.0, 4.0), (6.0, 4.0), (6.0, 8.0)])[0] == 5.0


@pytest.mark.parametrize("points", [[], [(1.0, 1.0)], [(1.0, 1.0), (2.0, 0.0)]])
def test_fewer_than_three_points_have_no_radii(points):
    assert footprints.radii(points) == (0.0, 0.0)


def test_a_point_thrice_is_no_edge():
    assert footprints.radii([(3.0, 4.0)] * 3) == (5.0, 5.0)


def test_oriented_turns_then_moves():
    turned = footprints.oriented([(1.0, 0.0), (0.0, 2.0)], Pose2D(10.0, 20.0, math.pi / 2))
    np.testing.assert_allclose(turned, [(10.0, 21.0), (8.0, 20.0)], atol=1e-12)
