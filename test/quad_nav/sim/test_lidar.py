"""LIDAR: beam pattern, ranges against walls at known distances, noise."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_nav.errors import InputError
from quad_nav.geometry import Pose3D, quaternion_from_euler, quaternion_from_yaw
from quad_nav.sim.casters import WorldCaster
from quad_nav.sim.flight import BodyState
from quad_nav.sim.lidar import LidarParams, base_from_lidar, make_scan

FOUR_BEAMS = LidarParams(step_size_rad=math.pi / 2, range_min_m=0.1, range_max_m=10.0)


class Plane:
    """A world of one infinite plane: points p with normal . p = offset."""

    def __init__(self, normal, offset_m: float):
        self.normal, self.offset_m = np.array(normal), offset_m

    def cast(self, starts_m, ends_m):
        along = (ends_m - starts_m) @ self.normal
        with np.errstate(divide="ignore", invalid="ignore"):
            fractions = (self.offset_m - starts_m @ self.normal) / along
        return np.where((fractions >= 0.0) & (fractions <= 1.0), fractions, np.inf)


def look(
    params: LidarParams, map_from_lidar: Pose3D, plane: Plane, stamp_s: float = 0.0, random=None
):
    """The scan of a LIDAR at a pose; the quadcopter is below it."""
    pose = map_from_lidar.compose(base_from_lidar.inverse())
    bodies = BodyState(np.array([[*pose.translation, *pose.quaternion, *np.zeros(6)]]))
    (distances,) = WorldCaster(params, plane.cast).cast(bodies, [0])
    return make_scan(params, stamp_s, distances, random)


def test_full_turn_has_no_beam_twice():
    params = LidarParams()
    assert params.beam_count == 512
    assert params.angle_min_rad == pytest.approx(-math.pi)
    assert params.angle_max_rad == pytest.approx(math.pi - 2.0 * math.pi / 512)


def test_half_turn_as_in_the_tutorial():
    params = LidarParams(scan_range_rad=math.pi, step_size_rad=0.006135923)
    assert params.beam_count == 512
    assert params.angle_min_rad == pytest.approx(-math.pi / 2)
    assert params.angle_max_rad == pytest.approx(math.pi / 2 - 0.006135923, abs=1e-6)


def test_beams_point_along_their_angles():
    """A wall at x = 3 seen from x = 1: beams at -180, -90, 0, 90 degrees."""
    wall = Plane([1.0, 0.0, 0.0], 3.0)
    scan = look(FOUR_BEAMS, Pose3D(1.0, 5.0, 1.0), wall, stamp_s=7.5)
    assert scan.stamp_s == 7.5
    assert scan.ranges_m.dtype == np.float32
    assert scan.ranges_m == pytest.approx([np.inf, np.inf, 2.0, np.inf])
    turned = Pose3D(1.0, 5.0, 1.0, quaternion_from_yaw(math.pi / 2))
    assert look(FOUR_BEAMS, turned, wall).ranges_m == pytest.approx([np.inf, 2.0, np.inf, np.inf])


def test_a_lidar_that_pitches_forward_sees_the_floor_ahead():
    floor = Plane([0.0, 0.0, 1.0], 0.0)
    nose_down = Pose3D(0.0, 0.0, 1.0, quaternion_from_euler(0.0, 0.2, 0.0))
    ranges = look(FOUR_BEAMS, nose_down, floor).ranges_m
    assert ranges[2] == pytest.approx(1.0 / math.sin(0.2))
    assert np.isinf(ranges[0])


def test_no_hits_nearer_than_range_min_or_beyond_range_max():
    for offset in (1.05, 11.05):
        ranges = look(FOUR_BEAMS, Pose3D(1.0, 0.0, 1.0), Plane([1.0, 0.0, 0.0], offset)).ranges_m
        assert np.isinf(ranges).all()


def test_noise_is_gaussian_repeatable_and_does_not_affect_misses():
    params = LidarParams(scan_range_rad=math.pi, step_size_rad=math.pi / 10000, noise_std_m=0.02)
    floor = Plane([0.0, 1.0, 0.0], 2.0)

    def scan(seed):
        return look(
            params, Pose3D(0.0, 0.0, 1.0), floor, random=np.random.default_rng(seed)
        ).ranges_m

    angles = params.angle_min_rad + params.step_size_rad * np.arange(params.beam_count)
    hit = np.isfinite(scan(1))
    assert (hit == (np.sin(angles) > 2.0 / 60.0)).all()
    errors = scan(1)[hit] - 2.0 / np.sin(angles[hit])
    assert abs(errors.mean()) < 4 * 0.02 / math.sqrt(hit.sum())
    assert errors.std() == pytest.approx(0.02, rel=0.05)
    assert np.array_equal(scan(1), scan(1))
    assert not np.array_equal(scan(1), scan(2))


@pytest.mark.parametrize(
    "changes, place",
    [
        ({"scan_range_rad": 7.0}, "scan_range"),
        ({"scan_range_rad": math.nan}, "scan_range"),
        ({"step_size_rad": 0.0}, "step_size"),
        ({"step_size_rad": 2.0 * math.pi / 7.5}, "step_size"),
        ({"range_min_m": 60.0}, "range_min"),
        ({"noise_std_m": -0.1}, "range_noise"),
    ],
)
def test_bad_parameters(changes, place):
    with pytest.raises(InputError) as caught:
        LidarParams(**changes)
    assert caught.value.problems[0].startswith(place)
