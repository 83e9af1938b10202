from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.geometry import (
    Pose2D,
    Pose3D,
    quaternion_from_euler,
    quaternion_from_yaw,
    yaw_rotations,
)

LEFT = Pose2D(1.0, 2.0, math.pi / 2)  # at (1, 2), faces along y
SLANTED = Pose2D(-3.0, 0.5, 0.7)


def planar(x_m, y_m, yaw_rad=0.0):
    """Compare a pose with numbers worked out by hand."""
    return pytest.approx((x_m, y_m, yaw_rad), abs=1e-12)


def row(pose):
    return pose.x_m, pose.y_m, pose.yaw_rad


def test_a_point_ahead_and_to_the_left_of_a_robot_that_faces_along_y():
    assert LEFT.transform(3.0, 0.0) == pytest.approx((1.0, 5.0))
    assert LEFT.transform(0.0, 3.0) == pytest.approx((-2.0, 2.0))


def test_a_velocity_is_rotated_and_not_shifted():
    assert LEFT.rotate(0.5, 0.1) == pytest.approx((-0.1, 0.5))


def test_inverse_transform_of_a_place_in_the_map():
    assert LEFT.inverse_transform(1.0, 5.0) == pytest.approx((3.0, 0.0))
    assert LEFT.inverse_transform(-2.0, 2.0) == pytest.approx((0.0, 3.0))


def test_points_are_rows():
    points = np.array([[3.0, 0.0], [0.0, 3.0]])
    expected = [[1.0, 5.0], [-2.0, 2.0]]
    np.testing.assert_allclose(LEFT.transform_points(points), expected, atol=1e-12)
    np.testing.assert_allclose(
        LEFT.inverse_transform_points(np.array(expected)), points, atol=1e-12
    )


def test_no_points_stay_no_points():
    assert LEFT.transform_points(np.zeros((0, 2))).shape == (0, 2)
    assert LEFT.inverse_transform_points(np.zeros((0, 2))).shape == (0, 2)


def test_coordinates_broadcast():
    x, y = LEFT.transform(np.array([[0.0, 1.0]]), np.array([[0.0], [1.0]]))
    np.testing.assert_allclose(x, [[1.0, 1.0], [0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(y, [[2.0, 3.0], [2.0, 3.0]], atol=1e-12)


def test_compose_chains_transforms():
    # From (1, 2), facing along y: 2 m ahead, then a quarter turn to the left.
    assert row(LEFT.compose(Pose2D(2.0, 0.0, math.pi / 2))) == planar(1.0, 4.0, math.pi)
    assert row(LEFT.compose(Pose2D(0.0, 2.0))) == planar(-1.0, 2.0, math.pi / 2)


def test_compose_adds_yaws_without_normalising():
    assert Pose2D(0.0, 0.0, 3.0).compose(Pose2D(0.0, 0.0, 3.0)).yaw_rad == 6.0


def test_inverse_of_a_pose():
    assert row(LEFT.inverse()) == planar(-2.0, 1.0, -math.pi / 2)


@pytest.mark.parametrize("pose", [LEFT, SLANTED, Pose2D(0.0, 0.0), Pose2D(5.0, -1.0, -3.0)])
def test_a_pose_and_its_inverse_cancel(pose):
    assert row(pose.compose(pose.inverse())) == planar(0.0, 0.0)
    assert row(pose.inverse().compose(pose)) == planar(0.0, 0.0)


def test_relative_to_is_the_inverse_of_compose():
    assert row(Pose2D(1.0, 5.0, math.pi).relative_to(LEFT)) == planar(3.0, 0.0, math.pi / 2)
    assert row(LEFT.compose(SLANTED).relative_to(LEFT)) == pytest.approx(row(SLANTED))


def test_transforms_of_a_plane_are_those_of_space():
    spatial = Pose3D(-3.0, 0.5, 2.0, quaternion_from_yaw(0.7))
    points = np.array([[1.0, 2.0], [-0.3, 4.0]])
    in_space = spatial.transform_points(np.column_stack((points, [0.0, 1.0])))
    np.testing.assert_allclose(in_space[:, :2], SLANTED.transform_points(points))
    np.testing.assert_allclose(in_space[:, 2], [2.0, 3.0])


def test_points_in_space_pitched_down():
    # A quarter turn about y takes x to -z.
    pitched = Pose3D(0.0, 0.0, 1.0, quaternion_from_euler(0.0, math.pi / 2, 0.0))
    points = pitched.transform_points(np.array([[2.0, 3.0, 0.0]]))
    np.testing.assert_allclose(points, [[0.0, 3.0, -1.0]], atol=1e-12)


def test_a_pose_in_space_and_its_inverse_cancel():
    pose = Pose3D(1.0, -2.0, 0.5, quaternion_from_euler(0.3, -0.2, 1.1))
    identity = pose.compose(pose.inverse())
    np.testing.assert_allclose(identity.translation, np.zeros(3), atol=1e-12)
    np.testing.assert_allclose(identity.rotation, np.eye(3), atol=1e-12)


def test_yaw_rotations_are_those_of_quaternions():
    yaws_rad = np.array([0.0, 0.7, -2.5])
    rotations = yaw_rotations(yaws_rad)
    for yaw_rad, rotation in zip(yaws_rad.tolist(), rotations):
        expected = Pose3D(0.0, 0.0, 0.0, quaternion_from_yaw(yaw_rad)).rotation
        np.testing.assert_allclose(rotation, expected, atol=1e-12)
